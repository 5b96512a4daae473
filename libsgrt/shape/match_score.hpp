// How well a model at a pose fits a scene: by the extrema that its landmarks meet, by the skin at their places and
// between them, and by what the sensor saw where there should be skin. docs/theory/landmarks.md eq. 7-8.
#pragma once

#include <cstddef>
#include <vector>

#include "shape/constellation.hpp"
#include "shape/sight.hpp"

namespace sgrt {

class Scorer {
 public:
  Scorer(const LandmarkScene& scene, const LandmarkModel& model);

  // Fills all but the pose and size of m. seen: asks the skin too, which takes longer.
  void operator()(Match& m, bool seen) const;

  // mm: how far landmark i may lie from where a right pose lays it.
  double tolerance(std::size_t i) const { return tolerance_[i]; }
  double curved(std::size_t i) const { return curved_[i]; }
  // Candidate c could be landmark i by its own looks.
  bool alike(std::size_t i, std::size_t c) const;

 private:
  void take_extrema(Match& m) const;
  bool ask_skin(Match& m, std::size_t i, double* all, double* skin) const;
  double likeness(std::size_t i, std::size_t row) const;
  double missing(const Vec3& x, const Vec3& normal, double tolerance) const;
  double skin_lies(const Match& m) const;
  double weight(std::size_t i) const;

  const LandmarkScene& scene_;
  const LandmarkModel& model_;
  Sight sight_;
  std::vector<int> sign_;
  std::vector<double> curved_, shape_, tolerance_;  // of the landmarks, as the scene's disc sees them
  std::vector<double> rare_;  // density of a landmark's extremum at its place, over that of all extrema of its sign
  std::vector<double> candidate_curved_, candidate_shape_, stands_out_;
};

// Another landmark has the same extremum with more right.
bool taken(const Match& match, std::size_t i);

}  // namespace sgrt
