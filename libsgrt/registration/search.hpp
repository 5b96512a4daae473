// The search for the pose, coarse to fine: steps on a subset of the live points down the levels of the reference, then
// all points with inlier weights and the refinement. docs/theory/icp.md section 3.
#pragma once

#include <vector>

#include "registration/icp.hpp"
#include "registration/live.hpp"
#include "registration/pass.hpp"

namespace sgrt {

constexpr int kMinPairs = 6;

// Buffers of a registration, kept from one live surface to the next, so that a stream of them allocates nothing.
struct Workspace {
  LivePoints live, subset;
  std::vector<float> r, w, subset_r, subset_w;
  std::vector<std::int32_t> surfel;
  std::vector<float> values, scratch, last;  // of medians and of the noise
  std::vector<std::vector<double>> weights;  // of the pairs on each surfel, level by level
  std::vector<Vec6> macro_sum;               // of coarse cells, for the certificate
  std::vector<double> macro_weight;
  std::vector<std::uint8_t> covered;
};

struct Search {
  Pose pose;  // reference_from_live
  int iterations = 0;
  bool converged = false;
  double limit;      // mm, of the residuals
  double scale = 1;  // of the residuals in expected sigmas, at least 1
  Sums sums;         // of the last round
};

// start_error: mm, about how far the start may lie from the answer; the search begins at a level as coarse as that asks
// for. work.live must be there. Fills its variances where the surface carries none, or covariances. Ends early, not
// converged, with fewer than kMinPairs pairs; work.w holds the weights of the last round.
Search search(const Run& run, const Reference& reference, const Surface& live, const Pose& initial, double start_error,
              const Vec3& isocentre, const IcpOptions& options, Workspace& work);

// Options of a pass over all points at the finest level.
PassOptions finest(const Reference& reference, const IcpOptions& options, double limit);

}  // namespace sgrt
