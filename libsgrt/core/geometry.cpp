// Rigid motions, see core/geometry.hpp. Coefficients that are a small difference over a small number come from their
// series near zero (theta^2 < kSmall), where the terms left out lie below the last bit. docs/theory/geometry.md.
#include "core/geometry.hpp"

#include <cmath>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kSmall = 1e-2;

// sin(theta) / theta, (1 - cos(theta)) / theta^2 and (theta - sin(theta)) / theta^3.
struct Coefficients {
  double a, b, c;
};
Coefficients coefficients(double t2) {
  if (t2 < kSmall) {
    return {1 - t2 / 6 * (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110)))),
            0.5 * (1 - t2 / 12 * (1 - t2 / 30 * (1 - t2 / 56 * (1 - t2 / 90 * (1 - t2 / 132))))),
            1.0 / 6 * (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110))))};
  }
  const double t = std::sqrt(t2), half = std::sin(t / 2);
  return {std::sin(t) / t, 2 * half * half / t2, (t - std::sin(t)) / (t2 * t)};
}

// (1 - (theta / 2) cot(theta / 2)) / theta^2, of the inverse of V.
double inverse_coefficient(double t2) {
  if (t2 < kSmall) return 1.0 / 12 + t2 * (1.0 / 720 + t2 * (1.0 / 30240 + t2 * (1.0 / 1209600 + t2 / 47900160)));
  const double half = std::sqrt(t2) / 2;
  return (1 - half * std::cos(half) / std::sin(half)) / t2;
}

double orthonormality_error(const Mat3& R) {
  return (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
}

}  // namespace

Mat4 Pose::matrix() const {
  Mat4 T = Mat4::Identity();
  T.topLeftCorner<3, 3>() = R;
  T.topRightCorner<3, 1>() = t;
  return T;
}

Pose pose_from_rows(const double* rows, const char* name) {
  constexpr double kTolerance = 1e-6, kExact = 1e-15;
  const auto refuse = [&](const std::string& why) { fail(Status::kInvalidArgument, name + (": " + why)); };
  Mat4 T;
  for (int i = 0; i < 16; ++i) T(i / 4, i % 4) = rows[i];
  if (!T.allFinite()) refuse("expected 16 finite numbers");
  const double last_row = (T.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff();
  if (last_row > kTolerance) refuse("not a rigid motion, expected the last row 0 0 0 1");
  Pose pose{T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()};
  const double error = orthonormality_error(pose.R);
  if (!(error <= kTolerance)) {
    refuse("not a rigid motion, R^T R differs from the identity by " + text_of(error) + ", expected at most 1e-6");
  }
  if (pose.R.determinant() < 0) refuse("not a rigid motion but a reflection, det R = -1");
  // Newton's iteration for the polar factor converges quadratically: from 1e-6 two steps reach the last bit. What is
  // there already stays as it is, so that a pose written and read again keeps its bits.
  for (int i = 0; i < 3 && orthonormality_error(pose.R) > kExact; ++i) {
    pose.R = (0.5 * pose.R * (3 * Mat3::Identity() - pose.R.transpose() * pose.R)).eval();
  }
  return pose;
}

void pose_to_rows(const Pose& pose, double* rows) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{rows} = pose.matrix();
}

Mat3 skew(const Vec3& w) {
  Mat3 W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return W;
}

Mat3 so3_exp(const Vec3& w) {
  const Coefficients k = coefficients(w.squaredNorm());
  const Mat3 W = skew(w);
  return Mat3::Identity() + k.a * W + k.b * W * W;
}

// By way of the quaternion, which is well conditioned at every angle, pi included.
Vec3 so3_log(const Mat3& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double n2 = q.vec().squaredNorm(), n = std::sqrt(n2), w = q.w();
  if (n < 1e-4 * w) return q.vec() * (2 / w * (1 - n2 / (3 * w * w)));
  return q.vec() * (2 * std::atan2(n, w) / n);
}

Pose se3_exp(const Vec6& xi) {
  const Vec3 w = xi.head<3>(), v = xi.tail<3>();
  const Coefficients k = coefficients(w.squaredNorm());
  const Mat3 W = skew(w);
  return {Mat3::Identity() + k.a * W + k.b * W * W, v + k.b * w.cross(v) + k.c * w.cross(w.cross(v))};
}

Vec6 se3_log(const Pose& T) {
  const Vec3 w = so3_log(T.R);
  const double d = inverse_coefficient(w.squaredNorm());
  Vec6 xi;
  xi << w, T.t - 0.5 * w.cross(T.t) + d * w.cross(w.cross(T.t));
  return xi;
}

Mat6 adjoint(const Pose& T) {
  Mat6 A = Mat6::Zero();
  A.topLeftCorner<3, 3>() = T.R;
  A.bottomLeftCorner<3, 3>() = skew(T.t) * T.R;
  A.bottomRightCorner<3, 3>() = T.R;
  return A;
}

Pose about(const Pose& T, const Vec3& pivot) {
  return {T.R, T.t + (T.R * pivot - pivot)};
}

}  // namespace sgrt
