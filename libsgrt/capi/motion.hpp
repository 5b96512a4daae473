// What the results of all registrations have in common: the pose, the six numbers both ways, and their uncertainty.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "capi/capi.hpp"

namespace sgrt {

constexpr double kDegree = 3.14159265358979323846 / 180;

// A first guess, 4 x 4; NULL: the identity.
inline Pose start(const double* initial_reference_from_live) {
  return initial_reference_from_live ? rigid(initial_reference_from_live, "initial_reference_from_live") : Pose{};
}

// result: with reference_from_live, displacement, correction and covariance, NaN where none was found; info: a public
// struct with their namesakes.
template <class Result, class Info>
void write_motion(const Result& result, Info& info) {
  pose_to_rows(result.reference_from_live, info.reference_from_live);
  if (!result.reference_from_live.t.allFinite()) {  // the row 0 0 0 1 as well
    std::fill_n(info.reference_from_live, 16, std::numeric_limits<double>::quiet_NaN());
  }
  info.displacement = to_c(result.displacement);
  info.correction = to_c(result.correction);
  Eigen::Map<Mat6>(info.covariance) = result.covariance.transpose();  // row-major
  for (int i = 0; i < 3; ++i) {
    info.sigma_deg[i] = std::sqrt(result.covariance(i, i)) / kDegree;
    info.sigma_mm[i] = std::sqrt(result.covariance(i + 3, i + 3));
  }
}

}  // namespace sgrt
