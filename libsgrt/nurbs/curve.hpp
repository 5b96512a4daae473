// NURBS curves in space: points and derivatives to any order. The NURBS Book, A4.1, A4.2. docs/theory/nurbs.md.
#pragma once

#include "core/eigen.hpp"
#include "nurbs/basis.hpp"

namespace sgrt {

struct NurbsCurve {
  SplineBasis basis;
  Points points;            // control points, size() x 3, mm
  Eigen::VectorXd weights;  // > 0; empty: all 1

  bool rational() const { return weights.size() > 0; }
};

// Throws unless knots, control points and weights fit each other (see sgrt_nurbs_curve_create). Weights that are all
// alike are dropped: they say nothing.
NurbsCurve make_nurbs_curve(NurbsCurve curve);

Vec3 evaluate(const NurbsCurve& curve, double u);

// ders[k] = d^k C / du^k, k = 0 ... order.
void derivatives(const NurbsCurve& curve, double u, int order, Vec3* ders);

}  // namespace sgrt
