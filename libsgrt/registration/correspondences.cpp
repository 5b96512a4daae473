// Closest points, rejection and robust weights. docs/theory/icp.md eq. 1-5.
#include "registration/correspondences.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kFloor2 = 1e-6;  // mm2: nothing is known better than a micron; keeps weights finite without noise

// last: the closest reference point of the iteration before, or -1; it bounds the search, which is exact all the same.
bool find_pair(const Problem& p, const Pose& T, const PairLimits& limits, std::int64_t row, std::int64_t& last,
               Pair& pair) {
  pair.y = T * p.live->point(row);
  double bound = limits.max_distance;
  if (last >= 0) bound = std::min(bound, (p.reference().point(last) - pair.y).norm() * (1 + 1e-9) + 1e-9);
  const Nearest::Hit hit = p.field.nearest.nearest(pair.y, bound);
  last = hit.index;
  if (hit.index < 0 || !p.counts(hit.index) || !within_reach(p.field, hit.index, pair.y)) return false;
  pair.live = row;
  pair.reference = hit.index;
  pair.q = p.reference().point(hit.index);
  pair.m = p.reference().normal(hit.index);
  pair.l = T.R * p.live->normal(row);
  double cosine = pair.m.dot(pair.l);
  if (p.signs_unsure && cosine < 0) {
    pair.l = -pair.l;
    cosine = -cosine;
  }
  if (!(cosine >= limits.min_cos)) return false;
  pair.n = (pair.m + pair.l).normalized();
  pair.r = pair.n.dot(pair.y - pair.q);
  pair.live_variance = p.live_variance(row, T.R.transpose() * pair.n) + kFloor2 / 2;
  pair.reference_variance = p.reference_variance(hit.index, pair.n) + kFloor2 / 2;
  pair.weight = 1;
  return true;
}

double median(std::vector<double>& v) {
  if (v.empty()) return 0;
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

}  // namespace

void associate(const Run& run, const Problem& problem, const Pose& reference_from_live, const PairLimits& limits,
               std::vector<std::int64_t>& last, std::vector<Pair>& pairs) {
  const auto rows = static_cast<std::int64_t>(problem.rows.size());
  const std::int64_t count = (rows + limits.step - 1) / limits.step;
  pairs.resize(static_cast<std::size_t>(count));
  parallel_for(
      run, count, 1024,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          Pair& pair = pairs[static_cast<std::size_t>(i)];
          const std::int64_t row = problem.rows[static_cast<std::size_t>(i * limits.step)];
          if (!find_pair(problem, reference_from_live, limits, row, last[static_cast<std::size_t>(i * limits.step)],
                         pair))
            pair.reference = -1;
        }
      },
      "closest points");
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), [](const Pair& p) { return p.reference < 0; }), pairs.end());
}

double robust_scale(const std::vector<Pair>& pairs) {
  std::vector<double> u(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) u[i] = std::abs(pairs[i].r) / std::sqrt(pairs[i].variance());
  return std::max(1.0, 1.4826 * median(u));
}

void weigh(std::vector<Pair>& pairs, double scale, const Taper& taper) {
  for (Pair& p : pairs) {
    const double u = std::abs(p.r) / (scale * std::sqrt(p.variance()));
    const double t = std::max(0.0, (u - taper.flat) / (taper.end - taper.flat));
    p.weight = t < 1 ? (1 - t * t) * (1 - t * t) : 0;
  }
}

double median_distance(const std::vector<Pair>& pairs) {
  std::vector<double> d(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) d[i] = (pairs[i].y - pairs[i].q).norm();
  return median(d);
}

}  // namespace sgrt
