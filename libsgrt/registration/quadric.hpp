// A quadric over its tangent plane, fitted to weighted samples near a point, with what the samples' noise does to it.
// Cazals and Pouget (2005); Levin, "Mesh-independent surface interpolation" (2003). docs/theory/icp.md eq. 3-4.
#pragma once

#include <cstdint>
#include <vector>

#include "core/eigen.hpp"

namespace sgrt {

struct Quadric {
  bool found = false;
  // A point of the surface near the one asked for, and its unit normal, of either sign.
  Vec3 q = Vec3::Zero(), n = Vec3::Zero();
  Mat3 K = Mat3::Zero();  // curvature tensor
  double height = 0;      // variance of the height at q for samples of unit variance
  double slope = 0;       // of a component of the normal
  double residual = 0;    // mm2, unbiased variance of the samples about the quadric; NaN where there are too few
};

// rows: of the samples near p; those beyond `radius` do not count. hint: a normal to fall back on where the samples fix
// no plane, or zero.
Quadric fit_quadric(const Points& samples, const std::vector<std::int32_t>& rows, const Vec3& p, double radius,
                    const Vec3& hint);

}  // namespace sgrt
