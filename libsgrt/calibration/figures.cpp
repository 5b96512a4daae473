// Figures and warnings of a calibration, see calibration/figures.hpp.
#include "calibration/figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "calibration/robust.hpp"
#include "calibration/text.hpp"
#include "core/median.hpp"
#include "rig/uncertainty.hpp"

namespace sgrt {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

int cell_of(const Camera& camera, const Vec2& pixel) {
  const auto step = [](double x, int side, int cells) {
    return std::clamp(static_cast<int>(std::floor((x + 0.5) / side * cells)), 0, cells - 1);
  };
  return step(pixel.y(), camera.height, kCellsDown) * kCellsAcross + step(pixel.x(), camera.width, kCellsAcross);
}

int first_parameter(const CalibrationResult& r, int camera) {
  int at = 0;
  for (int c = 0; c < camera; ++c) at += lens_count(r.scene.cameras[c]) + 6;
  return at;
}

// Tilt, spread and distance of the boards in front of a camera; returns the median distance.
double describe_placements(const CalibrationResult& r, int camera, CameraFigures& f) {
  f.tilt_min_deg = 180;
  f.distance_min = std::numeric_limits<double>::infinity();
  std::vector<Vec3> normals;
  std::vector<double> distances;
  const Vec2& middle = r.bundle.target.centre;
  for (const View& view : r.bundle.views) {
    if (view.camera != camera) continue;
    const Pose pose = r.scene.cameras[camera].camera_from_room * r.scene.room_from_target[view.placement];
    const Vec3 at = pose * Vec3(middle.x(), middle.y(), 0), normal = pose.R.col(2);
    const double tilt = std::acos(std::min(1.0, std::abs(normal.dot(at.normalized())))) / kDegree;
    f.tilt_min_deg = std::min(f.tilt_min_deg, tilt);
    f.tilt_max_deg = std::max(f.tilt_max_deg, tilt);
    f.distance_min = std::min(f.distance_min, at.norm());
    f.distance_max = std::max(f.distance_max, at.norm());
    for (const Vec3& other : normals)
      f.tilt_spread_deg = std::max(f.tilt_spread_deg, std::acos(std::clamp(normal.dot(other), -1.0, 1.0)) / kDegree);
    normals.push_back(normal);
    distances.push_back(at.norm());
    ++f.views;
  }
  return median(distances);
}

// Residuals that a missing term leaves: their mean in each cell against what noise leaves there (eq. 17).
double pattern_of(const CalibrationResult& r, int camera) {
  std::vector<Vec2> sum(kCellsAcross * kCellsDown, Vec2::Zero());
  std::vector<int> count(sum.size(), 0);
  for (const View& view : r.bundle.views) {
    if (view.camera != camera) continue;
    const std::vector<Vec2> residuals = residuals_of(r.bundle, r.scene, view);
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      if (!(view.weight[i] > 0)) continue;
      const auto cell = static_cast<std::size_t>(cell_of(r.scene.cameras[camera], view.pixel[i]));
      sum[cell] += residuals[i];
      ++count[cell];
    }
  }
  double square = 0, cells = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    if (count[i] < 5) continue;
    square += sum[i].squaredNorm() / count[i] / (r.noise * r.noise);
    cells += 2;
  }
  return cells > 0 ? square / cells : kNaN;
}

Eigen::MatrixXd lens_covariance(const CalibrationResult& r, int camera) {
  const int at = first_parameter(r, camera), n = lens_count(r.scene.cameras[camera]);
  return r.covariance.block(at, at, n, n);
}

// Points on a grid of the image at some distances (camera axes), and the derivatives of their pixels.
constexpr int kMapAcross = 9, kMapDown = 7;
struct Field {
  std::vector<Vec3> points;
  std::vector<bool> covered;         // lies in a cell with corners
  Eigen::MatrixXd by_lens, by_pose;  // 2 rows a point; 6 columns of the pose
  Eigen::MatrixXd fit;               // the pose, least squares, that the covered rows ask for
};

