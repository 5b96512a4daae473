// The curvature of the disparity round a match, from the slopes of its neighbours. docs/theory/stereo.md eq. 12.
#pragma once

#include "stereo/field.hpp"

namespace sgrt {

// Sets c20, c11, c02 of `match` (a plane per window is biased by curvature, but its slopes are not). False where there
// are too few solved neighbours within 8 px.
bool curvature_at(const Grid& grid, const MatchField& field, std::int64_t k, kernels::RowMatch& match);

// How much the variance of d grows by it: the neighbours' slopes share noise with d.
double bending_gain(int window, int stride);

}  // namespace sgrt
