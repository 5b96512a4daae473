// A score costs one Cholesky factorisation (REML) or one and the band of the inverse (GCV), so the search is by few
// values: downhill in log lambda, then parabolas.
#include "nurbs/fit_smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/sequence.hpp"

namespace sgrt {
namespace {

constexpr double kReach = 16;  // log lambda is searched this far round the balanced one
constexpr int kWindow = 2;     // cells to each side, twice
constexpr double kDoubt = 2;   // parameters' worth of belief that the bending is the same everywhere
constexpr double kMostUneven = 1e3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double quadratic(const Band& P, const double* c) {
  double sum = 0;
  for (int j = 0; j < P.size; ++j) {
    const int n = std::min(P.width, P.size - 1 - j);
    const double* p = P.values.data() + static_cast<std::size_t>(j) * P.stride;
    double off = 0;
    for (int i = 1; i <= n; ++i) off += p[i] * c[j + i];
    sum += c[j] * (p[0] * c[j] + 2 * off);
  }
  return sum;
}

// Sums over windows of 2 kWindow + 1 cells along both directions.
std::vector<double> window_sums(const FitGrid& g, const std::vector<double>& x) {
  std::vector<double> rows(x.size(), 0.0), out = rows;
  const auto at = [&g](int i, int j) { return static_cast<std::size_t>(j) * g.cells_u + i; };
  for (int j = 0; j < g.cells_v; ++j) {
    for (int i = 0; i < g.cells_u; ++i) {
      for (int d = -kWindow; d <= kWindow; ++d) {
        const int k = g.periodic ? (i + d + g.cells_u) % g.cells_u : i + d;
        if (k >= 0 && k < g.cells_u) rows[at(i, j)] += x[at(k, j)];
      }
    }
  }
  for (int j = 0; j < g.cells_v; ++j)
    for (int d = std::max(-kWindow, -j); d <= std::min(kWindow, g.cells_v - 1 - j); ++d)
      for (int i = 0; i < g.cells_u; ++i) out[at(i, j)] += rows[at(i, j + d)];
  return out;
}

// Beyond this lambda even the data's word on x^2 along the longer side is lost (its energy is 720 / L^4 of its square):
// a chart that happens to fit would be taken for the truth.
double stiffest(const FitGrid& g, const Normal& normal) {
  const std::vector<double> ones(static_cast<std::size_t>(g.size()), 1.0), sums = multiply(normal.gram, ones.data());
  const double lu = g.cells_u * g.hu, lv = g.cells_v * g.hv, weight = std::accumulate(sums.begin(), sums.end(), 0.0);
  return weight / (lu * lv) * std::pow(std::max(lu, lv), 4) / 720;
}

}  // namespace

double balanced_lambda(const Normal& normal, const Band& energy) {
  double data = 0, bend = 0;
  for (int j = 0; j < energy.size; ++j) data += normal.gram(j, j), bend += energy(j, j);
  return data / bend;
}

double trace_product(const Band& z, const Band& P) {
  double sum = 0;
  for (int j = 0; j < P.size; ++j) {
    const int n = std::min(P.width, P.size - 1 - j);
    double off = 0;
    for (int i = 1; i <= n; ++i) off += z(j + i, j) * P(j + i, j);
    sum += z(j, j) * P(j, j) + 2 * off;
  }
  return sum;
}

void adapt(const Smoother& s, const Solution& solution, double count, std::vector<double>& stiffness) {
  const FitGrid& g = s.grid;
  const Band z = inverse_band(s.run, solution.factor);
  const CellEnergy e = cell_energy(g);
  const double columns = static_cast<double>(solution.c.cols()), free = g.periodic ? 2 : 3;
  const double scale = solution.deviance / (columns * (count - free));
  const double each = (g.size() - free) / static_cast<double>(stiffness.size());
  std::vector<double> bends(stiffness.size()), known(stiffness.size());
  for (std::size_t c = 0; c < stiffness.size(); ++c) {
    int at[16];
    cell_indices(g, static_cast<std::int64_t>(c), at);
    double energy = 0, trace = 0;
    for (int a = 0; a < 16; ++a) {
      for (int b = 0; b < 16; ++b) {
        trace += e(a, b) * (at[a] >= at[b] ? z(at[a], at[b]) : z(at[b], at[a]));
        for (Eigen::Index d = 0; d < solution.c.cols(); ++d)
          energy += e(a, b) * solution.c(at[a], d) * solution.c(at[b], d);
      }
    }
    const double weight = solution.lambda * stiffness[c];
    bends[c] = weight * energy / (columns * scale);
    known[c] = std::max(0.0, each - weight * trace);
  }
  bends = window_sums(g, bends);
  known = window_sums(g, known);
  for (std::size_t c = 0; c < stiffness.size(); ++c)
    stiffness[c] = std::clamp(stiffness[c] * (known[c] + kDoubt) / (bends[c] + kDoubt), 1 / kMostUneven, kMostUneven);
}

// With H the smoother and h its eigenvalues, E |H (I - H) y|^2 / variance is tr H^2 (I - H)^2 for noise alone and tr
// H^2 (I - H) under the prior. The traces by Hutchinson's estimator with fixed signs in the basis of the factor, where
// H is L^-1 X L^-T.
double bias_share(const Smoother& s, const Normal& normal, const Band& factor, double lambda, const Eigen::MatrixXd& c,
                  double variance) {
  constexpr int kProbes = 8;
  constexpr double kPriorShare = 0.25,
                   kPriorWeight = 2;  // a smooth surface at the best lambda, where the data say little
  if (!(variance > 0)) return 1;      // exact data tell nothing of it
  double taken = 0;
  for (Eigen::Index d = 0; d < c.cols(); ++d) {
    std::vector<double> r = multiply(s.energy, c.col(d).data());
    for (double& x : r) x *= lambda;
    solve(factor, r.data());
    const std::vector<double> Xr = multiply(normal.gram, r.data());
    for (std::size_t i = 0; i < r.size(); ++i) taken += r[i] * Xr[i] / (static_cast<double>(c.cols()) * variance);
  }
  const auto smooth = [&](std::vector<double> x) {
    solve_upper(factor, x.data());
    x = multiply(normal.gram, x.data());
    solve_lower(factor, x.data());
    return x;
  };
  double noise = 0, prior = 0;
  Sequence sequence;
  for (int k = 0; k < kProbes; ++k) {
    std::vector<double> z(static_cast<std::size_t>(factor.size));
    for (double& x : z) x = sequence.next() >> 63 ? 1 : -1;
    const std::vector<double> h = smooth(z), hh = smooth(h);
    for (std::size_t i = 0; i < h.size(); ++i) {
      noise += (h[i] - hh[i]) * (h[i] - hh[i]) / kProbes;
      prior += h[i] * (h[i] - hh[i]) / kProbes;
    }
  }
  return std::clamp((taken - noise + kPriorWeight * kPriorShare) / (std::max(0.0, prior - noise) + kPriorWeight), 0.0,
                    1.0);
}

Solution solve_at(const Smoother& s, const Normal& normal, double count, double lambda) {
  Solution r;
  r.lambda = lambda;
  r.factor = normal.gram;
  for (std::size_t i = 0; i < r.factor.values.size(); ++i) r.factor.values[i] += lambda * s.energy.values[i];
  if (!factorise(s.run, r.factor)) {
    r.score = kInfinity;
    return r;
  }
  r.c = normal.right;
  double fitted = 0, bend = 0;
  for (Eigen::Index d = 0; d < r.c.cols(); ++d) {
    solve(r.factor, r.c.col(d).data());
    fitted += r.c.col(d).dot(normal.right.col(d));
    if (s.method == FitSmoothing::kGcv) bend += quadratic(s.energy, r.c.col(d).data());
  }
  // Where the data are exact the difference is rounding.
  r.deviance = std::max(normal.yy - fitted, 1e-15 * normal.yy + 1e-24 * count);
  const double columns = static_cast<double>(r.c.cols());
  const double size = s.grid.size();
  const double free = s.grid.periodic ? 2 : 3;  // planes that the energy does not see
  if (s.method == FitSmoothing::kReml) {
    const double scale = r.deviance / (columns * (count - free));
    r.score = (count - free) * std::log(scale) + log_determinant(r.factor) - (size - free) * std::log(lambda);
  } else if (s.method == FitSmoothing::kGcv) {
    const double parameters = size - lambda * trace_product(inverse_band(s.run, r.factor), s.energy);
    const double left = count - parameters;
    const double rss = std::max(r.deviance - lambda * bend, 1e-15 * normal.yy + 1e-24 * count);
    r.score = left > 0 ? count * (std::log(rss) - 2 * std::log(left)) : kInfinity;
  }
  return r;
}

Solution choose(const Smoother& s, const Normal& normal, double count, double start, double step) {
  if (s.method == FitSmoothing::kGiven) return solve_at(s, normal, count, s.lambda);
  const double middle = std::log(balanced_lambda(normal, s.energy));
  const double low = middle - kReach, high = std::max(low + 3 * step, std::log(stiffest(s.grid, normal)));
  const auto at = [&](double x) { return solve_at(s, normal, count, std::exp(x)); };
  double x = std::clamp(std::log(start), low + step, high - step), xl = x - step, xr = x + step;
  Solution best = at(x);
  Solution tried = at(xl);
  double left = tried.score, right = best.score;
  if (!(left < best.score)) {
    tried = at(xr), right = tried.score;
    while (right < best.score && xr < high) {  // walk up
      left = best.score, xl = x, best = std::move(tried), x = xr;
      xr = std::min(high, x + step);
      tried = at(xr), right = tried.score;
    }
  } else {
    while (left < best.score && xl > low) {  // walk down
      right = best.score, xr = x, best = std::move(tried), x = xl;
      xl = std::max(low, x - step);
      tried = at(xl), left = tried.score;
    }
  }
  for (int i = 0; i < 2 && std::isfinite(left) && std::isfinite(right) && x > xl && xr > x; ++i) {
    const double a = (x - xl) * (best.score - right), b = (x - xr) * (best.score - left);
    const double next = x - 0.5 * ((x - xl) * a - (x - xr) * b) / (a - b);
    if (!(next > xl && next < xr) || std::abs(next - x) < 0.1) break;
    tried = at(next);
    if (tried.score < best.score) {
      (next < x ? xr : xl) = x, (next < x ? right : left) = best.score;
      best = std::move(tried), x = next;
    } else {
      (next < x ? xl : xr) = next, (next < x ? left : right) = tried.score;
    }
  }
  return best;
}

}  // namespace sgrt
