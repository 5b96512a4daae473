// The start of a calibration, see calibration/initial.hpp.
#include "calibration/initial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"

namespace sgrt {
namespace {

// Moves the centroid to 0 and the mean distance from it to sqrt 2 (Hartley 1997).
Mat3 normaliser(const std::vector<Vec2>& points) {
  Vec2 mean = Vec2::Zero();
  for (const Vec2& p : points) mean += p / static_cast<double>(points.size());
  double distance = 0;
  for (const Vec2& p : points) distance += (p - mean).norm() / static_cast<double>(points.size());
  const double s = distance > 0 ? std::sqrt(2.0) / distance : 1;
  Mat3 N;
  N << s, 0, -s * mean.x(), 0, s, -s * mean.y(), 0, 0, 1;
  return N;
}

Vec2 through(const Mat3& H, const Vec2& p) {
  return (H * p.homogeneous()).hnormalized();
}

// H = K [r1 r2 t] with K = diag(f, f, 1) and the principal point taken off; the nearest rotation by SVD.
Pose pose_of_homography(const Mat3& H, const Camera& camera) {
  Mat3 K;
  K << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  Mat3 M = K.inverse() * H;
  M /= (M.col(0).norm() + M.col(1).norm()) / 2;
  if (M(2, 2) < 0) M = -M;  // in front of the camera
  Mat3 R;
  R << M.col(0), M.col(1), M.col(0).cross(M.col(1));
  const Eigen::JacobiSVD<Mat3> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU() * svd.matrixV().transpose(), M.col(2)};
}

// A few Gauss-Newton steps of the pose alone; the sum of squares in `cost`, infinity where it failed.
Pose refine_pose(const Target& target, const Camera& camera, const View& view, const Pose& pose, double& cost) {
  constexpr int kSteps = 6;  // the bundle goes on from there
  Bundle bundle{target, {view}, {LensPrior{}}, 0, true, 0, 1};
  bundle.views[0].camera = bundle.views[0].placement = 0;
  Scene scene;
  scene.cameras = {camera};
  scene.cameras[0].camera_from_room = Pose{};
  scene.room_from_target = {pose};
  try {
    cost = solve(Run{}, bundle, scene, kSteps).cost;
  } catch (const Error&) {
    cost = std::numeric_limits<double>::infinity();
  }
  return scene.room_from_target[0];
}

// The other pose that a plane seen from afar allows: its normal mirrored in the line of sight (Schweighofer and Pinz
// 2006).
Pose mirrored(const Pose& pose, const Vec2& centre) {
  const Vec3 middle = pose * Vec3(centre.x(), centre.y(), 0), sight = middle.normalized(), normal = pose.R.col(2);
  const Vec3 wanted = 2 * sight * sight.dot(normal) - normal;
  const Mat3 turn = Eigen::Quaterniond::FromTwoVectors(normal, wanted).toRotationMatrix();
  return {turn * pose.R, middle + turn * (pose.t - middle)};
}

// How well a focal length explains the views: the residuals of r1 . r2 = 0 and |r1| = |r2|, in rad.
double orthogonality_cost(const std::vector<Mat3>& centred, double f) {
  double cost = 0;
  for (const Mat3& H : centred) {
    const Vec3 a(H(0, 0) / f, H(1, 0) / f, H(2, 0)), b(H(0, 1) / f, H(1, 1) / f, H(2, 1));
    const double scale = 2 / (a.squaredNorm() + b.squaredNorm());
    cost += std::pow(scale * a.dot(b), 2) + std::pow(scale * (a.squaredNorm() - b.squaredNorm()) / 2, 2);
  }
  return cost;
}

}  // namespace

std::optional<Mat3> homography_of(const Target& target, const View& view) {
  std::vector<Vec2> from, to;
  for (std::size_t i = 0; i < view.index.size(); ++i) {
    if (!(view.weight[i] > 0)) continue;
    from.emplace_back(target.points.row(view.index[i]).head<2>());
    to.push_back(view.pixel[i]);
  }
  if (from.size() < 4) return std::nullopt;
  const Mat3 N = normaliser(from), M = normaliser(to);
  Eigen::Matrix<double, 9, 9> gram = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec2 p = through(N, from[i]), q = through(M, to[i]);
    Eigen::Matrix<double, 2, 9> rows;
    rows << p.x(), p.y(), 1, 0, 0, 0, -q.x() * p.x(), -q.x() * p.y(), -q.x(),  //
        0, 0, 0, p.x(), p.y(), 1, -q.y() * p.x(), -q.y() * p.y(), -q.y();
    gram += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(gram);
  if (!(eigen.eigenvalues()(1) > 1e-12 * eigen.eigenvalues()(8))) return std::nullopt;  // a line, or four points on it
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> h(eigen.eigenvectors().col(0).data());
  Mat3 H = M.inverse() * h * N;
  if (!H.allFinite()) return std::nullopt;
  if (std::abs(H(2, 2)) > 0) H /= H(2, 2);
  return H;
}

std::optional<Pose> plane_pose(const Target& target, const Camera& camera, const View& view) {
  const std::optional<Mat3> H = homography_of(target, view);
  if (!H) return std::nullopt;
  double cost, other_cost;
  const Pose pose = refine_pose(target, camera, view, pose_of_homography(*H, camera), cost);
  const Pose other = refine_pose(target, camera, view, mirrored(pose, target.centre), other_cost);
  if (!std::isfinite(std::min(cost, other_cost))) return std::nullopt;
  return other_cost < cost ? other : pose;
}

double first_focal_length(const Target& target, const std::vector<View>& views, int width, int height) {
  std::vector<Mat3> centred;
  Mat3 C = Mat3::Identity();
  C(0, 2) = -(width - 1) / 2.0;
  C(1, 2) = -(height - 1) / 2.0;
  for (const View& view : views) {
    if (const auto H = homography_of(target, view)) centred.emplace_back(C * *H);
  }
  // From a field of 127 degrees to one of 3; the cost is smooth in log f, so steps of 3 % find its valley.
  const double side = std::max(width, height);
  double best = side, best_cost = std::numeric_limits<double>::infinity();
  for (double f = 0.25 * side; f < 20 * side; f *= 1.03) {
    const double cost = orthogonality_cost(centred, f);
    if (cost < best_cost) {
      best_cost = cost;
      best = f;
    }
  }
  return best;
}

}  // namespace sgrt
