// Symmetric 3 x 3 matrices as the six numbers that a surface keeps of a covariance: xx xy xz yy yz zz.
#pragma once

#include "core/eigen.hpp"

namespace sgrt {

using Packed = Eigen::Matrix<double, 1, 6>;

inline Mat3 unpacked(const Packed& c) {
  Mat3 C;
  C << c(0), c(1), c(2), c(1), c(3), c(4), c(2), c(4), c(5);
  return C;
}

inline Packed packed(const Mat3& C) {
  return {C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2)};
}

}  // namespace sgrt
