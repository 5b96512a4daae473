// The pose at which a model's points meet candidates of their kind. Alternatives are tried from every pair and triple
// that could be of the model's points. docs/theory/landmarks.md eq. 6-8.
#pragma once

#include <vector>

#include "core/geometry.hpp"
#include "shape/landmark_model.hpp"
#include "shape/scene.hpp"

namespace sgrt {

struct Match {
  Pose pose;  // live from model, the model first scaled by size
  double size = 1;
  double score = 0;     // 0 to 1, of the points whose place is seen
  double evidence = 0;  // for this pose against any other, nepers
  int seen = 0, matched = 0;
  std::vector<int> candidate;  // of each point, or -1
  std::vector<double> value;   // 0 to 1: how well it fits

  Vec3 place(const Vec3& x) const { return pose * Vec3(size * x); }
};

constexpr double kMatched = 0.25;  // value of a point that counts as matched

// The best matches at different poses, best first.
std::vector<Match> best_matches(const Run& run, const LandmarkScene& scene, const LandmarkModel& model);

}  // namespace sgrt
