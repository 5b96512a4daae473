// The search for the pose: Gauss-Newton steps on a subset of the live points, then refinement on all of them, with new
// pairs before every step. docs/theory/icp.md section 3.
#pragma once

#include <vector>

#include "registration/correspondences.hpp"
#include "registration/icp.hpp"

namespace sgrt {

constexpr std::int64_t kMinPairs = 6;

struct Search {
  Pose pose;                       // reference_from_live
  std::vector<Pair> pairs;         // of the last iteration
  std::vector<std::int64_t> last;  // closest reference points of the last iteration, a row of the problem
  int iterations = 0;
  bool converged = false;
  double limit;  // mm, of the closest points' distance; shrinks with the residuals
};

// Ends early, not converged, with fewer than kMinPairs pairs.
Search search(const Run& run, const Problem& problem, const Pose& initial, const IcpOptions& options);

}  // namespace sgrt
