// Agreement with the neighbours, then a weighted quadric in the point's own frame. docs/theory/filters.md eq. 1-7.
#include "surface/filter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/median.hpp"
#include "core/nearest.hpp"
#include "core/parallel.hpp"
#include "surface/local_fit.hpp"
#include "surface/neighbourhood.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kMinCos = 0.5;        // normals further apart than 60 deg: another side of the body
constexpr double kLackOfFit = 3;       // sigmas of chi2 beyond which the neighbours are no quadric
constexpr double kMinPivot = 1e-6;     // of the normal equations: below it the neighbours fix no quadric
constexpr double kRadiusSpacings = 3;  // of the default

using Variances = Eigen::VectorXd;

Variances variances_of(const Run& run, const Surface& s) {
  Variances v(s.size());
  const bool known = s.sigma.size() > 0 || s.covariance.rows() > 0;
  const double rough = known ? kNan : roughness(run, s, Nearest(run, s.points));
  if (!known && !(rough > 0)) {
    fail(Status::kInsufficientData, "surface: it carries no sigma, and too few points to measure its roughness");
  }
  for (std::int64_t i = 0; i < s.size(); ++i) v[i] = known ? s.variance_along(i, s.normal(i)) : rough * rough;
  return v;
}

// Where point i belongs, seen from its neighbours.
struct Local {
  FilterReason reason = FilterReason::kKept;
  double height = 0, variance = kNan;  // mm along the normal, mm2
  Vec3 normal;
};

// The monomials of u and v to the fourth degree, and which of them is the product of the i-th and j-th of the quadric's
// six.
constexpr int kMonomials = 15;
using Monomials = Eigen::Array<double, kMonomials, 1>;
constexpr std::array<std::array<int, 6>, 6> kProduct{{{0, 1, 2, 3, 4, 5},
                                                      {1, 3, 4, 6, 7, 8},
                                                      {2, 4, 5, 7, 8, 9},
                                                      {3, 6, 7, 10, 11, 12},
                                                      {4, 7, 8, 11, 12, 13},
                                                      {5, 8, 9, 12, 13, 14}}};

Mat6 matrix_of(const Monomials& sums) {
  Mat6 m;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) m(i, j) = sums[kProduct[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]];
  }
  return m;
}

// The weighted normal equations of h(u, v) = a + b u + c v + d u^2 + e u v + f v^2 (eq. 3). Lengths in radii.
struct Quadric {
  Monomials m = Monomials::Zero();   // sum w x x^T
  Monomials m2 = Monomials::Zero();  // sum w^2 sigma^2 x x^T
  Vec6 g = Vec6::Zero();             // sum w h x
  double hh = 0, weight = 0, weight2 = 0;
  int count = 0;

  void add(double u, double v, double h, double kernel, double variance) {
    const double uu = u * u, uv = u * v, vv = v * v;
    Monomials x;
    x << 1, u, v, uu, uv, vv, uu * u, uu * v, u * vv, vv * v, uu * uu, uu * uv, uu * vv, uv * vv, vv * vv;
    const double w = kernel / variance;
    m += w * x;
    m2 += w * kernel * x;
    g += w * h * x.head<6>().matrix();
    hh += w * h * h;
    weight += kernel;
    weight2 += kernel * kernel;
    ++count;
  }
};

// How much larger the residuals are than noise alone makes them; 1 where the quadric fits (eq. 6).
double lack_of_fit(const Quadric& q, const Vec6& a, double fitted, double correlation) {
  const double freedom = q.weight - fitted;
  if (!(freedom > 0)) return 1;
  const double chi2 = std::max(0.0, q.hh - a.dot(q.g)) / freedom;
  const double spread = std::sqrt(2 * q.weight2 * correlation) / freedom;
  return chi2 > 1 + kLackOfFit * spread ? chi2 : 1;
}

class SpatialFilter {
 public:
  SpatialFilter(const Surface& s, const Variances& variance, const FilterOptions& options, double radius)
      : s_(s), variance_(variance), options_(options), radius_(radius) {}

  // neighbours: of point i, i itself not included.
  Local at(std::int64_t i, const std::vector<std::int64_t>& neighbours) const {
    Local local;
    const Vec3 n = s_.normal(i);
    local.normal = n;
    local.variance = variance_[i];
    if (!(n.squaredNorm() > 0) || !(variance_[i] > 0)) return local;  // nothing to weigh it by
    const Vec3 e1 = n.unitOrthogonal(), e2 = n.cross(e1);
    Quadric q;
    q.add(0, 0, 0, 1, variance_[i]);
    double agree = 0, all = 0;
    for (const std::int64_t j : neighbours) {
      const Vec3 d = s_.point(j) - s_.point(i);
      const double u = e1.dot(d) / radius_, v = e2.dot(d) / radius_, r2 = u * u + v * v;
      if (!(r2 < 1) || !(variance_[j] > 0)) continue;
      const double kernel = (1 - r2) * (1 - r2);
      all += kernel;
      if (!same_skin(i, j, d)) continue;
      agree += kernel;
      q.add(u, v, n.dot(d), kernel, variance_[j]);
    }
    if (!(agree > options_.min_support * all)) {
      local.reason = FilterReason::kOutlier;
    } else if (q.count >= kQuadricNeighbours) {
      smooth(q, e1, e2, local);
    }
    return local;
  }

