// NURBS surfaces: points, derivatives to any order, normals. The NURBS Book, A3.5, A3.6, A4.3, A4.4 (eq. 10.4).
// docs/theory/nurbs.md.
#pragma once

#include "core/eigen.hpp"
#include "nurbs/basis.hpp"

namespace sgrt {

struct NurbsSurface {
  SplineBasis basis[2];     // in u and in v
  Points points;            // control points, nu * nv x 3, v fastest, mm
  Eigen::VectorXd weights;  // like them, > 0; empty: all 1

  int nu() const { return basis[0].size(); }
  int nv() const { return basis[1].size(); }
  bool rational() const { return weights.size() > 0; }
};

// Throws unless knots, control points and weights fit each other (see sgrt_nurbs_surface_create). Weights that are all
// alike are dropped: they say nothing.
NurbsSurface make_nurbs_surface(NurbsSurface surface);

// u, v in the domain (basis[].contains).
Vec3 evaluate(const NurbsSurface& surface, double u, double v);

// Partial derivatives up to `order` in all, by total order and then by the order in v: S, S_u, S_v, S_uu, S_uv, S_vv,
// S_uuu ...
constexpr int derivative_count(int order) {
  return (order + 1) * (order + 2) / 2;
}
constexpr int derivative_index(int in_u, int in_v) {
  return (in_u + in_v) * (in_u + in_v + 1) / 2 + in_v;
}
void derivatives(const NurbsSurface& surface, double u, double v, int order, Vec3* ders);

// The unit normal S_u x S_v. Where that vanishes (a pole, a degenerate edge) its limit from inside the domain; NaN if
// there is none.
Vec3 normal(const NurbsSurface& surface, double u, double v);

}  // namespace sgrt
