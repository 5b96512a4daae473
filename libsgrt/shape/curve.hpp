// Curvature and torsion of curves in space, of NURBS curves and of sampled ones. Eq. 10.11; docs/theory/curvature.md
// eq. 1-2.
#pragma once

#include <vector>

#include "core/eigen.hpp"
#include "nurbs/curve.hpp"

namespace sgrt {

struct CurvePoint {
  double curvature;  // 1/mm: |c' x c''| / |c'|^3; signed where a plane's normal is given: positive turns left about it
  double torsion;    // 1/mm; NaN where the curve is straight
};

// d: c', c'', c'''. plane: the normal that signs the curvature, or zero.
CurvePoint curve_point(const Vec3& d1, const Vec3& d2, const Vec3& d3, const Vec3& plane);

std::vector<CurvePoint> curve_curvature(const NurbsCurve& curve, const double* u, std::int64_t n, const Vec3& plane);

// Of points along a curve: a polynomial of `degree` (3 or more) of the chord length, fitted by least squares to the
// `half_window` samples on each side. NaN where there are too few, at samples that coincide, and at a NaN sample.
// sigma: one sigma of each coordinate, mm; sigma_curvature gets what it does to the curvature (may be nullptr).
std::vector<CurvePoint> sampled_curvature(const Points& samples, int half_window, int degree, bool closed,
                                          const Vec3& plane, double sigma, double* sigma_curvature);

}  // namespace sgrt
