// Rigid motions: SO(3) and SE(3) exponential, logarithm, adjoint, and the least-squares rigid fit of point pairs.
// Twists are (rotation rad, translation mm). Sola, Deray, Atchuthan, "A micro Lie theory" (2018), eq. 136-184;
// Arun, Huang, Blostein (1987); Horn (1987). docs/theory/geometry.md.
#pragma once

#include "core/eigen.hpp"

namespace sgrt {

// A rigid motion x -> R x + t. Variables are named a_from_b.
struct Pose {
  Mat3 R = Mat3::Identity();
  Vec3 t = Vec3::Zero();

  Vec3 operator*(const Vec3& x) const { return R * x + t; }
  Pose operator*(const Pose& b) const { return {R * b.R, R * b.t + t}; }
  Pose inverse() const { return {R.transpose(), -(R.transpose() * t)}; }
  Mat4 matrix() const;
};

// From 16 row-major numbers. Throws kInvalidArgument naming `name` unless it is a rigid motion within 1e-6; the
// rotation is then projected onto SO(3).
Pose pose_from_rows(const double* rows, const char* name);
void pose_to_rows(const Pose& pose, double* rows);

Mat3 skew(const Vec3& w);
Mat3 so3_exp(const Vec3& w);
Vec3 so3_log(const Mat3& R);  // |w| <= pi
Pose se3_exp(const Vec6& xi);
Vec6 se3_log(const Pose& T);
Mat6 adjoint(const Pose& T);  // T exp(xi) T^-1 = exp(Ad(T) xi), xi = (rotation, translation)

// The same motion seen with `pivot` as the origin: x -> T(x + pivot) - pivot.
Pose about(const Pose& T, const Vec3& pivot);

// argmin over rigid T of sum w |T p - q|^2 for rows p, q. weights may be empty. Throws kInsufficientData below 3 pairs,
// kDegenerate when they leave a turn free (collinear, coincident).
Pose rigid_fit_svd(const Points& p, const Points& q, const Eigen::VectorXd& weights = {});         // Arun 1987
Pose rigid_fit_quaternion(const Points& p, const Points& q, const Eigen::VectorXd& weights = {});  // Horn 1987

}  // namespace sgrt
