// NURBS surfaces. The NURBS Book, A3.6 and A4.4.
#include "nurbs/surface.hpp"

#include <algorithm>
#include <limits>

#include "core/error.hpp"
#include "nurbs/homogeneous.hpp"

namespace sgrt {
namespace {

// Eq. 4.20: the derivatives of A / w from those of A and w.
void quotient_rule(const Vec4* A, int order, Vec3* ders) {
  for (int total = 0; total <= order; ++total) {
    for (int l = 0; l <= total; ++l) {
      const int k = total - l;
      Vec3 sum = A[derivative_index(k, l)].head<3>();
      for (int i = 0; i <= k; ++i) {
        for (int j = 0; j <= l; ++j) {
          if (i + j == 0) continue;
          sum -= binomial(k, i) * binomial(l, j) * A[derivative_index(i, j)][3] * ders[derivative_index(k - i, l - j)];
        }
      }
      ders[derivative_index(k, l)] = sum / A[0][3];
    }
  }
}

// +1, -1 or 0: which way leads into the domain.
double inward(const SplineBasis& basis, double u) {
  return u <= basis.begin() ? 1 : u >= basis.end() ? -1 : 0;
}

// The limit of the normal where S_u x S_v = 0, on the way into the domain: its first derivative along that way that
// does not vanish. Inside the domain the limit must be the same from both sides, so an odd derivative gives none.
Vec3 limit_normal(const NurbsSurface& surface, double u, double v, double tolerance) {
  Vec3 d[derivative_count(3)];
  derivatives(surface, u, v, 3, d);
  const double width[2] = {surface.basis[0].end() - surface.basis[0].begin(),
                           surface.basis[1].end() - surface.basis[1].begin()};
  double a = inward(surface.basis[0], u) * width[0], b = inward(surface.basis[1], v) * width[1];
  // On an edge that has shrunk to a point (S_u = 0 along v = const) only the way across it matters.
  if (a != 0 && b != 0) {
    if (d[derivative_index(1, 0)].norm() * width[0] < d[derivative_index(0, 1)].norm() * width[1])
      a = 0;
    else
      b = 0;
  }
  const bool inside = a == 0 && b == 0;
  if (inside) a = width[0];
  const auto along = [&](int k, int l) {
    return Vec3(a * d[derivative_index(k + 1, l)] + b * d[derivative_index(k, l + 1)]);
  };
  const auto twice = [&](int k, int l) {
    return Vec3(a * a * d[derivative_index(k + 2, l)] + 2 * a * b * d[derivative_index(k + 1, l + 1)] +
                b * b * d[derivative_index(k, l + 2)]);
  };
  const Vec3 Su = d[1], Sv = d[2];
  const Vec3 first = along(1, 0).cross(Sv) + Su.cross(along(0, 1));
  if (first.norm() > tolerance)
    return inside ? Vec3::Constant(std::numeric_limits<double>::quiet_NaN()) : first.normalized();
  const Vec3 second = twice(1, 0).cross(Sv) + 2 * along(1, 0).cross(along(0, 1)) + Su.cross(twice(0, 1));
  if (second.norm() > tolerance) return second.normalized();
  return Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

NurbsSurface make_nurbs_surface(NurbsSurface surface) {
  for (int d = 0; d < 2; ++d) {
    const int count =
        static_cast<int>(std::min<std::size_t>(surface.basis[d].knots.size(), kMaxKnots)) - surface.basis[d].degree - 1;
    check_basis(surface.basis[d], count, d == 0 ? "knots[0]" : "knots[1]");
  }
  check_control_points(surface.points, surface.weights, Eigen::Index{surface.nu()} * surface.nv());
  return surface;
}

Vec3 evaluate(const NurbsSurface& surface, double u, double v) {
  Vec3 point;
  derivatives(surface, u, v, 0, &point);
  return point;
}

void derivatives(const NurbsSurface& surface, double u, double v, int order, Vec3* ders) {
  require(order >= 0 && order <= kMaxOrder, "order: expected 0 to 24");
  const int p = surface.basis[0].degree, q = surface.basis[1].degree, nv = surface.nv();
  const int ku = find_span(surface.basis[0], u), kv = find_span(surface.basis[1], v);
  double Nu[(kMaxOrder + 1) * (kMaxDegree + 1)], Nv[(kMaxOrder + 1) * (kMaxDegree + 1)];
  basis_derivatives(surface.basis[0], ku, u, order, Nu);
  basis_derivatives(surface.basis[1], kv, v, order, Nv);
  Vec4 A[derivative_count(kMaxOrder)];
  for (int i = 0; i < derivative_count(order); ++i) A[i].setZero();
  for (int b = 0; b <= q; ++b) {
    for (int k = 0; k <= order; ++k) {
      Vec4 column = Vec4::Zero();
      for (int a = 0; a <= p; ++a) {
        const Eigen::Index i = Eigen::Index{ku - p + a} * nv + kv - q + b;
        column += Nu[k * (p + 1) + a] * homogeneous(surface.points, surface.weights, i);
      }
      for (int l = 0; k + l <= order; ++l) A[derivative_index(k, l)] += Nv[l * (q + 1) + b] * column;
    }
  }
  if (surface.rational()) return quotient_rule(A, order, ders);
  for (int i = 0; i < derivative_count(order); ++i) ders[i] = A[i].head<3>();
}

Vec3 normal(const NurbsSurface& surface, double u, double v) {
  Vec3 d[derivative_count(1)];
  derivatives(surface, u, v, 1, d);
  const Vec3 n = d[1].cross(d[2]);
  // Below this S_u x S_v is rounding: the size of the surface over the size of its domain, squared.
  const double size = (surface.points.colwise().maxCoeff() - surface.points.colwise().minCoeff()).norm();
  const double unit =
      size * size /
      ((surface.basis[0].end() - surface.basis[0].begin()) * (surface.basis[1].end() - surface.basis[1].begin()));
  if (n.norm() > 1e-11 * unit) return n.normalized();
  return limit_normal(surface, u, v, 1e-9 * unit);
}

}  // namespace sgrt
