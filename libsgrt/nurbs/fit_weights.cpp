// Residuals and weights; two passes over the points, and a median.
#include "nurbs/fit_weights.hpp"

#include <algorithm>
#include <cmath>

#include "core/median.hpp"
#include "core/parallel.hpp"
#include "nurbs/fit_cells.hpp"

namespace sgrt {
namespace {

constexpr double kHuber = 1.345;
constexpr double kMinCosine = 0.1;  // skin seen more grazing than 84 deg counts as if seen so
constexpr double kExact = 1e-9;     // mm: residuals below are rounding

// Value and derivatives (in mm) of one column at a place of a cell.
struct Jet {
  double f, f_u, f_v;
};
Jet jet_of(const double* c, const double* bu, const double* bv, const double* du, const double* dv) {
  Jet r{0, 0, 0};
  for (int j = 0; j < 4; ++j) {
    const double* q = c + 4 * j;
    const double value = q[0] * bu[0] + q[1] * bu[1] + q[2] * bu[2] + q[3] * bu[3];
    const double slope = q[0] * du[0] + q[1] * du[1] + q[2] * du[2] + q[3] * du[3];
    r.f += bv[j] * value, r.f_u += bv[j] * slope, r.f_v += dv[j] * value;
  }
  return r;
}

}  // namespace

void residuals(const Run& run, const Chart& chart, const FitGrid& grid, const FitPoints& p, const Trend& trend,
               const Eigen::MatrixXd& c, double correlation, Residuals& out) {
  out.z.resize(p.row.size());
  out.cosine.resize(p.row.size());
  const double root = std::sqrt(correlation);
  const auto cell_residuals = [&](std::int64_t cell) {
    int at[16];
    double q[3][16];
    cell_indices(grid, cell, at);
    for (int d = 0; d < p.columns; ++d)
      for (int i = 0; i < 16; ++i) q[d][i] = c(at[i], d);
    const auto column = cell % grid.cells_u, row = cell / grid.cells_u;
    const auto u_cell = static_cast<double>(column), v_cell = static_cast<double>(row);
    for (std::int64_t k = p.cell_begin[cell]; k < p.cell_begin[cell + 1]; ++k) {
      double bu[4], bv[4], du[4], dv[4], r[3] = {0, 0, 0};
      cell_basis(p.tu[k], bu), cell_basis1(p.tu[k], du);
      cell_basis(p.tv[k], bv), cell_basis1(p.tv[k], dv);
      const double u = (u_cell + p.tu[k]) * grid.hu, v = (v_cell + p.tv[k]) * grid.hv;
      Vec3 s_u, s_v;
      Jet jet{};
      for (int d = 0; d < p.columns; ++d) {
        jet = jet_of(q[d], bu, bv, du, dv);
        r[d] = p.y[d][k] - jet.f;
        s_u(d) = jet.f_u / grid.hu + trend(1, d), s_v(d) = jet.f_v / grid.hv + trend(2, d);
      }
      double along = r[0], cosine = 1;
      if (p.columns == 1) {
        const double f = jet.f + trend(0, 0) + trend(1, 0) * u + trend(2, 0) * v;
        cosine = std::max(kMinCosine, 1 / std::sqrt(1 + slope2(chart, u, v, f, s_u(0), s_v(0))));
        along *= cosine;
      } else {
        const Vec3 n = s_u.cross(s_v).normalized();
        along = n(0) * r[0] + n(1) * r[1] + n(2) * r[2];
      }
      out.cosine[k] = cosine;
      out.z[k] = along * std::sqrt(p.precision[k]) * root;
    }
  };
  parallel_for(
      run, static_cast<std::int64_t>(p.cell_begin.size()) - 1, kCellBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t cell = begin; cell < end; ++cell) cell_residuals(cell);
      },
      "residuals");
}

