// Tools that change knots and degree and leave the shape: insertion and refinement (The NURBS Book A5.1, A5.4),
// decomposition to Bezier (A5.6), splitting, removal with its error bound (A5.8), degree elevation (A5.9) and reduction
// with its error bound (A5.11), reparameterisation. All of them are one formula, the blossom (polar form): a control
// point is the blossom of the piece at its own knots. docs/theory/nurbs.md, "Tools".
#pragma once

#include <vector>

#include "nurbs/curve.hpp"
#include "nurbs/surface.hpp"

namespace sgrt {

// Every tool works on a curve, or on one direction (0: u, 1: v) of a surface.

// `knots` within the domain are added (each at most to multiplicity degree; not decreasing order not needed).
NurbsCurve refine(const NurbsCurve& curve, const std::vector<double>& knots);
NurbsSurface refine(const NurbsSurface& surface, int direction, const std::vector<double>& knots);

// Every inner knot to multiplicity degree, clamped: control points i p ... (i + 1) p are the i-th Bezier piece.
NurbsCurve to_bezier(const NurbsCurve& curve);
NurbsSurface to_bezier(const NurbsSurface& surface, int direction);

// The part from `begin` to `end` of the domain, clamped. Twice: a split.
NurbsCurve restrict_to(const NurbsCurve& curve, double begin, double end);
NurbsSurface restrict_to(const NurbsSurface& surface, int direction, double begin, double end);

// The degree raised by `times`; clamped.
NurbsCurve elevate(const NurbsCurve& curve, int times);
NurbsSurface elevate(const NurbsSurface& surface, int direction, int times);

// A change that may move the shape, by at most `bound_mm` anywhere (a true bound, not an estimate).
template <class Shape>
struct Approximated {
  Shape shape;
  int count;  // of knots removed, or of degrees
  double bound_mm;
};

// Removes knot u up to `times` times, as often as the shape moves by no more than tolerance_mm.
Approximated<NurbsCurve> remove_knot(const NurbsCurve& curve, double u, int times, double tolerance_mm);
Approximated<NurbsSurface> remove_knot(const NurbsSurface& surface, int direction, double u, int times,
                                       double tolerance_mm);

// The degree lowered by one, if the shape moves by no more than tolerance_mm; else as it was, count 0. Clamped.
Approximated<NurbsCurve> reduce_degree(const NurbsCurve& curve, double tolerance_mm);
Approximated<NurbsSurface> reduce_degree(const NurbsSurface& surface, int direction, double tolerance_mm);

// The same shape over [begin, end]; begin > end runs it backwards.
NurbsCurve reparameterise(const NurbsCurve& curve, double begin, double end);
NurbsSurface reparameterise(const NurbsSurface& surface, int direction, double begin, double end);

}  // namespace sgrt
