// Exact circles, ellipses and surfaces of revolution. The NURBS Book A7.1, A8.1. docs/theory/nurbs.md.
#pragma once

#include "nurbs/curve.hpp"
#include "nurbs/surface.hpp"

namespace sgrt {

// centre + cos(t) x + sin(t) y for t from begin to end, at most one turn; domain [0, 1]. A circle where x and y are
// perpendicular and of one length, else an ellipse.
NurbsCurve make_arc(const Vec3& centre, const Vec3& x, const Vec3& y, double begin_rad, double end_rad);

// u turns counter-clockwise about the axis by at most one turn, domain [0, 1]; v runs along the curve. The normal
// points away from the axis where the curve runs along it.
NurbsSurface revolve(const NurbsCurve& curve, const Vec3& axis_point, const Vec3& axis_direction, double angle_rad);

NurbsSurface make_sphere(const Vec3& centre, double radius);
NurbsSurface make_cylinder(const Vec3& base, const Vec3& axis,
                           double radius);  // without caps, from base to base + axis
NurbsSurface make_torus(const Vec3& centre, const Vec3& axis, double radius, double tube_radius);

}  // namespace sgrt
