// Coarse to fine. docs/theory/icp.md section 3.
#include "registration/search.hpp"

#include <algorithm>
#include <cmath>

#include "registration/noise.hpp"
#include "registration/refine.hpp"
#include "registration/robust.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::int64_t kSubset = 2000;
constexpr int kEnoughSurfels = 40;  // a level of fewer has lost the shape
constexpr int kRoundsPerLevel = 12;
constexpr double kLeastScale = 0.02;  // mm: closer than this residuals are not told apart on the way
// A step this many sigmas long does not matter; and that much may stay undecided where the steps go to and fro.
constexpr double kSettled = 0.02, kFlicker = 0.25;

// Two twists' product in the metric of the information, in which a sigma has length 1.
double product(const Sums& sums, const Vec6& a, const Vec6& b) {
  return a.dot(sums.A * b) / 6;
}

class Searcher {
 public:
  Searcher(const Run& run, const Reference& reference, const IcpOptions& options, Workspace& work, Search& s)
      : run_(run), reference_(reference), field_(reference.field), options_(options), work_(work), s_(s) {}

  // Down the levels on the subset. False: too few pairs.
  bool descend(double start_error) {
    draw_subset(work_.live, kSubset, work_.subset);
    work_.subset_r.resize(work_.subset.x.size());
    work_.subset_w.resize(work_.subset.x.size());
    const auto top = static_cast<int>(field_.levels.size()) - 1;
    int first = top;
    while (first > 0 && field_.levels[static_cast<std::size_t>(first)].count < kEnoughSurfels) --first;
    while (first > 0 && field_.cell * std::exp2(first - 1) > start_error) --first;
    double scale = 0;
    for (int level = first; level >= 0; --level) {
      const double cell = field_.cell * std::exp2(level);
      for (int round = 0; round < kRoundsPerLevel && s_.iterations < options_.max_iterations; ++round) {
        PassOptions o = options(level, top + 1 - level);
        o.unit_noise = true;
        o.scale = scale;
        o.r = work_.subset_r.data();
        o.w = work_.subset_w.data();
        const Sums sums = do_pass(run_, field_, work_.subset, s_.pose, o);
        ++s_.iterations;
        s_.sums = sums;
        if (sums.pairs < kMinPairs) return false;
        scale = std::max(kLeastScale, 1.4826 * median_residual());
        const double moved = take(step_of(sums, field_.lever), std::max(4 * cell, 20.0));
        if (moved < (level == 0 ? 0.002 : 0.02) * cell) break;
      }
      s_.limit = std::min(options_.max_distance, std::max(4 * scale, 1.5 * cell));
    }
    return true;
  }

  // All points, inlier weights, refinement, until the pose rests.
  void settle(const Vec3& isocentre) {
    const std::size_t n = work_.live.x.size();
    work_.w.resize(n);
    double gain = 1;
    Vec6 last = Vec6::Zero();
    s_.scale = subset_scale();
    while (s_.iterations < options_.max_iterations) {
      PassOptions o = options(0, 2);
      o.scale = s_.scale;
      o.taper = kInliers;
      o.w = work_.w.data();
      const Sums sums = do_pass(run_, field_, work_.live, s_.pose, o);
      ++s_.iterations;
      s_.sums = sums;
      if (sums.pairs < kMinPairs) return;
      const Vec6 step = refine(sums, field_.centre, isocentre, field_.lever);
      const double sigmas = std::sqrt(product(sums, step, step)) / s_.scale;
      const double moved = farthest(field_, step);
      if (moved < options_.step_tolerance || sigmas < kSettled || (gain < 0.3 && sigmas < kFlicker)) {
        take(step, moved);
        s_.converged = true;
        return;
      }
      gain = product(sums, step, last) < 0 ? 0.5 * gain : std::min(1.0, 1.2 * gain);
      last = step;
      take(gain * step, moved);
    }
  }

 private:
  PassOptions options(int level, int levels) const {
    PassOptions o = finest(reference_, options_, s_.limit);
    o.level = level;
    o.levels = levels;
    return o;
  }

  // Moves the pose by the step, but no farther than so many mm; returns how far.
  double take(Vec6 step, double most) {
    const double moved = farthest(field_, step);
    if (moved > most) step *= most / moved;
    s_.pose = motion_about(step, field_.centre) * s_.pose;
    return moved;
  }

  double median_residual() {
    work_.values.clear();
    for (std::size_t i = 0; i < static_cast<std::size_t>(work_.subset.count); ++i) {
      const float v = std::abs(work_.subset_r[i]);
      if (v <= static_cast<float>(s_.limit)) work_.values.push_back(v);
    }
    return median_of(work_.values, work_.scratch);
  }

  // How many times the expected sigma the residuals scatter, by their median; at least 1 (eq. 7).
  double subset_scale() {
    if (work_.subset.v.empty() && !work_.live.v.empty()) draw_subset(work_.live, kSubset, work_.subset);
    work_.subset.v_all = work_.live.v_all;
    PassOptions o = options(0, 1);
    o.r = work_.subset_r.data();
    o.w = work_.subset_w.data();
    do_pass(run_, field_, work_.subset, s_.pose, o);
    const LivePoints& live = work_.subset;
    work_.values.clear();
    for (std::size_t i = 0; i < static_cast<std::size_t>(live.count); ++i) {
      if (!(work_.subset_w[i] > 0)) continue;
      const float v = (live.v.empty() ? live.v_all : live.v[i]) + reference_.typical_height;
      work_.values.push_back(std::abs(work_.subset_r[i]) / std::sqrt(v));
    }
    return std::max(1.0, 1.4826 * median_of(work_.values, work_.scratch));
  }

  const Run& run_;
  const Reference& reference_;
  const SurfelField& field_;
  const IcpOptions& options_;
  Workspace& work_;
  Search& s_;
};

}  // namespace

PassOptions finest(const Reference& reference, const IcpOptions& options, double limit) {
  PassOptions o;
  o.limit = limit;
  o.min_cos = std::cos(options.max_angle_deg * kPi / 180);
  o.signs_unsure = !reference.has_normals;
  return o;
}

Search search(const Run& run, const Reference& reference, const Surface& live, const Pose& initial, double start_error,
              const Vec3& isocentre, const IcpOptions& options, Workspace& work) {
  Search s{initial, 0, false, options.max_distance, 1, {}};
  Searcher searcher(run, reference, options, work, s);
  if (!searcher.descend(start_error)) return s;
  PassOptions o = finest(reference, options, s.limit);
  fill_live_noise(run, reference, live, s.pose, o, work);
  searcher.settle(isocentre);
  return s;
}

}  // namespace sgrt
