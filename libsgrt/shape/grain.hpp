// What a surface's points are like, and what every fit on them starts from: made once, for discs of any radius.
// docs/theory/curvature.md eq. 11-13.
#pragma once

#include <limits>
#include <vector>

#include "core/run.hpp"
#include "shape/cells.hpp"

namespace sgrt {

// Heights of the points: variance along the normal, mm2, correlation included.
struct Heights {
  std::vector<double> variance;  // one a row of the surface; empty: `common` for all
  double common = 0;
  double of(std::int32_t row) const { return variance.empty() ? common : variance[static_cast<std::size_t>(row)]; }
};

struct Grain {
  double spacing = std::numeric_limits<double>::quiet_NaN();  // mm: a point stands for its square; NaN: too few points
  double noise = std::numeric_limits<double>::quiet_NaN();    // mm: the median of the points' sigma along the normal
  Pyramid pyramid;                                            // empty without a spacing
  Heights heights;
};

// degree: of the fits that measure the noise. noise: mm, one sigma along the normal; 0: the surface's own, or measured.
// The surface needs normals (kInvalidArgument otherwise).
Grain grain_of(const Run& run, const Surface& surface, int degree, double noise);

}  // namespace sgrt
