// The only way to Eigen: a broken precondition throws instead of aborting the process. Include it before any header
// (Ceres') that includes Eigen by itself.
#pragma once

#ifdef eigen_assert
#error "include core/eigen.hpp before any other Eigen header"
#endif

namespace sgrt {
[[noreturn]] void fail_eigen(const char* condition);
}
#define eigen_assert(condition)                       \
  do {                                                \
    if (!(condition)) ::sgrt::fail_eigen(#condition); \
  } while (false)

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace sgrt {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat3 = Eigen::Matrix3d;
using Mat4 = Eigen::Matrix4d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Mat23 = Eigen::Matrix<double, 2, 3>;
using Mat32 = Eigen::Matrix<double, 3, 2>;
// N x 3, row-major, as numpy has it: one point a row.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

}  // namespace sgrt

#include "core/eigen_once.inl"
