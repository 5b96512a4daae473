// The shape of a surface near one point, from its neighbours: the principal frame of a plane fit, then a quadric in
// that frame, so that the normal is right to second order on curved skin and at borders, where a plane leans. Cazals
// and Pouget, "Estimating differential quantities using polynomial fitting of osculating jets" (2005).
// docs/theory/surface.md eq. 1-3.
#pragma once

#include <vector>

#include "core/nearest.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct LocalFit {
  Vec3 normal;      // unit, of either sign; NaN where the neighbours fix no plane
  double variance;  // mm2, of the neighbours' heights about the fit; NaN where there are too few to tell
};

constexpr int kMinNeighbours = 6;  // of a plane fit
constexpr int kQuadricNeighbours = 10;

// hits: the neighbours of x among `points`, x itself included.
LocalFit fit_local(const Points& points, const Vec3& x, const Nearest::Hit* hits, int count);

// One sigma along the normal, mm, as the roughness of the surface shows it: the median of the local fits at about 500
// points. NaN where there are too few points. It sees independent noise only.
double roughness(const Run& run, const Surface& surface, const Nearest& nearest);

}  // namespace sgrt
