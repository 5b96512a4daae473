// Triangles within a chord error. For a patch over the unit square the two triangles of its corners lie within
// (M_uu + 2 M_uv + M_vv) / 8 of it, M bounds of its second derivatives; those of S = A / w come from differences of
// Bezier control points by the quotient rule.
#include "nurbs/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.hpp"
#include "nurbs/homogeneous.hpp"
#include "nurbs/knots.hpp"

namespace sgrt {
namespace {

using Eigen::Index;

constexpr Index kBlock = 1 << 16;  // points between two polls: some ten milliseconds

struct Bounds {
  double uu, uv, vv;
};

// Bounds of |d^(k+l) A| and of |d^(k+l) w| over a piece whose points are relative to `centre`.
struct Largest {
  double point = 0, weight = 0;
};

Largest largest_difference(const std::vector<Vec4>& points, int p, int q, int k, int l) {
  Largest out;
  if (k > p || l > q) return out;
  double factor = 1;
  for (int i = 0; i < k; ++i) factor *= p - i;
  for (int j = 0; j < l; ++j) factor *= q - j;
  for (int i = 0; i + k <= p; ++i) {
    for (int j = 0; j + l <= q; ++j) {
      Vec4 sum = Vec4::Zero();
      for (int a = 0; a <= k; ++a) {
        for (int b = 0; b <= l; ++b) {
          const double sign = (k - a + l - b) % 2 == 0 ? 1 : -1;
          sum += sign * binomial(k, a) * binomial(l, b) * points[static_cast<std::size_t>((i + a) * (q + 1) + j + b)];
        }
      }
      out.point = std::max(out.point, factor * sum.head<3>().norm());
      out.weight = std::max(out.weight, factor * std::abs(sum[3]));
    }
  }
  return out;
}

Bounds bounds_of(std::vector<Vec4> points, int p, int q) {
  Vec3 centre = Vec3::Zero();
  double low = points[0][3], radius = 0;
  for (const Vec4& h : points) {
    centre += h.head<3>() / h[3] / static_cast<double>(points.size());
    low = std::min(low, h[3]);
  }
  for (Vec4& h : points) {
    h.head<3>() -= h[3] * centre;
    radius = std::max(radius, h.head<3>().norm() / h[3]);
  }
  const auto of = [&](int k, int l) { return largest_difference(points, p, q, k, l); };
  const Largest u = of(1, 0), v = of(0, 1), uu = of(2, 0), uv = of(1, 1), vv = of(0, 2);
  const double su = (u.point + u.weight * radius) / low, sv = (v.point + v.weight * radius) / low;
  return {(uu.point + 2 * u.weight * su + uu.weight * radius) / low,
          (uv.point + u.weight * sv + v.weight * su + uv.weight * radius) / low,
          (vv.point + 2 * v.weight * sv + vv.weight * radius) / low};
}

// Parameters of rows: each piece between two knots in its number of equal steps.
std::vector<double> cut(const std::vector<double>& at, const std::vector<double>& pieces) {
  std::vector<double> out{at[0]};
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    const auto n = static_cast<int>(pieces[i]);
    for (int k = 1; k < n; ++k) out.push_back(at[i] + (at[i + 1] - at[i]) * k / n);
    out.push_back(at[i + 1]);
  }
  return out;
}

// The triangle of these points has not shrunk to a line.
bool spans(const Points& points, Index a, Index b, Index c) {
  const Vec3 x = points.row(a).transpose(), y = points.row(b).transpose(), z = points.row(c).transpose();
  const double longest = std::max({(y - x).norm(), (z - y).norm(), (x - z).norm()});
  return (y - x).cross(z - x).norm() > 1e-12 * longest * longest;
}

Faces faces_of(const Run& run, const Points& points, Index nu, Index nv) {
  Faces faces(2 * (nu - 1) * (nv - 1), 3);
  Index count = 0;
  const auto add = [&](Index a, Index b, Index c) {
    if (spans(points, a, b, c)) faces.row(count++) = Eigen::RowVector3<Index>(a, b, c).cast<std::int32_t>();
  };
  for (Index i = 0; i + 1 < nu; ++i) {
    for (Index j = 0; j + 1 < nv; ++j) {  // counter-clockwise about S_u x S_v
      const Index a = i * nv + j;
      if (a % kBlock == 0) run.poll(static_cast<double>(a) / static_cast<double>(nu * nv), "mesh: triangles");
      add(a, a + nv, a + nv + 1);
      add(a, a + nv + 1, a + 1);
    }
  }
  faces.conservativeResize(count, 3);
  return faces;
}

}  // namespace

