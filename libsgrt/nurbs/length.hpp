// The length of a curve by adaptive Gauss quadrature of |C'|. docs/theory/nurbs.md.
#pragma once

#include "nurbs/curve.hpp"

namespace sgrt {

// From begin to end within the domain, mm; negative where end < begin.
double arc_length(const NurbsCurve& curve, double begin, double end);

}  // namespace sgrt
