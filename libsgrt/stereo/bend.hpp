// The curvature of the disparity round a match, from the slopes of its neighbours. docs/theory/stereo.md eq. 14.
#pragma once

#include "core/run.hpp"
#include "stereo/field.hpp"

namespace sgrt {

// Sets c20, c11, c02 of `match` (a plane per window is biased by curvature, but its slopes are not). False where there
// are too few solved neighbours within 8 px.
bool curvature_at(const Grid& grid, const MatchField& field, std::int64_t k, kernels::RowMatch& match);

// What white image noise does through it, in units of the variance of a flat match: the variance of the correction
// itself, and of d when it is corrected (the neighbours' slopes share noise with d).
struct BendingNoise {
  double correction = 0, gain = 1;
};
BendingNoise bending_noise(int window, int stride);

// Curvature that the slopes of the nodes were too far apart to show, from the field itself: moves d where that is
// beyond noise, and widens the sigma by half of it. `shift` is work. docs/theory/stereo.md "What is still smoothed".
void unsmooth(const Run& run, const Grid& grid, const std::vector<std::uint8_t>& bent, std::vector<float>& shift,
              MatchField& field);

// (w^2 - 1)/12: the second moment of a window.
inline double second_moment(int window) {
  return (static_cast<double>(window) * window - 1) / 12;
}

}  // namespace sgrt
