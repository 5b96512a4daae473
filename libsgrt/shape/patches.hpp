// A patient's own landmarks carry a patch of skin each: all patches together give the pose, each by itself how far its
// landmark has moved against the others. docs/theory/landmarks.md eq. 9-11.
#pragma once

#include <vector>

#include "core/geometry.hpp"
#include "shape/locate.hpp"
#include "shape/scene.hpp"

namespace sgrt {

// Improves live_from_model and fills position, covariance and found of each landmark whose patch meets the live skin.
// Returns how many do.
int refine_by_patches(const Run& run, const Scene& scene, const LandmarkModel& model, Pose& live_from_model,
                      std::vector<Landmark>& points);

}  // namespace sgrt
