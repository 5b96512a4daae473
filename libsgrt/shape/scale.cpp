// From the drifts about a node what its discs are worth, and the best of them. docs/theory/curvature.md eq. 14-17.
#include "shape/scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "shape/ladder.hpp"
#include "shape/outlook.hpp"

namespace sgrt {
namespace {

constexpr double kCaution = 2.5;  // weight of bias against noise: a sigma should mean noise first of all
constexpr double kReach = 0.6;    // of a disc's radius: nodes so near share their drift
constexpr double kNearest = 1.2, kFarthest = 2.2;  // cells: the reach at least, and at most
constexpr double kIndependent = 6;                 // drifts on an area of r^2
constexpr std::int64_t kBlock = 64;

class Chooser {
 public:
  Chooser(const Run& run, const Grain& grain, const CurvatureOptions& options)
      : run_(run),
        cells_(grain.pyramid.levels[0]),
        ladder_(climb_ladders(run, grain, options)),
        order_(options.degree == 4 ? 4 : 2),
        rungs_(ladder_.radii.size()) {}

  Scales operator()() {
    const auto n = static_cast<std::int64_t>(ladder_.cell.size());
    nodes_.resize(ladder_.cell.size());
    drifts_.resize(ladder_.rungs.size());
    parallel_for(
        run_, n, kBlock,
        [&](std::int64_t begin, std::int64_t end) {
          std::vector<Near> near;
          for (std::int64_t i = begin; i < end; ++i) {
            pool(static_cast<std::size_t>(i), near);
            choose(static_cast<std::size_t>(i));
          }
        },
        "curvature: scales");
    smooth();
    return {std::move(ladder_.node), std::move(nodes_), order_};
  }

 private:
  struct Near {
    std::size_t node;
    double distance2;
  };

  // Calls f(node) for the nodes of the cells within `reach` of node i's.
  template <class F>
  void around(std::size_t i, std::int64_t reach, F&& f) const {
    const std::int64_t c = ladder_.cell[i], *count = cells_.count;
    const std::int64_t x = c % count[0], y = c / count[0] % count[1], z = c / count[0] / count[1];
    for (std::int64_t k = std::max<std::int64_t>(0, z - reach); k <= std::min(count[2] - 1, z + reach); ++k) {
      for (std::int64_t j = std::max<std::int64_t>(0, y - reach); j <= std::min(count[1] - 1, y + reach); ++j) {
        const std::int64_t row = (k * count[1] + j) * count[0];
        for (std::int64_t l = std::max<std::int64_t>(0, x - reach); l <= std::min(count[0] - 1, x + reach); ++l) {
          const std::int32_t node = ladder_.node[static_cast<std::size_t>(row + l)];
          if (node >= 0) f(static_cast<std::size_t>(node));
        }
      }
    }
  }

  // The drifts about node i from each rung to the next. The larger disc holds the smaller, so that the variance of
  // their difference is the difference of their variances.
  void pool(std::size_t i, std::vector<Near>& near) {
    near.clear();
    const double most = kFarthest * cells_.size;
    around(i, static_cast<std::int64_t>(std::ceil(kFarthest)), [&](std::size_t node) {
      const double d2 = (ladder_.x[node] - ladder_.x[i]).squaredNorm();
      if (d2 <= most * most) near.push_back({node, d2});
    });
    for (std::size_t k = 0; k + 1 < rungs_; ++k) {
      const double r = ladder_.radii[k], reach = std::clamp(kReach * r, kNearest * cells_.size, most);
      Mat3 sum = Mat3::Zero();
      double square = 0, variance = 0, n = 0;
      for (const Near& at : near) {
        const Rung* rung = ladder_.rungs_of(at.node) + k;
        if (at.distance2 > reach * reach || !rung[0].found || !rung[1].found) continue;
        const Mat3 drift = rung[1].tensor - rung[0].tensor;
        sum += drift;
        square += drift.squaredNorm();
        variance += rung[0].variance - rung[1].variance;
        n += 1;
      }
      if (n == 0) continue;
      Drift& d = drifts_[i * rungs_ + k];
      const double own = std::min(n, 1 + kIndependent * n * cells_.size * cells_.size / (r * r));
      d.mean = sum / n;
      d.variance = std::max(0.0, variance / (n * own));
      d.spread = square / n - d.mean.squaredNorm() - (own - 1) * d.variance;
      const Rung* self = ladder_.rungs_of(i) + k;
      if (self[0].found && self[1].found) {
        d.own = self[1].tensor - self[0].tensor;
        d.own_variance = std::max(0.0, self[0].variance - self[1].variance);
      }
      d.chance = d.variance * std::sqrt(2.0 / 3 * own);
    }
  }

  Outlook outlook(std::size_t i, double radius, double variance) const {
    return outlook_of(drifts_.data() + i * rungs_, ladder_.radii.data(), rungs_, order_, radius, variance);
  }

  void choose(std::size_t i) {
    Node& node = nodes_[i];
    node.normal = ladder_.normal[i];
    node.mixed = ladder_.mixed[i] != 0;
    const Rung* rungs = ladder_.rungs_of(i);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < ladder_.chosen; ++k) {
      if (!rungs[k].found) continue;
      const Outlook o = outlook(i, ladder_.radii[k], rungs[k].variance);
      const double error = o.inflate * rungs[k].variance + kCaution * o.left2;
      if (node.found && !(error < least)) continue;
      least = error;
      node.found = true;
      node.radius = ladder_.radii[k];
      node.foot = rungs[k].foot;
      node.normal = rungs[k].normal;
      node.tensor = rungs[k].tensor;
      node.variance = rungs[k].variance;
    }
  }

  // The geometric mean of the radii about a node: neighbours should not differ by chance.
  void smooth() {
    std::vector<double> radius(nodes_.size(), ladder_.radii[0]);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      double sum = 0, count = 0;
      around(i, 1, [&](std::size_t node) {
        if (!nodes_[node].found) return;
        sum += std::log(nodes_[node].radius);
        count += 1;
      });
      if (count > 0) radius[i] = std::exp(sum / count);
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      Node& node = nodes_[i];
      if (node.found) foresee(i, node, radius[i]);
      node.radius = radius[i];
    }
  }

  void foresee(std::size_t i, Node& node, double radius) const {
    const Outlook o = outlook(i, radius, node.variance * std::pow(node.radius / radius, 6));
    node.rate = o.bias / std::pow(radius, order_);
    node.inflate = o.inflate;
    node.bias2_tensor = o.left2;
    node.bias2_mean = o.mean_part * o.left2;
  }

  const Run& run_;
  const SkinCells& cells_;
  Ladder ladder_;
  int order_;
  std::size_t rungs_;
  std::vector<Drift> drifts_;
  std::vector<Node> nodes_;
};

}  // namespace

Scales choose_scales(const Run& run, const Grain& grain, const CurvatureOptions& options) {
  return Chooser(run, grain, options)();
}

}  // namespace sgrt