Field field_of(const CalibrationResult& r, int c, const std::vector<double>& distances) {
  const Camera& camera = r.rig.cameras[c];
  const std::vector<bool> cells = coverage_of(r, c);
  Field field;
  const auto rows = static_cast<Eigen::Index>(2 * kMapAcross * kMapDown * distances.size());
  const int n = lens_count(camera);
  field.by_lens = Eigen::MatrixXd::Zero(rows, n);
  field.by_pose = Eigen::MatrixXd::Zero(rows, 6);
  Eigen::MatrixXd held = field.by_pose;
  for (double distance : distances) {
    for (int i = 0; i < kMapAcross * kMapDown; ++i) {
      const int across = i % kMapAcross, down = i / kMapAcross;
      const Vec2 pixel(across * (camera.width - 1.0) / (kMapAcross - 1), down * (camera.height - 1.0) / (kMapDown - 1));
      const auto row = 2 * static_cast<Eigen::Index>(field.points.size());
      const Vec3 x = distance * undistort(camera, pixel).homogeneous();
      Vec2 p;
      Mat23 by_point;
      LensJacobian by_lens;
      field.points.push_back(x);
      field.covered.push_back(cells[cell_of(camera, pixel)]);
      if (!project_with_lens(camera, x, p, by_point, by_lens)) continue;
      field.by_lens.middleRows<2>(row) = by_lens.leftCols(n);
      field.by_pose.middleRows<2>(row) << -by_point * skew(x), by_point;
      if (field.covered.back()) held.middleRows<2>(row) = field.by_pose.middleRows<2>(row);
    }
  }
  // Columns of rad and mm: scaled alike before the normal equations.
  const Eigen::VectorXd d = held.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const Eigen::MatrixXd H = held * d.asDiagonal();
  field.fit = d.asDiagonal() * Eigen::MatrixXd(H.transpose() * H).ldlt().solve(Eigen::MatrixXd(H.transpose()));
  return field;
}

void set_map(const CalibrationResult& r, int c, const std::vector<double>& distances, CameraFigures& f) {
  const Camera& camera = r.rig.cameras[c];
  const Field field = field_of(r, c, distances);
  const Eigen::MatrixXd F = field.by_lens - field.by_pose * (field.fit * field.by_lens), C = lens_covariance(r, c);
  f.map_distances = distances;
  for (int i = 0; i < kMapAcross; ++i) f.map_x.push_back(i * (camera.width - 1.0) / (kMapAcross - 1));
  for (int i = 0; i < kMapDown; ++i) f.map_y.push_back(i * (camera.height - 1.0) / (kMapDown - 1));
  for (std::size_t k = 0; k < distances.size(); ++k) {
    Eigen::MatrixXd layer(kMapDown, kMapAcross);
    for (int i = 0; i < kMapAcross * kMapDown; ++i) {
      const auto J = F.middleRows<2>(2 * (static_cast<Eigen::Index>(k) * kMapAcross * kMapDown + i));
      layer(i / kMapAcross, i % kMapAcross) = std::sqrt((J * C * J.transpose()).trace() / 2);
    }
    f.projection_sigma_worst = std::max(f.projection_sigma_worst, layer.maxCoeff());
    if (k == 1) f.projection_sigma_centre = layer(kMapDown / 2, kMapAcross / 2);
    f.map_sigma.push_back(std::move(layer));
  }
}

void describe_volume(CalibrationResult& r) {
  for (const StereoPair& pair : r.rig.pairs) {
    const Camera& left = r.rig.cameras[pair.left];
    for (double distance : r.cameras[pair.left].map_distances) {
      const Vec3 x = left.camera_from_room.inverse() * Vec3(0, 0, distance);
      const Mat3X modes = point_modes(r.rig, pair, x);
      const Mat3 C = modes * modes.transpose() + triangulation_covariance(r.rig, pair, x, r.noise);
      r.volume.push_back({pair.id, distance, C.diagonal().cwiseSqrt()});
    }
  }
}

void warn_of(const CalibrationData& data, int camera, double pattern, CalibrationResult& r) {
  constexpr double kCoverage = 0.6, kSpreadDeg = 30, kDistances = 1.25, kPattern = 3, kPoor = 0.5, kMostOut = 0.05;
  const CameraFigures& f = r.cameras[camera];
  const std::string name = "camera " + in_quotes(data.cameras[camera].id) + ": ";
  const auto warn = [&](const std::string& text) { r.warnings.push_back(name + text); };
  if (f.coverage < kCoverage)
    warn("thin coverage, corners in " + rounded(100 * f.coverage, 0) + " % of the image; the projection is known to " +
         rounded(f.projection_sigma_worst, 3) + " px in its worst corner, " + rounded(f.projection_sigma_centre, 3) +
         " px in the middle");
  if (f.tilt_spread_deg < kSpreadDeg)
    warn("too little tilt, the board's direction differs by " + rounded(f.tilt_spread_deg, 0) +
         " deg between images, expected 40 and more");
  if (f.distance_max < kDistances * f.distance_min)
    warn("few distances, " + rounded(f.distance_min, 0) + " to " + rounded(f.distance_max, 0) +
         " mm, expected a range of 1.5 to 1");
  if (f.rms > kPoor) warn("RMS " + rounded(f.rms, 3) + " px, above 0.5 px a calibration is to be rejected");
  const auto of_camera = [&](const Discarded& d) { return d.camera == camera && d.point >= 0; };
  const auto out = static_cast<double>(std::count_if(r.discarded.begin(), r.discarded.end(), of_camera));
  if (out > kMostOut * (f.corners + out))
    warn(rounded(out, 0) + " corners of " + rounded(f.corners + out, 0) +
         " do not fit, expected one in a hundred at most: are the points named as the board is?");
  if (pattern > kPattern)
    warn("the residuals leave a pattern over the image, " + rounded(pattern, 1) +
         " times what noise leaves: the lens model lacks a term, or the board is not what was told");
}

}  // namespace

