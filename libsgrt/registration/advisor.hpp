// Which region of interest to track: what each candidate promises at the isocentre before anything is seen, which of
// them fall short of the limits, and a region that promises more. docs/theory/icp.md section 6.
#pragma once

#include <string>
#include <vector>

#include "core/roi.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct AdviceOptions {
  double live_sigma = 0.3;               // mm along the normal
  double limit_mm = 1, limit_deg = 0.5;  // a region that errs by more is flagged
  double max_share =
      0;  // of the reference's points that the proposal may take; 0: that of the largest candidate, or 0.4
};

struct Forecast {
  double mm, deg;     // one sigma of the length of the shift at the isocentre and of the angle
  double share;       // of the reference's points
  double score;       // sqrt((mm / limit)^2 + (deg / limit)^2): regions are ranked by it
  bool flagged;       // it cannot keep the limits, or leaves a motion free
  std::string words;  // what it sees worst: "slides along LNG"
};

struct Advice {
  std::vector<Forecast> candidates;
  std::vector<std::int32_t> order;  // of the candidates, the best first
  Forecast proposal;
  Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> polygon;  // of the proposal, seen from above, mm
  bool better = false;  // the proposal's score is below that of every candidate
};

// Throws kInsufficientData below 6 usable points.
Advice advise(const Run& run, const Surface& reference, const std::vector<const Roi*>& candidates,
              const Vec3& isocentre, const AdviceOptions& options);

}  // namespace sgrt
