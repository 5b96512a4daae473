// A ladder of radii at every node; bias from how the answer drifts along it. docs/theory/curvature.md eq. 14-16.
#include "shape/scale.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "shape/jet.hpp"

namespace sgrt {
namespace {

constexpr double kStep = 1.25;          // of the ladder
constexpr int kRungs = 16, kApart = 2;  // the drift is taken over so many rungs
constexpr double kWidest = 0.8;         // radius of a disc over the smallest radius of curvature
constexpr double kCaution = 2.5;        // weight of bias against noise: a sigma should mean noise first of all
constexpr double kCredit = 0.6;         // of the bias that is reported: part of what is found is noise
constexpr std::int64_t kBlock = 16;

struct Rung {
  bool found = false;
  Vec3 foot, normal;
  Mat3 tensor;
  double mean, variance_mean, variance_tensor;  // for the heights' own variance
};

Mat3 tensor_of(const Jet& j) {
  return j.a * j.e1 * j.e1.transpose() + j.b * (j.e1 * j.e2.transpose() + j.e2 * j.e1.transpose()) +
         j.c * j.e2 * j.e2.transpose();
}

// Climbs the ladder at a place; each rung takes its normal from the one before.
void climb(JetFitter& fitter, const Vec3& x, const Vec3& start, double variance, const std::vector<double>& radii,
           Rung* rungs) {
  Vec3 foot = x, normal = start;
  for (std::size_t k = 0; k < radii.size(); ++k) {
    const Jet jet = fitter.fit(foot, normal, radii[k]);
    if (jet.fault == JetFault::kTooFew) continue;
    if (jet.fault != JetFault::kNone) break;
    // Beyond it the disc is no longer a sheet; the first rungs stand, however noisy.
    const double D = std::hypot(0.5 * (jet.a - jet.c), jet.b);
    const double sigma = std::sqrt(variance * jet.covariance.trace());
    if (k > 2 && radii[k] * (std::abs(0.5 * (jet.a + jet.c)) + D - sigma) > kWidest) break;
    Rung& r = rungs[k];
    r.found = true;
    r.normal = normal = jet.normal;
    r.foot = foot = x - normal * normal.dot(x - jet.foot);
    r.tensor = tensor_of(jet);
    r.mean = 0.5 * (jet.a + jet.c);
    const Mat3& C = jet.covariance;
    r.variance_mean = variance * 0.25 * (C(0, 0) + 2 * C(0, 2) + C(2, 2));
    r.variance_tensor = variance * (C(0, 0) + 2 * C(1, 1) + C(2, 2));
  }
}

Vec3 mean_normal(const SkinCells& cells, std::int64_t cell) {
  Vec3 sum = Vec3::Zero();
  for (std::int64_t i = cells.begin[static_cast<std::size_t>(cell)];
       i < cells.begin[static_cast<std::size_t>(cell) + 1]; ++i) {
    const auto at = static_cast<std::size_t>(i);
    sum += Vec3(cells.nx[at], cells.ny[at], cells.nz[at]);
  }
  const auto first = static_cast<std::size_t>(cells.begin[static_cast<std::size_t>(cell)]);
  const double length = sum.norm();
  return length > 0.1 ? Vec3(sum / length) : Vec3(cells.nx[first], cells.ny[first], cells.nz[first]);
}

// The point of the cell nearest its points' mean: away from the cell's corners, where two sheets may meet.
std::int64_t middle_point(const SkinCells& cells, std::int64_t cell) {
  const std::int64_t begin = cells.begin[static_cast<std::size_t>(cell)];
  const std::int64_t end = cells.begin[static_cast<std::size_t>(cell) + 1];
  Vec3 mean = Vec3::Zero();
  const auto at = [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    return Vec3(cells.x[k], cells.y[k], cells.z[k]);
  };
  for (std::int64_t i = begin; i < end; ++i) mean += at(i);
  mean /= static_cast<double>(end - begin);
  std::int64_t best = begin;
  for (std::int64_t i = begin; i < end; ++i) {
    if ((at(i) - mean).squaredNorm() < (at(best) - mean).squaredNorm()) best = i;
  }
  return best;
}

struct Drift {
  double mean = 0, tensor = 0, variance = 0, count = 0;
};

class Chooser {
 public:
  Chooser(const Run& run, const Grain& grain, const CurvatureOptions& options)
      : run_(run), grain_(grain), cells_(grain.pyramid.levels[0]), options_(options) {
    if (options.radius > 0) {
      radii_ = {options.radius};
      return;
    }
    double r = kLeastDisc[options.degree] * grain.spacing;
    for (int k = 0; k < kRungs && (k <= kApart || r <= options.max_radius * std::pow(kStep, kApart) * 1.001); ++k) {
      radii_.push_back(r);
      r *= kStep;
    }
  }

