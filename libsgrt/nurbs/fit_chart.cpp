// Charts: their formulas, and the one that an organised surface brings with it.
#include "nurbs/fit_chart.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kSample = 20'000;  // points that decide on the steps

double median_step(const Surface& s, std::int64_t di, std::int64_t dj) {
  std::vector<double> d;
  const std::int64_t stride = std::max<std::int64_t>(1, s.size() / kSample);
  for (std::int64_t k = 0; k < s.size(); k += stride) {
    const std::int64_t i = k / s.width + di, j = k % s.width + dj;
    if (i < s.height && j < s.width && s.present(k) && s.present(i * s.width + j))
      d.push_back((s.point(i * s.width + j) - s.point(k)).norm());
  }
  return median(d);
}

// Whether S_col x S_row points inwards: by the surface's normals, else by what is up.
bool grid_is_left_handed(const Surface& s) {
  double sum = 0;
  for (std::int64_t i = 0; i + 1 < s.height; ++i) {
    for (std::int64_t j = 0; j + 1 < s.width; ++j) {
      const std::int64_t k = i * s.width + j;
      const Vec3 n = (s.point(k + 1) - s.point(k)).cross(s.point(k + s.width) - s.point(k));
      const Vec3 out = s.has_normals() ? s.normal(k) : Vec3(0, 0, 1);
      if (n.allFinite() && out.allFinite()) sum += n.dot(out);
    }
  }
  return sum < 0;
}

}  // namespace

Chart grid_chart(const Surface& s) {
  if (!s.organised())
    fail(Status::kInvalidArgument, "options.chart: grid, expected another one: the surface is not organised");
  Chart c;
  c.kind = FitChart::kGrid;
  c.swapped = grid_is_left_handed(s);
  c.step[0] = median_step(s, 0, 1);
  c.step[1] = median_step(s, 1, 0);
  if (!(c.step[0] > 0 && c.step[1] > 0))
    fail(Status::kDegenerate, "surface: no neighbours in its grid, or all in one place, expected an area");
  const double across = static_cast<double>(s.width - 1) * c.step[0];
  const double down = static_cast<double>(s.height - 1) * c.step[1];
  c.length_u = c.swapped ? down : across;
  c.length_v = c.swapped ? across : down;
  return c;
}

ChartPoint to_chart(const Chart& c, const Vec3& x) {
  const Vec3 p = c.axes.transpose() * (x - c.origin);
  if (c.kind == FitChart::kCylinder) {
    double u = c.radius * std::atan2(p.y(), p.x()) - c.u0;
    if (c.periodic && !(u < c.length_u)) u -= c.length_u;
    return {u, p.z() - c.v0, std::hypot(p.x(), p.y()) - c.radius};
  }
  if (c.kind == FitChart::kSphere) {
    const double across = std::hypot(p.x(), p.y());
    const double scale = across > 0 ? c.radius * std::atan2(across, p.z()) / across : 1;
    return {scale * p.x() - c.u0, scale * p.y() - c.v0, p.norm() - c.radius};
  }
  return {p.x() - c.u0, p.y() - c.v0, p.z()};
}

Vec3 base_normal(const Chart& c, double u, double v) {
  u += c.u0, v += c.v0;
  if (c.kind == FitChart::kCylinder)
    return std::cos(u / c.radius) * c.axes.col(0) + std::sin(u / c.radius) * c.axes.col(1);
  if (c.kind == FitChart::kSphere) {
    const double a = std::hypot(u, v) / c.radius;
    const double s = a > 1e-8 ? std::sin(a) / (a * c.radius) : 1 / c.radius;
    return s * u * c.axes.col(0) + s * v * c.axes.col(1) + std::cos(a) * c.axes.col(2);
  }
  return c.axes.col(2);
}

Vec3 base_point(const Chart& c, double u, double v) {
  if (c.kind == FitChart::kPlane) return c.origin + (u + c.u0) * c.axes.col(0) + (v + c.v0) * c.axes.col(1);
  const Vec3 x = c.origin + c.radius * base_normal(c, u, v);
  return c.kind == FitChart::kCylinder ? Vec3(x + (v + c.v0) * c.axes.col(2)) : x;
}

double slope2(const Chart& c, double u, double v, double f, double f_u, double f_v) {
  if (c.kind == FitChart::kPlane) return f_u * f_u + f_v * f_v;
  const double shrink = c.radius / std::max(c.radius + f, 1e-3 * c.radius);
  if (c.kind == FitChart::kCylinder) return shrink * shrink * f_u * f_u + f_v * f_v;
  u += c.u0, v += c.v0;
  const double l = std::hypot(u, v), a = l / c.radius;
  if (a < 1e-6) return shrink * shrink * (f_u * f_u + f_v * f_v);
  const double along = (u * f_u + v * f_v) / l, across = (u * f_v - v * f_u) / l;
  const double stretch = a / std::max(std::abs(std::sin(a)), 1e-3);
  return shrink * shrink * (along * along + stretch * stretch * across * across);
}

}  // namespace sgrt
