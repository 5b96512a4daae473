// What the posterior says of a point of the surface: f and its derivatives have a joint covariance (the neighbouring
// coefficients'), and the delta method carries it to the point, its derivatives and its normal.
// docs/theory/nurbs_fit.md eq. 21-24.
#include <algorithm>
#include <cmath>
#include <limits>

#include "nurbs/fit.hpp"
#include "nurbs/fit_cells.hpp"

namespace sgrt {
namespace {

using Mat6x16 = Eigen::Matrix<double, 6, 16>;
using Mat16 = Eigen::Matrix<double, 16, 16>;
using Mat36 = Eigen::Matrix<double, 3, 6>;

// Rows f f_u f_v f_uu f_uv f_vv of the 16 functions of a cell, per unit of u and v in [0, 1].
Mat6x16 functions(const FitGrid& g, const CellPlace& u, const CellPlace& v) {
  double b[3][4], d[3][4];
  cell_basis(u.t, b[0]), cell_basis1(u.t, b[1]), cell_basis2(u.t, b[2]);
  cell_basis(v.t, d[0]), cell_basis1(v.t, d[1]), cell_basis2(v.t, d[2]);
  constexpr int kOrder[6][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  Mat6x16 m;
  for (int r = 0; r < 6; ++r) {
    const int p = kOrder[r][0], q = kOrder[r][1];
    const double scale = std::pow(g.cells_u, p) * std::pow(g.cells_v, q);
    for (int a = 0; a < 16; ++a) m(r, a) = scale * b[p][a % 4] * d[q][a / 4];
  }
  return m;
}

Mat16 coefficient_covariance(const NurbsFit& fit, int cu, int cv) {
  Mat16 m;
  for (int a = 0; a < 16; ++a) {
    for (int b = 0; b < 16; ++b) {
      if (b / 4 < a / 4) continue;
      const int at = fit.grid.index(cu + a % 4, cv + a / 4);
      const double c =
          fit.covariance[static_cast<std::size_t>(at) * kNeighbourSlots + 7 * (b / 4 - a / 4) + (b % 4 - a % 4) + 3];
      m(a, b) = m(b, a) = c;
    }
  }
  return m;
}

// The direction in which f moves the surface, and its derivatives in u and v of [0, 1] by central differences.
struct Direction {
  Vec3 e, d[5];  // e_u e_v e_uu e_uv e_vv
};
Direction direction_of(const NurbsFit& fit, double u, double v, const Vec3& n) {
  Direction r;
  const Chart& c = fit.chart;
  for (auto& x : r.d) x.setZero();
  r.e = c.kind == FitChart::kGrid ? n : base_normal(c, u * c.length_u, v * c.length_v);
  if (c.kind != FitChart::kCylinder && c.kind != FitChart::kSphere) return r;
  const double h = 1e-3 * c.radius;  // mm
  const auto at = [&](int i, int j) { return base_normal(c, u * c.length_u + i * h, v * c.length_v + j * h); };
  const double su = c.length_u / h, sv = c.length_v / h;
  r.d[0] = 0.5 * su * (at(1, 0) - at(-1, 0));
  r.d[1] = 0.5 * sv * (at(0, 1) - at(0, -1));
  r.d[2] = su * su * (at(1, 0) - 2 * r.e + at(-1, 0));
  r.d[3] = 0.25 * su * sv * (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1));
  r.d[4] = sv * sv * (at(0, 1) - 2 * r.e + at(0, -1));
  return r;
}

// d (S_u S_v S_uu S_uv S_vv) / d (f f_u f_v f_uu f_uv f_vv): product rule on f e.
void derivative_jacobians(const Direction& d, Mat36* J) {
  for (int k = 0; k < 5; ++k) J[k].setZero(), J[k].col(0) = d.d[k], J[k].col(k + 1) = d.e;
  J[2].col(1) = 2 * d.d[0];
  J[3].col(1) = d.d[1], J[3].col(2) = d.d[0];
  J[4].col(2) = 2 * d.d[1];
}

}  // namespace

FitSample sample_fit(const NurbsFit& fit, double u, double v) {
  u = std::clamp(u, 0.0, 1.0), v = std::clamp(v, 0.0, 1.0);
  FitSample r;
  Vec3 ders[derivative_count(2)];
  derivatives(fit.surface, u, v, 2, ders);
  r.point = ders[0];
  std::copy_n(ders + 1, 5, r.derivatives);
  const Vec3 cross = r.derivatives[0].cross(r.derivatives[1]);
  r.normal = normal(fit.surface, u, v);

  const FitGrid& g = fit.grid;
  const CellPlace cu = cell_of(u * g.cells_u, 1, g.cells_u), cv = cell_of(v * g.cells_v, 1, g.cells_v);
  const Mat6x16 B = functions(g, cu, cv);
  const Mat6 C = B * coefficient_covariance(fit, cu.cell, cv.cell) * B.transpose();
  const Direction d = direction_of(fit, u, v, r.normal);
  const double variance = C(0, 0) < 0 ? 0 : C(0, 0);  // below 0 by rounding; NaN stays NaN
  r.covariance = variance * d.e * d.e.transpose();
  r.sigma = std::sqrt(variance) * std::abs(d.e.dot(r.normal));
  Mat36 J[5];
  derivative_jacobians(d, J);
  for (int k = 0; k < 5; ++k) r.derivative_covariance[k] = J[k] * C * J[k].transpose();
  // n = S_u x S_v / |...|; its change lies in the tangent plane.
  Mat36 N;
  for (int k = 0; k < 6; ++k)
    N.col(k) = Vec3(J[0].col(k)).cross(r.derivatives[1]) + r.derivatives[0].cross(Vec3(J[1].col(k)));
  N = (Mat3::Identity() - r.normal * r.normal.transpose()) * N / cross.norm();
  r.normal_covariance = N * C * N.transpose();

  double support = 0;
  for (int a = 0; a < 16; ++a)
    support += B(0, a) * fit.occupied[static_cast<std::size_t>(g.index(cu.cell + a % 4, cv.cell + a / 4))];
  r.support = std::clamp(support, 0.0, 1.0);
  return r;
}

namespace {

// The nearest of the surface's points in the middle of cells: where a chart gives no foot.
Vec2 coarse_start(const NurbsFit& fit, const Vec3& x) {
  Vec2 best(0.5, 0.5);
  double least = std::numeric_limits<double>::infinity();
  for (int j = 0; j < fit.grid.cells_v; ++j) {
    for (int i = 0; i < fit.grid.cells_u; ++i) {
      const Vec2 at((i + 0.5) / fit.grid.cells_u, (j + 0.5) / fit.grid.cells_v);
      const double d2 = (evaluate(fit.surface, at(0), at(1)) - x).squaredNorm();
      if (d2 < least) least = d2, best = at;
    }
  }
  return best;
}

}  // namespace

Vec2 nearest_parameters(const NurbsFit& fit, const Vec3& x) {
  Vec2 at;
  if (fit.chart.kind == FitChart::kGrid) {
    at = coarse_start(fit, x);
  } else {
    const ChartPoint p = to_chart(fit.chart, x);
    at = Vec2(p.u / fit.chart.length_u, p.v / fit.chart.length_v);
  }
  const auto into = [&](Vec2 p) {
    if (fit.grid.periodic) p(0) -= std::floor(p(0));
    return Vec2(p.cwiseMax(0).cwiseMin(1));
  };
  at = into(at);
  double d2 = (evaluate(fit.surface, at(0), at(1)) - x).squaredNorm();
  for (int i = 0; i < 30; ++i) {
    Vec3 ders[derivative_count(1)];
    derivatives(fit.surface, at(0), at(1), 1, ders);
    Mat32 J;
    J << ders[1], ders[2];
    Vec2 step = (J.transpose() * J).ldlt().solve(J.transpose() * (x - ders[0]));
    if (!step.allFinite()) break;
    for (int k = 0; k < 2; ++k)  // along the border once there
      if (!(k == 0 && fit.grid.periodic) && ((at(k) <= 0 && step(k) < 0) || (at(k) >= 1 && step(k) > 0))) {
        step.setZero();
        step(1 - k) = J.col(1 - k).dot(x - ders[0]) / J.col(1 - k).squaredNorm();
      }
    bool better = false;
    Vec2 next;
    for (int half = 0; half < 10 && !better; ++half, step *= 0.5) {
      next = into(at + step);
      const double e2 = (evaluate(fit.surface, next(0), next(1)) - x).squaredNorm();
      if (e2 < d2) d2 = e2, better = true;
    }
    if (!better) break;
    const double moved = (J * (next - at)).norm();
    at = next;
    if (moved < 1e-9) break;
  }
  return at;
}

}  // namespace sgrt
