// One pass over live points at a pose: pairs, weights, and the sums of the normal equations. docs/theory/icp.md eq.
// 1-7.
#pragma once

#include "core/geometry.hpp"
#include "core/run.hpp"
#include "registration/live.hpp"
#include "registration/surfels.hpp"

namespace sgrt {

// Weight 1 up to `flat` robust sigmas, then smoothly down to 0 at `end` (eq. 6). flat = 0, end = 4.685 is Tukey's
// biweight.
struct Taper {
  double flat, end;
};
constexpr Taper kTukey{0, 4.685};  // far from the minimum: firm against what does not match
constexpr Taper kInliers{3, 6};    // at the minimum: least squares on the inliers, so that the certificate is simple

struct PassOptions {
  int level = 0;      // of the field, the finest to look up
  int levels = 1;     // how many: a point without a surfel in one is looked up in the next
  double limit = 40;  // mm
  double min_cos = 0.7;
  bool signs_unsure = false;
  double scale = 0;  // sigma of the residuals in expected sigmas; 0: all weights 1
  Taper taper = kTukey;
  bool unit_noise = false;           // every point alike, sigma 1 mm
  const float* given = nullptr;      // weights, instead of scale and taper
  bool score = false;                // sums for the covariance of the score
  float *r = nullptr, *w = nullptr;  // out: one a point and the padding
  std::int32_t* surfel = nullptr;
};

// About the field's centre, turns in radians.
struct Sums {
  Mat6 A = Mat6::Zero();                   // sum of W J J^T, J = (y x n, n)
  Vec6 g = Vec6::Zero();                   // sum of W J r
  double cost = 0;                         // sum of W r^2
  double chi = 0, weight = 0, square = 0;  // sums of w r^2 / noise, w, w r^2
  double pairs = 0, candidates = 0, flipped = 0;
  Sums& operator+=(const Sums& o);
};

Sums do_pass(const Run& run, const SurfelField& field, const LivePoints& live, const Pose& reference_from_live,
             const PassOptions& options);

// The step of Gauss and Newton about the field's centre, -A^-1 g, without directions that the pairs do not see at all.
Vec6 step_of(const Sums& sums, double lever);

// x -> Exp(w) (x - pivot) + pivot + t.
Pose motion_about(const Vec6& twist, const Vec3& pivot);

// The farthest that such a motion moves a point of the field's box, mm.
double farthest(const SurfelField& field, const Vec6& twist);

}  // namespace sgrt
