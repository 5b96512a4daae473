// A patient's own landmarks carry a patch of skin each: all patches together give the pose, each by itself whether its
// landmark is there. docs/theory/landmarks.md eq. 9-11.
#pragma once

#include <vector>

#include "core/geometry.hpp"
#include "shape/locate.hpp"
#include "shape/scene.hpp"

namespace sgrt {

// How well the patches lie on the skin: the share of those that lie there at all that do so within their noise.
struct PatchFit {
  Pose live_from_model;
  double share = 0;     // 0 to 1, of the patch points that meet skin; small where few do
  double evidence = 0;  // 0 to 1, of all
};
// Improves live_from_model by every stride-th patch point.
PatchFit fit_patches(const Run& run, const LandmarkScene& scene, const LandmarkModel& model,
                     const Pose& live_from_model, std::size_t stride);

// Position, covariances and found of each landmark whose place or patch meets the live skin at a pose that fits.
// Returns of how many the patch does.
int place_by_patches(const Run& run, const LandmarkScene& scene, const LandmarkModel& model,
                     const Pose& live_from_model, std::vector<Landmark>& points);

}  // namespace sgrt
