// The sparse grid that carries the shared warp: seeded from the coarse map, two dense steps, growth along the surface,
// curvature, edges. docs/theory/stereo.md.
#pragma once

#include "stereo/matcher.hpp"

namespace sgrt {

// Leaves in `work` the nodes with their curvature, their torn cells and edges, and the warp by them.
void solve_nodes(const Run& run, const Matcher& matcher, const RectifiedImage& left, const RectifiedImage& right,
                 const CoarseMap& coarse, MatchWork& work);

}  // namespace sgrt