std::vector<std::size_t> lonely(const FitGrid& g, const FitPoints& p) {
  constexpr double kLonely = 1.0 / 7;
  const auto count = [&](int i, int j) {
    const std::int64_t c = static_cast<std::int64_t>(j) * g.cells_u + i;
    return p.cell_begin[c + 1] - p.cell_begin[c];
  };
  std::vector<std::int64_t> about, of_points;
  for (int j = 0; j < g.cells_v; ++j) {
    for (int i = 0; i < g.cells_u; ++i) {
      std::int64_t sum = 0;
      for_neighbours(g, i, j, [&](int x, int y) { sum += count(x, y); });
      about.push_back(sum);
      of_points.insert(of_points.end(), static_cast<std::size_t>(count(i, j)), sum);
    }
  }
  std::vector<std::size_t> found;
  const auto usual = static_cast<double>(median(of_points));
  for (std::size_t c = 0; c < about.size(); ++c)
    if (static_cast<double>(about[c]) < kLonely * usual)
      for (std::int64_t k = p.cell_begin[c]; k < p.cell_begin[c + 1]; ++k) found.push_back(static_cast<std::size_t>(k));
  return found;
}

double mad(const Residuals& r, const std::vector<double>& robust) {
  std::vector<double> a;
  a.reserve(r.z.size());
  for (std::size_t k = 0; k < r.z.size(); ++k)
    if (robust[k] > 0) a.push_back(std::abs(r.z[k]));
  if (a.empty()) return kExact;
  return std::max(1.4826 * median(a), kExact);
}

std::vector<double> local_scales(const FitGrid& g, const FitPoints& p, const Residuals& r, double scale) {
  constexpr double kClearly = 1.5;
  constexpr std::size_t kEnough = 16;  // points, so that a third of them may be outliers
  std::vector<double> scales(p.cell_begin.size() - 1, scale), a;
  const auto gather = [&](int i, int j) {
    const std::int64_t c = static_cast<std::int64_t>(j) * g.cells_u + i;
    for (std::int64_t k = p.cell_begin[c]; k < p.cell_begin[c + 1]; ++k) a.push_back(std::abs(r.z[k]));
  };
  for (int j = 0; j < g.cells_v; ++j) {
    for (int i = 0; i < g.cells_u; ++i) {
      a.clear();
      gather(i, j);
      if (a.size() < kEnough) {
        a.clear();
        for_neighbours(g, i, j, gather);
      }
      if (a.size() < kEnough) continue;
      const double own = 1.4826 * median(a);
      if (own > kClearly * scale) scales[static_cast<std::size_t>(j) * g.cells_u + i] = own;
    }
  }
  return scales;
}

double reweigh(FitPoints& p, const Residuals& r, Robust how, const std::vector<double>& scales, double tukey,
               double correlation, std::vector<double>& robust) {
  double count = 0;
  for (std::size_t cell = 0; cell < scales.size(); ++cell) {
    for (std::int64_t k = p.cell_begin[cell]; k < p.cell_begin[cell + 1]; ++k) {
      double w = 1;
      const double t = std::abs(r.z[k]) / scales[cell];
      if (how == Robust::kHuber && t > kHuber) w = kHuber / t;
      if (how == Robust::kTukey) {
        const double q = t / tukey;
        w = q < 1 ? (1 - q * q) * (1 - q * q) : 0;
      }
      robust[k] = w;
      p.weight[k] = p.precision[k] * r.cosine[k] * r.cosine[k] * w;
      count += w;
    }
  }
  return count / correlation;
}

Response tukey_response(FitPoints& p, const Residuals& r, double scale, const std::vector<double>& scales, double tukey,
                        const std::vector<double>& robust) {
  double n = 0, square = 0, slope = 0;
  for (std::size_t cell = 0; cell < scales.size(); ++cell) {
    for (std::int64_t k = p.cell_begin[cell]; k < p.cell_begin[cell + 1]; ++k) {
      p.weight[k] = 0;
      if (!(robust[k] > 0)) continue;
      const double t = r.z[k] / scales[cell], q = t * t / (tukey * tukey), local = scale / scales[cell];
      n += 1, square += t * t * std::pow(1 - q, 4), slope += (1 - q) * (1 - 5 * q);
      p.weight[k] = p.precision[k] * r.cosine[k] * r.cosine[k] * local * local;
    }
  }
  if (!(slope > 0.1 * n)) return {};
  for (double& w : p.weight) w *= slope / n;
  return {slope / n, square / n};
}

}  // namespace sgrt
