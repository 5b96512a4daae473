// Parameters for scattered points. A chart lays a plane, a cylinder or a sphere near the body, so that a point of the
// skin is base(u, v) + f(u, v) e(u, v) with one unknown number f; u and v are mm on the base, e its outward normal.
// docs/theory/nurbs_fit.md eq. 1-4.
#pragma once

#include <cstdint>
#include <optional>

#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

enum class FitChart : std::int32_t {
  kAuto = 0,
  kPlane = 1,     // a height field over a plane
  kCylinder = 2,  // angle x height about an axis: a torso, a limb; closed where the points go all round
  kSphere = 3,    // azimuthal equidistant about the mean direction seen from inside: a head; no pole among the points
  kGrid = 4,      // the column and row of an organised surface; all three coordinates are fitted
};

struct Chart {
  FitChart kind = FitChart::kPlane;
  Vec3 origin = Vec3::Zero();
  // Columns, right-handed. Plane: u, v, e. Cylinder: angle 0, angle 90 deg, axis. Sphere: u, v, e at u = v = 0.
  Mat3 axes = Mat3::Identity();
  double radius = 1;  // of the base cylinder or sphere, mm
  double u0 = 0, v0 = 0, length_u = 1, length_v = 1;
  bool periodic = false;    // u is closed
  bool swapped = false;     // of a grid: u counts rows
  double step[2] = {1, 1};  // of a grid: mm between columns, between rows

  int columns() const { return kind == FitChart::kGrid ? 3 : 1; }  // numbers fitted a point
};

struct ChartPoint {
  double u, v;  // mm, from 0
  double f;     // mm along e
};

// The foot of x. Not of a grid. In a closed chart u lies in [0, length_u); in an open cylinder a stray point lies
// outside.
ChartPoint to_chart(const Chart& chart, const Vec3& x);
Vec3 base_point(const Chart& chart, double u, double v);
Vec3 base_normal(const Chart& chart, double u, double v);  // e

// |gradient of f along the skin|^2 at a point: the normal leans from e by its arc tangent.
double slope2(const Chart& chart, double u, double v, double f, double f_u, double f_v);

// Columns and rows at their median pitch; the points' own order, turned so that the normal points outward.
Chart grid_chart(const Surface& surface);

// Throws kDegenerate where the points lie on a line, or are too flat or too closed for the chart asked for. axis: of
// the height field or of the cylinder; empty: estimated.
Chart make_chart(const Run& run, const Surface& surface, FitChart kind, const std::optional<Vec3>& axis);

}  // namespace sgrt
