// A score costs one Cholesky factorisation (REML) or one and the band of the inverse (GCV), so the search is by few
// values: downhill in log lambda, then parabolas.
#include "nurbs/fit_smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kReach = 16;  // log lambda is searched this far round the balanced one
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
  const double low = middle - kReach, high = middle + kReach;
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
