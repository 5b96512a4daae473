// The noise of live points: as the surface tells it, or as neighbours on one surfel scatter. docs/theory/icp.md eq. 5.
#pragma once

#include "registration/search.hpp"

namespace sgrt {

// Variances along the reference's normals at a pose near the answer.
void fill_live_noise(const Run& run, const Reference& reference, const Surface& surface, const Pose& pose,
                     const PassOptions& options, Workspace& work);

}  // namespace sgrt
