// Conics and quadrics of degree 2: pieces of a quarter turn at most, the middle weight the cosine of half the piece.
#include "nurbs/conics.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;

struct Turn {
  int pieces;
  double step;  // half a piece, rad
  SplineBasis basis;

  double cosine(int i) const { return i % 2 == 0 ? 1 : std::cos(step); }  // weight of control point i
};

Turn make_turn(double angle, const char* name) {
  if (!(std::abs(angle) > 0 && std::abs(angle) <= 2 * kPi * (1 + 1e-12)))
    fail(Status::kInvalidArgument, name + (": " + text_of(angle)) + " rad, expected up to one turn, not 0");
  Turn t;
  t.pieces = std::max(1, static_cast<int>(std::ceil(std::abs(angle) / (kPi / 2) - 1e-9)));
  t.step = angle / (2 * t.pieces);
  t.basis.degree = 2;
  t.basis.knots = {0, 0, 0};
  for (int i = 1; i < t.pieces; ++i) {
    const double u = static_cast<double>(i) / t.pieces;
    t.basis.knots.insert(t.basis.knots.end(), {u, u});
  }
  t.basis.knots.insert(t.basis.knots.end(), {1, 1, 1});
  return t;
}

double check_radius(double radius, const char* name) {
  if (!(radius > 0 && radius <= 1e5))
    fail(Status::kInvalidArgument, name + (": " + text_of(radius)) + ", expected above 0 and at most 1e5 mm");
  return radius;
}

Vec3 unit(const Vec3& direction, const char* name) {
  if (!(direction.allFinite() && direction.norm() > 0))
    fail(Status::kInvalidArgument, name + std::string(": expected a direction, not 0"));
  return direction.normalized();
}

}  // namespace

NurbsCurve make_arc(const Vec3& centre, const Vec3& x, const Vec3& y, double begin_rad, double end_rad) {
  require(std::isfinite(begin_rad) && std::isfinite(end_rad), "begin_rad, end_rad: expected finite angles");
  const Turn turn = make_turn(end_rad - begin_rad, "end_rad - begin_rad");
  const int n = turn.basis.size();
  NurbsCurve arc{turn.basis, Points(n, 3), Eigen::VectorXd(n)};
  for (int i = 0; i < n; ++i) {
    const double t = begin_rad + i * turn.step, w = turn.cosine(i);
    arc.points.row(i) = (centre + (std::cos(t) / w) * x + (std::sin(t) / w) * y).transpose();
    arc.weights[i] = w;
  }
  if (std::abs(end_rad - begin_rad) >= 2 * kPi * (1 - 1e-12)) arc.points.row(n - 1) = arc.points.row(0);  // closed
  return make_nurbs_curve(std::move(arc));
}

NurbsSurface revolve(const NurbsCurve& curve, const Vec3& axis_point, const Vec3& axis_direction, double angle_rad) {
  const Vec3 a = unit(axis_direction, "axis_direction");
  const Turn turn = make_turn(angle_rad, "angle_rad");
  const int nu = turn.basis.size(), nv = curve.basis.size();
  NurbsSurface s{{turn.basis, curve.basis}, Points(nu * nv, 3), Eigen::VectorXd(nu * nv)};
  for (int j = 0; j < nv; ++j) {
    const Vec3 p = curve.points.row(j).transpose();
    const Vec3 centre = axis_point + a * a.dot(p - axis_point), x = p - centre, y = a.cross(x);
    for (int i = 0; i < nu; ++i) {
      const double t = i * turn.step, w = turn.cosine(i);
      s.points.row(i * nv + j) = (centre + (std::cos(t) / w) * x + (std::sin(t) / w) * y).transpose();
      s.weights[i * nv + j] = w * (curve.rational() ? curve.weights[j] : 1);
    }
    if (std::abs(angle_rad) >= 2 * kPi * (1 - 1e-12)) s.points.row((nu - 1) * nv + j) = s.points.row(j);  // closed
  }
  return make_nurbs_surface(std::move(s));
}

NurbsSurface make_sphere(const Vec3& centre, double radius) {
  const double r = check_radius(radius, "radius_mm");
  NurbsCurve half = make_arc(centre, {r, 0, 0}, {0, 0, r}, -kPi / 2, kPi / 2);
  half.points(0, 0) = half.points(half.points.rows() - 1, 0) = centre[0];  // the poles lie on the axis
  return revolve(half, centre, Vec3::UnitZ(), 2 * kPi);
}

NurbsSurface make_cylinder(const Vec3& base, const Vec3& axis, double radius) {
  const Vec3 a = unit(axis, "axis_mm"), x = a.unitOrthogonal() * check_radius(radius, "radius_mm");
  NurbsCurve line{uniform_basis(1, 2), Points(2, 3), {}};
  line.points << (base + x).transpose(), (base + axis + x).transpose();
  return revolve(line, base, a, 2 * kPi);
}

NurbsSurface make_torus(const Vec3& centre, const Vec3& axis, double radius, double tube_radius) {
  const double R = check_radius(radius, "radius_mm"), r = check_radius(tube_radius, "tube_radius_mm");
  if (!(r < R)) fail(Status::kInvalidArgument, "tube_radius_mm: " + text_of(r) + ", expected below radius_mm");
  const Vec3 a = unit(axis, "axis"), x = a.unitOrthogonal();
  return revolve(make_arc(centre + R * x, r * x, r * a, 0, 2 * kPi), centre, a, 2 * kPi);
}

}  // namespace sgrt
