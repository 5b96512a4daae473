#include "laser/sweep.hpp"

#include <algorithm>
#include <cmath>

#include "core/median.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// The column under the motion of the body from its own instant to the reference's (eq. 15).
void put(const Column& c, const Pose& motion, std::int64_t column, LaserResult& r) {
  Surface& s = *r.surface;
  for (std::int64_t line = 0; line < r.height; ++line) {
    const std::int64_t at = line * r.width + column;
    const auto i = static_cast<std::size_t>(line), k = static_cast<std::size_t>(at);
    r.reason[k] = c.reason[i];
    if (c.reason[i] != 0) continue;
    r.stripe_px[k] = c.pixel[i];
    r.sigma_px[k] = static_cast<float>(c.pixel_sigma[i]);
    s.points.row(at) = (motion * Vec3(c.points.row(line).transpose())).transpose();
    s.covariance.row(at) = packed(motion.R * unpacked(c.covariance.row(line)) * motion.R.transpose());
  }
}

// What the calibration leaves uncertain moves all points together: its modes at each point, turned among themselves so
// that the kMaxModes strongest hold all but a little of the variance.
void add_modes(const Run& run, const Camera& camera, const LaserUnit& unit, const LaserModes& modes,
               const std::vector<const Column*>& columns, const std::vector<Pose>& motion, LaserResult& r) {
  const Eigen::Index all = modes.count();
  if (all == 0) return;
  Surface& s = *r.surface;
  std::vector<PlaneJacobian> jacobians(columns.size());
  for (std::size_t j = 0; j < columns.size(); ++j) jacobians[j] = light_plane_jacobian(unit, columns[j]->reading);
  const auto at = [&](std::size_t line, std::size_t column) {
    const Column& c = *columns[column];
    return point_modes(camera, modes, c.plane, jacobians[column], c.points.row(static_cast<Eigen::Index>(line)));
  };
  Eigen::MatrixXd power = Eigen::MatrixXd::Zero(all, all);
  const std::size_t step = 1 + static_cast<std::size_t>(r.point_count) / 500;
  std::size_t seen = 0;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(r.height); ++i) {
      if (columns[j]->reason[i] != 0 || seen++ % step != 0) continue;
      const Mat3X m = at(i, j);
      power += m.transpose() * m;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> strength(power);
  const Eigen::Index kept = std::min<Eigen::Index>(all, kMaxModes);
  const Eigen::MatrixXd turn = strength.eigenvectors().rightCols(kept).rowwise().reverse();
  s.modes.assign(static_cast<std::size_t>(kept), Points::Constant(s.size(), 3, kNaN));
  parallel_for(
      run, static_cast<std::int64_t>(columns.size()), 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto j = static_cast<std::size_t>(begin); j < static_cast<std::size_t>(end); ++j) {
          for (std::size_t i = 0; i < static_cast<std::size_t>(r.height); ++i) {
            if (columns[j]->reason[i] != 0) continue;
            const Mat3X m = motion[j].R * at(i, j) * turn;
            const auto k = static_cast<Eigen::Index>(i * static_cast<std::size_t>(r.width) + j);
            for (Eigen::Index mode = 0; mode < kept; ++mode)
              s.modes[static_cast<std::size_t>(mode)].row(k) = m.col(mode).transpose();
          }
        }
      },
      "calibration modes");
}

// sigma along the normal; where none is known, along the ray.
void set_sigma(const Vec3& centre, LaserResult& r) {
  Surface& s = *r.surface;
  std::vector<double> px, mm;
  px.reserve(static_cast<std::size_t>(r.point_count));
  mm.reserve(px.capacity());
  for (std::int64_t k = 0; k < s.size(); ++k) {
    ++r.reason_count[r.reason[static_cast<std::size_t>(k)]];
    if (!s.present(k)) continue;
    Vec3 n = s.normal(k);
    if (!n.allFinite()) n = (centre - s.point(k)).normalized();
    constexpr double kLeast = 1e-6;  // mm; a surface's sigma is positive
    s.sigma(k) = std::max(kLeast, std::sqrt(n.dot(unpacked(s.covariance.row(k)) * n)));
    px.push_back(r.sigma_px[static_cast<std::size_t>(k)]);
    mm.push_back(s.sigma(k));
  }
  r.median_sigma_px = median(px);
  r.median_sigma_mm = median(mm);
}

}  // namespace

