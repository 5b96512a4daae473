// A curve, or one direction of a surface, as what the tools of knots.hpp work on: a basis and one row of homogeneous
// numbers a control point. For a surface a row holds all the control points across the direction.
#pragma once

#include "nurbs/banded.hpp"
#include "nurbs/curve.hpp"
#include "nurbs/surface.hpp"

namespace sgrt {

struct Net {
  SplineBasis basis;
  Rows rows;           // size() x (width * across); a point is w x, w y, w z, w, or x, y, z
  Eigen::Index width;  // 4, or 3 without weights

  bool rational() const { return width == 4; }
};

Net net_of(const NurbsCurve& curve);
Net net_of(const NurbsSurface& surface, int direction);
NurbsCurve curve_of(const Net& net);
// The surface with this net along `direction` and the basis of `like` across it.
NurbsSurface surface_of(const Net& net, const NurbsSurface& like, int direction);

}  // namespace sgrt
