// Propagation of a rig's uncertainty, see rig/uncertainty.hpp.
#include "rig/uncertainty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// d pixels of both cameras by the point; false where one does not see it.
bool both_jacobians(const Rig& rig, const StereoPair& pair, const Vec3& x, Eigen::Matrix<double, 4, 3>& J) {
  Mat23 left, right;
  project(rig.cameras[pair.left], x, &left);
  project(rig.cameras[pair.right], x, &right);
  J << left, right;
  return J.allFinite();
}

}  // namespace

bool pixel_by_parameters(const Camera& camera, const Vec3& x_in_camera, Mat2X& J) {
  Vec2 pixel;
  Mat23 by_point;
  LensJacobian by_lens;
  if (!project_with_lens(camera, x_in_camera, pixel, by_point, by_lens)) return false;
  const int n = lens_count(camera);
  J.resize(2, n + 6);
  J.leftCols(n) = by_lens.leftCols(n);
  J.middleCols<3>(n) = -by_point * skew(x_in_camera);
  J.rightCols<3>() = by_point;
  return true;
}

Eigen::MatrixXd modes_of(const Rig& rig, const std::vector<std::string>& names) {
  const RigUncertainty& u = rig.uncertainty;
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(names.size()), u.modes.cols());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto found = std::find(u.parameters.begin(), u.parameters.end(), names[i]);
    if (found != u.parameters.end())
      modes.row(static_cast<Eigen::Index>(i)) = u.modes.row(found - u.parameters.begin());
  }
  return modes;
}

Eigen::MatrixXd camera_modes(const Rig& rig, const Camera& camera) {
  return modes_of(rig, parameter_names(camera));
}

Mat2X pixel_modes(const Rig& rig, int camera, const Vec3& x_in_room) {
  const Camera& c = rig.cameras[camera];
  Mat2X J;
  if (!project(c, x_in_room).allFinite() || !pixel_by_parameters(c, c.camera_from_room * x_in_room, J))
    return Mat2X::Constant(2, rig.uncertainty.modes.cols(), kNaN);
  return J * camera_modes(rig, c);
}

Mat3X point_modes(const Rig& rig, const StereoPair& pair, const Vec3& x_in_room) {
  Eigen::Matrix<double, 4, 3> J;
  if (!both_jacobians(rig, pair, x_in_room, J)) return Mat3X::Constant(3, rig.uncertainty.modes.cols(), kNaN);
  Eigen::Matrix<double, 4, Eigen::Dynamic> moved(4, rig.uncertainty.modes.cols());
  moved.topRows<2>() = pixel_modes(rig, pair.left, x_in_room);  // not by <<, which must not be left by an exception
  moved.bottomRows<2>() = pixel_modes(rig, pair.right, x_in_room);
  return -Mat3(J.transpose() * J).ldlt().solve(Mat3X(J.transpose() * moved));
}

Mat3X left_ray_modes(const Rig& rig, const StereoPair& pair, const Vec3& x_in_room) {
  Eigen::Matrix<double, 4, 3> J;
  if (!both_jacobians(rig, pair, x_in_room, J)) return Mat3X::Constant(3, rig.uncertainty.modes.cols(), kNaN);
  const Mat23 left = J.topRows<2>(), right = J.bottomRows<2>();
  const Vec3 ray = (x_in_room - rig.cameras[pair.left].centre_in_room()).normalized();
  const Vec2 by_depth = right * ray;
  // Across the ray by the left pixel, then along it by the right one.
  const Mat3X across =
      -left.transpose() * (left * left.transpose()).ldlt().solve(pixel_modes(rig, pair.left, x_in_room));
  const Mat2X off = pixel_modes(rig, pair.right, x_in_room) + right * across;
  return across - ray * (by_depth.transpose() * off) / by_depth.squaredNorm();
}

Mat3 triangulation_covariance(const Rig& rig, const StereoPair& pair, const Vec3& x_in_room, double noise_px) {
  Eigen::Matrix<double, 4, 3> J;
  if (!both_jacobians(rig, pair, x_in_room, J)) return Mat3::Constant(kNaN);
  return (J.transpose() * J).inverse() * (noise_px * noise_px);
}

RigUncertainty compact(const std::vector<Camera>& cameras, const Eigen::MatrixXd& covariance,
                       const std::vector<double>& distances, double residual_px) {
  constexpr int kGrid = 4;
  constexpr double kLeft = 1e-7;
  RigUncertainty u;
  u.residual_px = residual_px;
  std::vector<Mat2X> rows;
  Eigen::Index at = 0;
  std::vector<Eigen::Index> starts;
  for (const Camera& camera : cameras) {
    for (const std::string& name : parameter_names(camera)) u.parameters.push_back(name);
    const Eigen::Index own = lens_count(camera) + 6;
    for (double distance : distances) {
      for (int i = 0; i <= kGrid * kGrid + 2 * kGrid; ++i) {
        const int across = i % (kGrid + 1), down = i / (kGrid + 1);
        const Vec2 pixel(across * (camera.width - 1.0) / kGrid, down * (camera.height - 1.0) / kGrid);
        Mat2X J;
        if (!pixel_by_parameters(camera, distance * undistort(camera, pixel).homogeneous(), J)) continue;
        Mat2X row = Mat2X::Zero(2, covariance.cols());
        row.middleCols(at, own) = J;
        rows.push_back(row);
      }
    }
    at += own;
  }
  Eigen::MatrixXd F(2 * static_cast<Eigen::Index>(rows.size()), covariance.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) F.middleRows<2>(2 * static_cast<Eigen::Index>(i)) = rows[i];
  // C = L L^T by the eigenvectors of C scaled to a unit diagonal; the modes are L V, V of F L = U S V^T.
  const Eigen::VectorXd d = covariance.diagonal().cwiseSqrt();
  const Eigen::VectorXd w = d.unaryExpr([](double x) { return x > 0 ? 1 / x : 0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> scaled(
      Eigen::MatrixXd(w.asDiagonal() * covariance * w.asDiagonal()));
  const Eigen::MatrixXd L =
      d.asDiagonal() * scaled.eigenvectors() * scaled.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  const Eigen::MatrixXd G = F * L;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> effect(Eigen::MatrixXd(G.transpose() * G));
  const Eigen::VectorXd& variance = effect.eigenvalues();  // smallest first
  double left = 0;
  Eigen::Index dropped = 0;
  while (dropped < variance.size() && left + std::max(variance(dropped), 0.0) <= kLeft * variance.sum()) {
    left += std::max(variance(dropped), 0.0);
    ++dropped;
  }
  const Eigen::Index kept = variance.size() - dropped;
  u.modes = (L * effect.eigenvectors().rightCols(kept)).rowwise().reverse();
  for (Eigen::Index i = 0; i < kept; ++i) {  // a sign of its own, so that the same rig is the same text
    Eigen::Index largest;
    (w.asDiagonal() * u.modes.col(i)).cwiseAbs().maxCoeff(&largest);
    if (u.modes(largest, i) < 0) u.modes.col(i) *= -1;
  }
  return u;
}

}  // namespace sgrt