  Scales operator()() {
    const auto cells = static_cast<std::int64_t>(cells_.begin.size()) - 1;
    out_.node.assign(static_cast<std::size_t>(cells), -1);
    for (std::int64_t c = 0; c < cells; ++c) {
      if (cells_.begin[static_cast<std::size_t>(c)] == cells_.begin[static_cast<std::size_t>(c) + 1]) continue;
      out_.node[static_cast<std::size_t>(c)] = static_cast<std::int32_t>(cell_.size());
      cell_.push_back(c);
    }
    out_.nodes.resize(cell_.size());
    rungs_.resize(cell_.size() * radii_.size());
    drifts_.resize(rungs_.size());
    const auto n = static_cast<std::int64_t>(cell_.size());
    parallel_for(
        run_, n, kBlock, [&](std::int64_t a, std::int64_t b) { climb_block(a, b); }, "curvature: scales");
    parallel_for(
        run_, n, 64, [&](std::int64_t a, std::int64_t b) { drift_block(a, b); }, "curvature: scales");
    parallel_for(
        run_, n, 64, [&](std::int64_t a, std::int64_t b) { choose_block(a, b); }, "curvature: scales");
    smooth();
    return std::move(out_);
  }

 private:
  void climb_block(std::int64_t begin, std::int64_t end) {
    JetFitter fitter(run_, grain_.pyramid, options_.degree);
    for (std::int64_t i = begin; i < end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const std::int64_t p = middle_point(cells_, cell_[k]);
      const auto at = static_cast<std::size_t>(p);
      out_.nodes[k].x = Vec3(cells_.x[at], cells_.y[at], cells_.z[at]);
      out_.nodes[k].normal = mean_normal(cells_, cell_[k]);
      std::int64_t all = 0, against = 0;
      const Vec3 own(cells_.nx[at], cells_.ny[at], cells_.nz[at]);
      fitter.look(out_.nodes[k].x, own, cells_.size, &all, &against);
      out_.nodes[k].mixed = 10 * against > all;
      climb(fitter, out_.nodes[k].x, out_.nodes[k].normal, grain_.heights.of(cells_.row[at]), radii_,
            rungs_.data() + k * radii_.size());
    }
  }

  // Calls f(node) for the nodes of the cells within `reach` of node i's.
  template <class F>
  void around(std::int64_t i, std::int64_t reach, F&& f) const {
    const std::int64_t c = cell_[static_cast<std::size_t>(i)];
    const std::int64_t x = c % cells_.count[0], y = c / cells_.count[0] % cells_.count[1];
    const std::int64_t z = c / cells_.count[0] / cells_.count[1];
    for (std::int64_t k = std::max<std::int64_t>(0, z - reach); k <= std::min(cells_.count[2] - 1, z + reach); ++k) {
      for (std::int64_t j = std::max<std::int64_t>(0, y - reach); j <= std::min(cells_.count[1] - 1, y + reach); ++j) {
        for (std::int64_t l = std::max<std::int64_t>(0, x - reach); l <= std::min(cells_.count[0] - 1, x + reach);
             ++l) {
          const std::int32_t node =
              out_.node[static_cast<std::size_t>((k * cells_.count[1] + j) * cells_.count[0] + l)];
          if (node >= 0) f(static_cast<std::size_t>(node));
        }
      }
    }
  }

