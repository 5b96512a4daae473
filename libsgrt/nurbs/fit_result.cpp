// The tensor-product interpolation of the model at Greville abscissae: exact over a plane, where the model is a spline.
#include "nurbs/fit_result.hpp"

#include <algorithm>
#include <cmath>

#include "nurbs/fit_cells.hpp"

namespace sgrt {
namespace {

constexpr double kPointsPerBin = 4;  // so that a bin among points is empty once in fifty
constexpr int kMaxBins = 4;          // along a side of a cell

// B_j(xi_i): clamped cubic splines at their Greville abscissae.
Eigen::MatrixXd collocation(const SplineBasis& basis, const std::vector<double>& at) {
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(basis.size(), basis.size());
  for (int i = 0; i < basis.size(); ++i) {
    double N[4];
    const int k = find_span(basis, at[i]);
    basis_functions(basis, k, at[i], N);
    for (int a = 0; a < 4; ++a) m(i, k - 3 + a) = N[a];
  }
  return m;
}

double worst_difference(const NurbsFit& fit) {
  double worst = 0;
  for (int j = 0; j < fit.grid.cells_v; ++j) {
    for (int i = 0; i < fit.grid.cells_u; ++i) {
      const double u = (i + 0.5) / fit.grid.cells_u, v = (j + 0.5) / fit.grid.cells_v;
      if (fit.occupied[static_cast<std::size_t>(fit.grid.index(i + 1, j + 1))] < kSupported) continue;
      const Vec3 model = model_point(fit, u * fit.chart.length_u, v * fit.chart.length_v);
      worst = std::max(worst, (evaluate(fit.surface, u, v) - model).norm());
    }
  }
  return worst;
}

// With few points a cell, one may be empty by chance, and a stray outlier may fill one: a cell goes with its
// neighbours.
std::vector<char> majority(const FitGrid& g, const std::vector<char>& full) {
  std::vector<char> out(full.size());
  for (int j = 0; j < g.cells_v; ++j) {
    for (int i = 0; i < g.cells_u; ++i) {
      const std::size_t c = static_cast<std::size_t>(j) * g.cells_u + i;
      int near = -full[c];
      for_neighbours(g, i, j, [&](int x, int y) { near += full[static_cast<std::size_t>(y) * g.cells_u + x]; });
      out[c] = full[c] ? near >= 3 : near >= 5;
    }
  }
  return out;
}

}  // namespace

Vec3 model_point(const NurbsFit& fit, double u, double v) {
  const CellPlace cu = cell_of(u, fit.grid.hu, fit.grid.cells_u), cv = cell_of(v, fit.grid.hv, fit.grid.cells_v);
  double bu[4], bv[4];
  cell_basis(cu.t, bu);
  cell_basis(cv.t, bv);
  Vec3 f = Vec3::Zero();
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      for (Eigen::Index d = 0; d < fit.coefficients.cols(); ++d)
        f(d) += bu[i] * bv[j] * fit.coefficients(fit.grid.index(cu.cell + i, cv.cell + j), d);
  if (fit.chart.kind == FitChart::kGrid) return f;
  return base_point(fit.chart, u, v) + f(0) * base_normal(fit.chart, u, v);
}

void make_surface_of(NurbsFit& fit) {
  NurbsSurface& s = fit.surface;
  s.basis[0] = uniform_basis(3, fit.grid.cells_u + 3);
  s.basis[1] = uniform_basis(3, fit.grid.cells_v + 3);
  const std::vector<double> at_u = greville(s.basis[0]), at_v = greville(s.basis[1]);
  const int nu = s.nu(), nv = s.nv();
  const Eigen::PartialPivLU<Eigen::MatrixXd> solve_u(collocation(s.basis[0], at_u));
  const Eigen::PartialPivLU<Eigen::MatrixXd> solve_v(collocation(s.basis[1], at_v));
  Eigen::MatrixXd x[3];
  for (auto& m : x) m.resize(nu, nv);
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      const Vec3 p = model_point(fit, at_u[i] * fit.chart.length_u, at_v[j] * fit.chart.length_v);
      for (int d = 0; d < 3; ++d) x[d](i, j) = p(d);
    }
  }
  s.points.resize(static_cast<Eigen::Index>(nu) * nv, 3);
  for (int d = 0; d < 3; ++d) {
    const Eigen::MatrixXd c = solve_v.solve(solve_u.solve(x[d]).transpose());  // nv x nu, column-major: v fastest
    s.points.col(d) = Eigen::Map<const Eigen::VectorXd>(c.data(), c.size());
  }
  fit.conversion_error = worst_difference(fit);
}