 private:
  // Two points of a circle's arc and their normals satisfy d . (m + n) = 0, so this holds on curved skin too (eq. 1).
  bool same_skin(std::int64_t i, std::int64_t j, const Vec3& d) const {
    const Vec3 n = s_.normal(i), m = s_.normal(j);
    const double cosine = m.dot(n);
    if (!(cosine > kMinCos)) return false;
    const double apart = (m + n).dot(d) / (1 + cosine);
    return apart * apart <= options_.max_sigmas * options_.max_sigmas * (variance_[i] + variance_[j]);
  }

  // Moves the point onto the quadric, unless that would not make it better.
  void smooth(const Quadric& q, const Vec3& e1, const Vec3& e2, Local& local) const {
    const Mat6 m2 = matrix_of(q.m2);
    const Eigen::LDLT<Mat6> solver(matrix_of(q.m));
    const Vec6 pivots = solver.vectorD();
    if (!(pivots.minCoeff() > kMinPivot * pivots.maxCoeff())) return;
    const Vec6 a = solver.solve(q.g);
    const Mat6 inverse = solver.solve(Mat6::Identity());
    const double white = inverse.row(0) * m2 * inverse.col(0);  // of a, were the noise of all points independent
    const double fitted = inverse.cwiseProduct(m2).sum();       // weight that the six coefficients take up
    const double variance = white * s_.correlation_points * lack_of_fit(q, a, fitted, s_.correlation_points);  // eq. 5
    if (!(variance < local.variance)) return;
    local.reason = FilterReason::kFiltered;
    local.height = a[0];
    local.variance = variance;
    local.normal = (local.normal - (a[1] * e1 + a[2] * e2) / radius_).normalized();
  }

  const Surface& s_;
  const Variances& variance_;
  const FilterOptions& options_;
  double radius_;
};

void check(const Surface& s, const FilterOptions& o) {
  require(s.has_normals(), "surface: it has no normals; estimate them first");
  const auto expect = [](bool ok, const char* name, double value, const char* expected) {
    if (!ok) fail(Status::kInvalidArgument, std::string(name) + " is " + text_of(value) + ", expected " + expected);
  };
  expect(o.radius >= 0 && o.radius <= kMaxCoordinate, "radius_mm", o.radius, "0 (three spacings) to 1e5");
  expect(o.max_sigmas >= 1 && o.max_sigmas <= 100, "max_sigmas", o.max_sigmas, "1 to 100");
  expect(o.min_support >= 0 && o.min_support < 1, "min_support", o.min_support, "0 to below 1");
}

// Writes the new heights; counts, and says how the noise has changed.
void apply(const Surface& before, const Variances& variance, const std::vector<Local>& locals, Filtered& out) {
  Surface& s = out.surface;
  s = before;
  if (s.sigma.size() == 0) s.sigma = variance.cwiseSqrt();
  std::vector<double> sigma_before, sigma_after, gain;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    const Local& local = locals[static_cast<std::size_t>(i)];
    out.reason[static_cast<std::size_t>(i)] = local.reason;
    ++out.count[static_cast<std::size_t>(local.reason)];
    if (local.reason != FilterReason::kFiltered) continue;
    const Vec3 n = before.normal(i);
    s.points.row(i) += (local.height * n).transpose();
    s.normals.row(i) = local.normal.transpose();
    s.sigma[i] = std::sqrt(local.variance);
    if (s.covariance.rows() > 0) set_variance_along(s, i, n, local.variance);
    sigma_before.push_back(std::sqrt(variance[i]));
    sigma_after.push_back(s.sigma[i]);
    gain.push_back(variance[i] / local.variance);
  }
  out.sigma_before = median(sigma_before);
  out.sigma_after = median(sigma_after);
  // What averages away over many points is as before; so less noise a point is noise that more points share (eq. 7).
  if (!gain.empty()) s.correlation_points *= std::max(1.0, median(gain));
}

}  // namespace

Filtered filter(const Run& run, const Surface& surface, const FilterOptions& options) {
  check(surface, options);
  const Variances variance = variances_of(run, surface);
  Filtered out;
  out.reason.resize(static_cast<std::size_t>(surface.size()));
  out.radius = options.radius > 0 ? options.radius : kRadiusSpacings * point_spacing(run, surface);
  const Neighbourhood near(run, surface, out.radius);
  const SpatialFilter spatial(surface, variance, options, out.radius);
  std::vector<Local> locals(static_cast<std::size_t>(surface.size()));
  parallel_for(
      run, surface.size(), 512,
      [&](std::int64_t begin, std::int64_t end) {
        std::vector<std::int64_t> neighbours;
        for (std::int64_t i = begin; i < end; ++i) {
          Local& local = locals[static_cast<std::size_t>(i)];
          if (!surface.present(i)) {
            local.reason = FilterReason::kAbsent;
            continue;
          }
          near.of(i, neighbours);
          local = spatial.at(i, neighbours);
        }
      },
      "filtering");
  apply(surface, variance, locals, out);
  std::vector<bool> keep(locals.size());
  for (std::size_t i = 0; i < locals.size(); ++i) keep[i] = locals[i].reason != FilterReason::kOutlier;
  if (out.count[static_cast<std::size_t>(FilterReason::kOutlier)] > 0) out.surface = kept(std::move(out.surface), keep);
  return out;
}

}  // namespace sgrt
