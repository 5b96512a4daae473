// Hypotheses, graduated weights, agreement. docs/theory/nonrigid.md section 2.
#include "registration/consensus.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/median.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kSeen = 6;     // live points of a patch
constexpr double kFloor = 0.04;       // mm: two surfaces of one body are never more alike, patch by patch
constexpr std::size_t kCentres = 20;  // of hypotheses
constexpr std::size_t kPairCentres = 12;
constexpr int kRounds = 14;

using Weights = std::vector<double>;

Vec6 solve(const Evidence& e, const Weights& weights) {
  Vec6 g;
  Mat6 A = information(e, weights, &g);
  A.diagonal().array() += 1e-6 * A.trace() + 1e-12;  // a small region may leave a direction free: stay where we are
  return A.ldlt().solve(Vec6(-g));
}

// Graduated: wide at first, so that the whole region pulls, then down to what noise explains.
Agreement settle(const Patches& patches, const Evidence& e, Vec6 xi) {
  const std::size_t n = e.sums.size();
  Weights u(n), w(n);
  double limit = 4 * kAgrees;
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t p = 0; p < n; ++p) u[p] = e.seen[p] ? misfit2(e, p, xi) : 0;
    for (std::size_t p = 0; p < n; ++p) {
      const double t = std::min(1.0, u[p] / (limit * limit));
      w[p] = e.seen[p] ? (1 - t) * (1 - t) : 0;
    }
    xi = solve(e, w);
    limit = std::max(kAgrees, 0.75 * limit);
  }
  Agreement a;
  a.xi = xi;
  for (std::size_t p = 0; p < n; ++p) {
    if (!e.seen[p]) continue;
    const double m = misfit2(e, p, xi) / (kAgrees * kAgrees);
    a.score += patches.area[p] * std::min(1.0, m);
    a.share += m < 1 ? patches.area[p] : 0;
  }
  a.score /= e.seen_area;
  a.share /= e.seen_area;
  return a;
}

// The patches nearest to a centre that make up a share of the area.
std::vector<std::uint8_t> ball(const Patches& patches, const Evidence& e, std::size_t centre, double share) {
  std::vector<std::size_t> order(patches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto distance2 = [&](std::size_t p) { return (patches.centre[p] - patches.centre[centre]).squaredNorm(); };
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return distance2(a) < distance2(b); });
  std::vector<std::uint8_t> inside(patches.size(), 0);
  double area = 0;
  for (const std::size_t p : order) {
    if (area >= share * e.seen_area) break;
    inside[p] = 1;
    if (e.seen[p]) area += patches.area[p];
  }
  return inside;
}

// Where the body may have moved as one: all of it; a part about each of some points; all but such a part; all but two.
std::vector<Weights> hypotheses(const Patches& patches, const Evidence& e) {
  std::vector<Weights> all;
  const std::size_t n = patches.size();
  const auto add = [&](auto&& rigid) {
    Weights w(n);
    for (std::size_t p = 0; p < n; ++p) w[p] = e.seen[p] && rigid(p) ? 1 : 0;
    all.push_back(std::move(w));
  };
  add([](std::size_t) { return true; });
  const std::size_t centres = std::min(n, kCentres);  // the first patches are the farthest from each other
  for (std::size_t c = 0; c < centres; ++c) {
    for (const double share : {0.35, 0.5, 0.65}) {
      const auto inside = ball(patches, e, c, share);
      add([&](std::size_t p) { return inside[p] != 0; });
    }
    for (const double share : {0.25, 0.4}) {
      const auto inside = ball(patches, e, c, share);
      add([&](std::size_t p) { return inside[p] == 0; });
    }
  }
  const std::size_t pairs = std::min(n, kPairCentres);
  std::vector<std::vector<std::uint8_t>> small;
  small.reserve(pairs);
  for (std::size_t c = 0; c < pairs; ++c) small.push_back(ball(patches, e, c, 0.2));
  for (std::size_t a = 0; a < pairs; ++a) {
    for (std::size_t b = a + 1; b < pairs; ++b) add([&](std::size_t p) { return !small[a][p] && !small[b][p]; });
  }
  return all;
}

}  // namespace

Mat6 information(const Evidence& e, const Weights& weights, Vec6* gradient) {
  Mat6 A = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  for (std::size_t p = 0; p < e.sums.size(); ++p) {
    const double w = weights[p] * e.trust[p];
    if (!(w > 0)) continue;
    A += w * e.sums[p].A;
    g += w * e.sums[p].g;
  }
  if (gradient != nullptr) *gradient = g;
  return A;
}

Evidence evidence_of(const Patches& patches, std::vector<PatchSum> sums, double correlation_points) {
  Evidence e;
  e.sums = std::move(sums);
  const std::size_t n = e.sums.size();
  e.seen.assign(n, 0);
  e.variance.assign(n, 0);
  e.trust.assign(n, 0);
  e.pooled.resize(n);
  std::vector<double> scatter;
  for (std::size_t p = 0; p < n; ++p) {
    const PatchSum& s = e.sums[p];
    e.seen[p] = s.count >= kSeen ? 1 : 0;
    if (!e.seen[p]) continue;
    e.seen_area += patches.area[p];
    scatter.push_back((s.c - s.r * s.r / s.w) / static_cast<double>(s.count - 1));
  }
  if (!scatter.empty()) e.noise = std::sqrt(std::max(1e-4, median(scatter)));
  for (std::size_t p = 0; p < n; ++p) {
    if (!e.seen[p]) continue;
    const double own = e.noise * e.noise * correlation_points / e.sums[p].w;
    e.variance[p] = own + patches.reference_variance[p] + kFloor * kFloor;
    e.trust[p] = own / e.variance[p];
  }
  for (std::size_t p = 0; p < n; ++p) {
    if (!e.seen[p]) continue;
    double sum = 0;
    const auto take = [&](std::size_t q) {
      const double w = 1 / e.variance[q];
      e.pooled[p].r += w * e.sums[q].r / e.sums[q].w;
      e.pooled[p].j += w * e.sums[q].j / e.sums[q].w;
      sum += w;
    };
    take(p);
    for (const std::int32_t q : patches.next[p]) {
      if (e.seen[static_cast<std::size_t>(q)]) take(static_cast<std::size_t>(q));
    }
    e.pooled[p].r /= sum;
    e.pooled[p].j /= sum;
    e.pooled[p].variance = 1 / sum + kFloor * kFloor;
  }
  return e;
}

double misfit2(const Evidence& e, std::size_t p, const Vec6& xi) {
  const double own = e.sums[p].mean(xi), pooled = e.pooled[p].r + e.pooled[p].j.dot(xi);
  return std::max(own * own / e.variance[p], pooled * pooled / e.pooled[p].variance);
}

std::vector<Agreement> consensus(const Patches& patches, const Evidence& e) {
  std::vector<Agreement> found;
  found.push_back(settle(patches, e, Vec6::Zero()));
  for (const Weights& w : hypotheses(patches, e)) found.push_back(settle(patches, e, solve(e, w)));
  std::stable_sort(found.begin(), found.end(),
                   [](const Agreement& a, const Agreement& b) { return a.score < b.score; });
  return found;
}

}  // namespace sgrt
