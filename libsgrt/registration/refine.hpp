// The refinement of one round: least squares over fixed pairs by ceres::TinySolver, for the twist at the isocentre. The
// solver sees seven residuals instead of one a pair: the square root of the 21 + 6 + 1 sums of the normal equations,
// which has their cost, gradient and Gauss-Newton matrix. docs/theory/icp.md eq. 8-9.
#pragma once

#include "core/geometry.hpp"
#include "registration/pass.hpp"

namespace sgrt {

// Residuals f and their Jacobian J: J^T J = A, J^T f = g, f^T f = cost.
struct SquareRoot {
  Eigen::Matrix<double, 7, 1> f;
  Eigen::Matrix<double, 7, 6> J;
};
// False where A is singular.
bool square_root(const Mat6& A, const Vec6& g, double cost, SquareRoot& root);

// The twist about the field's centre that least squares asks for. sums: about the centre; lever: of the field, mm.
Vec6 refine(const Sums& sums, const Vec3& centre, const Vec3& isocentre, double lever);

}  // namespace sgrt