  // Squared drift of a node from rung k to rung k + kApart, less what noise alone does to it; the larger disc holds the
  // smaller, so that the variance of their difference is the difference of their variances.
  void drift_block(std::int64_t begin, std::int64_t end) {
    const std::size_t n = radii_.size();
    for (std::int64_t i = begin; i < end; ++i) {
      for (std::size_t k = 0; k + kApart < n; ++k) {
        const auto at = static_cast<std::size_t>(i) * n + k;
        const Rung &a = rungs_[at], &b = rungs_[at + kApart];
        if (!a.found || !b.found) continue;
        const double d = b.mean - a.mean;
        drifts_[at].mean = d * d - (a.variance_mean - b.variance_mean);
        drifts_[at].tensor = (b.tensor - a.tensor).squaredNorm() - (a.variance_tensor - b.variance_tensor);
        drifts_[at].variance = a.variance_tensor;
        drifts_[at].count = 1;
      }
    }
  }

  // Squared bias over r^2 order as the drifts about a node up to rung k tell it, each weighed by what noise does to it.
  void add_drifts(std::int64_t i, std::size_t k, double order, Drift* sum) const {
    Drift pool;
    const double reach = std::clamp(radii_[k] / cells_.size, 1.0, 3.0);
    around(i, static_cast<std::int64_t>(std::lround(reach)), [&](std::size_t node) {
      const Drift& d = drifts_[node * radii_.size() + k];
      pool.mean += d.mean, pool.tensor += d.tensor, pool.variance += d.variance, pool.count += d.count;
    });
    if (pool.count == 0) return;
    const double growth = std::pow(std::pow(radii_[k + kApart], order) - std::pow(radii_[k], order), 2);
    const double noise = pool.variance / pool.count + 1e-300;
    const double weight = growth / (noise * noise);
    sum->mean += weight * pool.mean / pool.count;
    sum->tensor += weight * pool.tensor / pool.count;
    sum->count += weight * growth;
  }

  void choose_block(std::int64_t begin, std::int64_t end) {
    const double order = options_.degree == 4 ? 4 : 2;
    for (std::int64_t i = begin; i < end; ++i) {
      Node& node = out_.nodes[static_cast<std::size_t>(i)];
      const Rung* rungs = rungs_.data() + static_cast<std::size_t>(i) * radii_.size();
      double least = std::numeric_limits<double>::infinity();
      std::size_t best = radii_.size();
      Drift sum;
      for (std::size_t k = 0; k < radii_.size(); ++k) {
        if (k + kApart < radii_.size()) add_drifts(i, k, order, &sum);
        if (!rungs[k].found) continue;
        const double power = std::pow(radii_[k], 2 * order);
        const double mean2 = sum.count > 0 ? std::max(0.0, sum.mean / sum.count * power) : 0;
        const double tensor2 = sum.count > 0 ? std::max(0.0, sum.tensor / sum.count * power) : 0;
        const double error = rungs[k].variance_tensor + kCaution * tensor2;
        if (best < radii_.size() && !(error < least)) continue;
        least = error;
        best = k;
        node.bias2_mean = kCredit * mean2;
        node.bias2_tensor = kCredit * tensor2;
      }
      if (best == radii_.size()) continue;
      node.found = true;
      node.radius = radii_[best];
      node.foot = rungs[best].foot;
      node.normal = rungs[best].normal;
      node.tensor = rungs[best].tensor;
    }
  }

  // The geometric mean of the radii about a node: neighbours should not differ by chance.
  void smooth() {
    std::vector<double> radius(out_.nodes.size());
    for (std::size_t i = 0; i < out_.nodes.size(); ++i) {
      double sum = 0;
      int count = 0;
      if (out_.nodes[i].found) {
        around(static_cast<std::int64_t>(i), 1, [&](std::size_t node) {
          if (!out_.nodes[node].found) return;
          sum += std::log(out_.nodes[node].radius);
          ++count;
        });
      }
      radius[i] = count > 0 ? std::exp(sum / count) : radii_[0];
    }
    for (std::size_t i = 0; i < out_.nodes.size(); ++i) out_.nodes[i].radius = radius[i];
  }

  const Run& run_;
  const Grain& grain_;
  const SkinCells& cells_;
  const CurvatureOptions& options_;
  std::vector<double> radii_;
  std::vector<std::int64_t> cell_;
  std::vector<Rung> rungs_;
  std::vector<Drift> drifts_;
  Scales out_;
};

}  // namespace

Scales choose_scales(const Run& run, const Grain& grain, const CurvatureOptions& options) {
  return Chooser(run, grain, options)();
}

}  // namespace sgrt