Surface mesh_of(const Run& run, const SurfaceEvaluator& evaluator, double chord_error_mm) {
  if (!(chord_error_mm > 0) || !std::isfinite(chord_error_mm))
    fail(Status::kInvalidArgument, "chord_error_mm: " + text_of(chord_error_mm) + ", expected above 0");
  const NurbsSurface bezier = to_bezier(to_bezier(evaluator.surface(), 0), 1);
  const int p = bezier.basis[0].degree, q = bezier.basis[1].degree;
  const std::vector<double> us = breaks(bezier.basis[0]), vs = breaks(bezier.basis[1]);
  std::vector<double> nu(us.size() - 1, 1), nv(vs.size() - 1, 1);
  std::vector<Vec4> points;
  for (std::size_t a = 0; a < nu.size(); ++a) {
    run.poll(static_cast<double>(a) / static_cast<double>(nu.size()), "mesh");
    for (std::size_t b = 0; b < nv.size(); ++b) {
      points.clear();
      for (int i = 0; i <= p; ++i) {
        for (int j = 0; j <= q; ++j) {
          const Index row = static_cast<Index>(a) * p + i, column = static_cast<Index>(b) * q + j;
          points.push_back(homogeneous(bezier.points, bezier.weights, row * bezier.nv() + column));
        }
      }
      const Bounds M =
          bounds_of(points, p, q);  // half of the error to each direction: 2 M_uv / (n m) <= M_uv / n^2 + M_uv / m^2
      nu[a] = std::max(nu[a], std::ceil(std::sqrt((M.uu + M.uv) / (4 * chord_error_mm))));
      nv[b] = std::max(nv[b], std::ceil(std::sqrt((M.vv + M.uv) / (4 * chord_error_mm))));
    }
  }
  const double size = std::accumulate(nu.begin(), nu.end(), 1.0) * std::accumulate(nv.begin(), nv.end(), 1.0);
  if (!(size <= static_cast<double>(kMaxPoints))) {
    fail(Status::kLimit, "chord_error_mm: " + text_of(chord_error_mm) + " would take " + text_of(size) +
                             " points, expected at most 50 million");
  }
  const std::vector<double> u = cut(us, nu), v = cut(vs, nv);
  const auto rows = static_cast<Index>(u.size()), columns = static_cast<Index>(v.size()), n = rows * columns;
  Surface mesh;
  mesh.points.resize(n, 3);
  mesh.normals.resize(n, 3);
  std::vector<double> uv;
  for (Index first = 0; first < n; first += kBlock) {
    run.poll(static_cast<double>(first) / static_cast<double>(n), "mesh: points");
    const Index last = std::min(n, first + kBlock);
    uv.clear();
    for (Index k = first; k < last; ++k)
      uv.insert(uv.end(), {u[static_cast<std::size_t>(k / columns)], v[static_cast<std::size_t>(k % columns)]});
    evaluate_points(run, evaluator, uv.data(), last - first, 0, mesh.points.row(first).data());
    evaluate_normals(run, evaluator, uv.data(), last - first, mesh.normals.row(first).data());
  }
  mesh.faces = faces_of(run, mesh.points, rows, columns);
  return make_surface(std::move(mesh));
}

}  // namespace sgrt