std::vector<bool> coverage_of(const CalibrationResult& r, int camera) {
  std::vector<bool> covered(kCellsAcross * kCellsDown, false);
  for (const View& view : r.bundle.views) {
    if (view.camera != camera) continue;
    for (std::size_t i = 0; i < view.pixel.size(); ++i) {
      if (view.weight[i] > 0) covered[cell_of(r.scene.cameras[camera], view.pixel[i])] = true;
    }
  }
  return covered;
}

void describe_cameras(const CalibrationData& data, CalibrationResult& r) {
  for (int c = 0; c < static_cast<int>(data.cameras.size()); ++c) {
    CameraFigures& f = r.cameras.emplace_back();
    f.split_rms = f.split_predicted = kNaN;
    f.rms = rms_of(r.bundle, r.scene, c, false);
    f.rms_all = rms_of(r.bundle, r.scene, c, true);
    for (const View& view : r.bundle.views) {
      if (view.camera == c)
        f.corners +=
            static_cast<int>(std::count_if(view.weight.begin(), view.weight.end(), [](double w) { return w > 0; }));
    }
    const double middle = describe_placements(r, c, f);
    const std::vector<bool> covered = coverage_of(r, c);
    f.coverage =
        static_cast<double>(std::count(covered.begin(), covered.end(), true)) / static_cast<double>(covered.size());
    f.pattern = pattern_of(r, c);
    set_map(r, c, {f.distance_min, middle, f.distance_max}, f);
    warn_of(data, c, f.pattern, r);
  }
  std::vector<double> distances = r.cameras[0].map_distances;
  r.rig.uncertainty = compact(r.rig.cameras, r.covariance, distances, r.noise);
  describe_volume(r);
}

void compare_halves(const CalibrationResult& a, const CalibrationResult& b, CalibrationResult& r) {
  constexpr double kAgree = 2;
  for (int c = 0; c < static_cast<int>(r.cameras.size()); ++c) {
    CameraFigures& f = r.cameras[c];
    const Field field = field_of(r, c, f.map_distances);
    const LensVector change = lens_of(a.rig.cameras[c]) - lens_of(b.rig.cameras[c]);
    Eigen::VectorXd difference(field.by_lens.rows());
    for (std::size_t i = 0; i < field.points.size(); ++i) {
      difference.segment<2>(2 * static_cast<Eigen::Index>(i)) =
          project_camera(a.rig.cameras[c], field.points[i]) - project_camera(b.rig.cameras[c], field.points[i]);
    }
    const Eigen::Index n = field.by_lens.cols();
    if (!difference.allFinite()) difference = field.by_lens * change.head(n);  // past a fold: to first order
    difference -= field.by_pose * field.fit * difference;
    const Eigen::MatrixXd F = field.by_lens - field.by_pose * (field.fit * field.by_lens);
    const Eigen::MatrixXd C = lens_covariance(a, c) + lens_covariance(b, c);
    double found = 0, predicted = 0;
    int count = 0;
    for (std::size_t i = 0; i < field.points.size(); ++i) {
      if (!field.covered[i]) continue;
      const auto row = 2 * static_cast<Eigen::Index>(i);
      found += difference.segment<2>(row).squaredNorm();
      predicted += (F.middleRows<2>(row) * C * F.middleRows<2>(row).transpose()).trace();
      ++count;
    }
    f.split_rms = std::sqrt(found / (2 * count));
    f.split_predicted = std::sqrt(predicted / (2 * count));
    if (!(f.split_rms <= kAgree * f.split_predicted))
      r.warnings.push_back("camera " + in_quotes(r.rig.cameras[c].id) + ": two halves of the images differ by " +
                           rounded(f.split_rms, 3) + " px, predicted " + rounded(f.split_predicted, 3) +
                           " px: the model or the board is not what the images show");
  }
}

}  // namespace sgrt