// The posterior A^-1 is noise, A^-1 X A^-1, plus the bias that the prior expects, B = -d A^-1 / d log lambda. Among
// points we take the share of B that the data show (bias_share), and all of B where there are none (eq. 19).
void keep_covariance(NurbsFit& fit, const Band& z, const Band& stiffer, double step, double share, double scale) {
  const double part = (1 - share) / step;
  const FitGrid& g = fit.grid;
  fit.covariance.assign(static_cast<std::size_t>(g.size()) * kNeighbourSlots, 0.0);
  for (int j = 0; j < g.nv(); ++j) {
    for (int i = 0; i < g.nu(); ++i) {
      for (int dj = 0; dj <= 3 && j + dj < g.nv(); ++dj) {
        for (int di = -3; di <= 3; ++di) {
          const int ii = g.periodic ? (i + di + g.nu()) % g.nu() : i + di;
          if (ii < 0 || ii >= g.nu()) continue;
          const int a = g.index(i, j), b = g.index(ii, j + dj);
          const int row = std::max(a, b), column = std::min(a, b);
          const double bias =
              part * (z(row, column) - stiffer(row, column)) * std::sqrt(fit.occupied[a] * fit.occupied[b]);
          fit.covariance[static_cast<std::size_t>(a) * kNeighbourSlots + 7 * dj + di + 3] =
              scale * (z(row, column) - bias);
        }
      }
    }
  }
}

void mark_occupied(NurbsFit& fit, const FitPoints& p, const std::vector<double>& robust) {
  const FitGrid& g = fit.grid;
  const std::int64_t cells = static_cast<std::int64_t>(p.cell_begin.size()) - 1;
  std::int64_t used = 0;
  for (std::int64_t c = 0; c < cells; ++c) used += p.cell_begin[c + 1] > p.cell_begin[c];
  const double a_cell = static_cast<double>(p.size()) / static_cast<double>(std::max<std::int64_t>(1, used));
  const int bins = std::clamp(static_cast<int>(std::sqrt(a_cell / kPointsPerBin)), 1, kMaxBins);
  std::vector<double> have(static_cast<std::size_t>(g.size()), 0.0), all = have;
  std::vector<char> cell_full(static_cast<std::size_t>(cells), 0);
  for (std::int64_t c = 0; c < cells; ++c)
    for (std::int64_t k = p.cell_begin[c]; k < p.cell_begin[c + 1]; ++k) cell_full[c] |= robust[k] > 0;
  if (bins == 1) cell_full = majority(g, cell_full);
  for (std::int64_t c = 0; c < cells; ++c) {
    bool full[kMaxBins][kMaxBins] = {};
    for (std::int64_t k = p.cell_begin[c]; k < p.cell_begin[c + 1]; ++k)
      if (robust[k] > 0)
        full[std::clamp(static_cast<int>(p.tv[k] * bins), 0, bins - 1)]
            [std::clamp(static_cast<int>(p.tu[k] * bins), 0, bins - 1)] = true;
    if (bins == 1) full[0][0] = cell_full[c];
    int at[16];
    cell_indices(g, c, at);
    for (int y = 0; y < bins; ++y) {
      for (int x = 0; x < bins; ++x) {
        double bu[4], bv[4];
        cell_basis((x + 0.5) / bins, bu);
        cell_basis((y + 0.5) / bins, bv);
        for (int a = 0; a < 16; ++a) {
          const double b = bu[a % 4] * bv[a / 4];
          all[at[a]] += b;
          if (full[y][x]) have[at[a]] += b;
        }
      }
    }
  }
  fit.occupied = have;
  for (std::size_t i = 0; i < all.size(); ++i) fit.occupied[i] = all[i] > 0 ? have[i] / all[i] : 0;
}

}  // namespace sgrt
