// The check of a time-of-flight unit's numbers, one for rig.json and for a unit made in memory.
#pragma once

#include "rig/rig.hpp"

namespace sgrt {

// Throws kFormat naming the field.
void check_tof(const TofUnit& unit);

// a x = (B, C, S), the linear model of the taps: tap_k = B + C cos(tap_phase_k) + S sin(tap_phase_k), a row a tap.
Eigen::Matrix<double, Eigen::Dynamic, 3> tap_model(const std::vector<double>& tap_phase_rad);

}  // namespace sgrt