Sweep::Sweep(const Rig& rig, const LaserUnit& unit, const LaserOptions& options)
    : camera_(rig.cameras[static_cast<std::size_t>(unit.camera)]),
      unit_(unit),
      options_(options),
      modes_(laser_modes(rig, unit)) {
  check_options(options);
}

const Column& Sweep::push(const Run& run, const ImageView& image, const ImageView* dark, double reading, double time) {
  const auto refuse = [](const char* name, double value, const std::string& expected) {
    fail(Status::kInvalidArgument, std::string(name) + ": " + text_of(value) + ", expected " + expected);
  };
  if (!std::isfinite(reading) || std::abs(reading) > 1e3) refuse("angle_rad", reading, "a finite angle");
  if (!std::isfinite(time)) refuse("time_s", time, "a finite time");
  if (!columns_.empty() && time < columns_.back().time)
    refuse("time_s", time, "at least that of the frame before, " + text_of(columns_.back().time));
  for (std::size_t i = 0; i < columns_.size() && unit_.mirror; ++i) {
    if (columns_[i].reading == reading)
      refuse("angle_rad", reading, "an angle of its own, frame " + std::to_string(i) + " has it too");
  }
  if (columns_.empty()) across_ = stripe_runs_across(camera_, light_plane(unit_, reading));
  columns_.push_back(make_column(run, camera_, unit_, options_, across_, image, dark, reading, time));
  return columns_.back();
}

LaserResult Sweep::finish(const Run& run, const PoseTrack* track, double reference_time) const {
  if (columns_.empty()) fail(Status::kInsufficientData, "frames: none, expected at least one");
  if (track) check_track(*track);
  std::vector<const Column*> sorted;
  sorted.reserve(columns_.size());
  for (const Column& c : columns_) sorted.push_back(&c);
  if (unit_.mirror)
    std::sort(sorted.begin(), sorted.end(), [](const Column* a, const Column* b) { return a->reading < b->reading; });
  LaserResult r;
  r.columns = across_;
  r.height = across_ ? camera_.width : camera_.height;
  r.width = static_cast<int>(sorted.size());
  r.reference_time = std::isfinite(reference_time) ? reference_time : columns_.front().time;
  const std::int64_t n = static_cast<std::int64_t>(r.height) * r.width;
  if (n > kMaxPoints) fail(Status::kLimit, "frames: " + std::to_string(n) + " points, expected at most 50 million");
  r.surface = std::make_shared<Surface>();
  Surface& s = *r.surface;
  s.height = r.height, s.width = r.width;
  s.points = s.normals = Points::Constant(n, 3, kNaN);
  s.sigma = Eigen::VectorXd::Constant(n, kNaN);
  s.covariance = Covariances::Constant(n, 6, kNaN);
  r.reason.assign(static_cast<std::size_t>(n), 0);
  r.stripe_px.assign(static_cast<std::size_t>(n), kNaN);
  r.sigma_px.assign(static_cast<std::size_t>(n), std::numeric_limits<float>::quiet_NaN());
  std::vector<Pose> motion(sorted.size());
  std::int64_t stripes = 0;
  for (std::size_t j = 0; j < sorted.size(); ++j) {
    const Column& c = *sorted[j];
    if (track) motion[j] = pose_at(*track, r.reference_time) * pose_at(*track, c.time).inverse();
    put(c, motion[j], static_cast<std::int64_t>(j), r);
    r.angle.push_back(c.reading);
    r.time.push_back(c.time);
    r.point_count += c.point_count;
    stripes += c.stripe_count;
  }
  set_grid_normals(run, camera_.centre_in_room(), s);
  set_sigma(camera_.centre_in_room(), r);
  add_modes(run, camera_, unit_, modes_, sorted, motion, r);
  if (r.point_count == 0) {
    const std::int64_t outside = r.reason_count[2];
    r.status = stripes > 0 && outside == 0 ? Status::kDegenerate : Status::kNotFound;
    r.message = stripes == 0  ? "no stripe in any of the frames, expected a bright line"
                : outside > 0 ? "no point of the sweep lies in the working volume"
                              : "the light plane is parallel to the rays of the stripe, or lies behind the camera: no "
                                "point can be placed; check the laser of the rig";
  }
  return r;
}

}  // namespace sgrt
