// Pairs of a live point and its closest reference point, and how far each can be trusted. docs/theory/icp.md eq. 1-5.
#pragma once

#include <vector>

#include "core/geometry.hpp"
#include "registration/problem.hpp"

namespace sgrt {

struct Pair {
  std::int64_t live, reference;              // rows
  Vec3 y, q;                                 // the live point moved, the reference point, mm
  Vec3 m, l;                                 // normals: of the reference; of the live point, moved and on m's side
  Vec3 n;                                    // unit, half-way between m and l (Rusinkiewicz 2019): no bias by curvature
  double r;                                  // n . (y - q), mm
  double live_variance, reference_variance;  // mm2 along n
  double weight;                             // 0 to 1

  double variance() const { return live_variance + reference_variance; }
};

struct PairLimits {
  double max_distance;    // mm
  double min_cos;         // of the angle between m and l
  std::int64_t step = 1;  // take every step-th live point
};

// Closest points at the pose; those too far, at too great an angle, past the border of the reference or outside the ROI
// are left out. In the live points' order.
void associate(const Run& run, const Problem& problem, const Pose& reference_from_live, const PairLimits& limits,
               std::vector<std::int64_t>& last, std::vector<Pair>& pairs);

// How many times the expected sigma the residuals scatter, by their median; at least 1. Eq. 4.
double robust_scale(const std::vector<Pair>& pairs);

// Weight 1 up to `flat` robust sigmas, then smoothly down to 0 at `end` (eq. 5). flat = 0, end = 4.685 is Tukey's
// biweight.
struct Taper {
  double flat, end;
};
constexpr Taper kTukey{0, 4.685};  // far from the minimum: firm against what does not match
constexpr Taper kInliers{3, 6};    // at the minimum: least squares on the inliers, so that the certificate is simple
void weigh(std::vector<Pair>& pairs, double scale, const Taper& taper);

// The median distance of the pairs' points, mm.
double median_distance(const std::vector<Pair>& pairs);

}  // namespace sgrt
