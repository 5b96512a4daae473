// Bounds on matrices that let no NaN pass, as Eigen's maxCoeff does.
#pragma once

#include "core/eigen.hpp"

namespace sgrt {

// Whether all of it is finite and no larger than `most`.
template <class Derived>
bool within(const Eigen::MatrixBase<Derived>& m, double most) {
  return (m.array().abs() <= most).all();
}

}  // namespace sgrt
