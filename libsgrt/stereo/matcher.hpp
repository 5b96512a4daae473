// One window refined alone, and when its answer counts. docs/theory/stereo.md eq. 6-11.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "stereo/bend.hpp"
#include "stereo/match.hpp"

namespace sgrt {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr kernels::RowMatch kNoMatch{kNan, 0, 0, 0, 0, 0, kNan, kNan, kNan, 1, 0, 0, 0, 0, 0, 0, kernels::kDiverged};
constexpr float kBent = 0.02F;      // px: a curvature that moves a match by so much may have higher orders too
constexpr float kStrong = 0.03F;    // px: beyond it a smaller window has a share in any case, at twice it all
constexpr float kMinSpread = 0.3F;  // of the texture over the window
constexpr float kFar = 0.5F;        // px from the nodes' surface: no longer a small step

inline Reason reason_of(int outcome) {
  switch (outcome) {
    case kernels::kLeftView:
    case kernels::kRightView:
      return Reason::kOutOfView;
    case kernels::kClipped:
      return Reason::kSaturated;
    case kernels::kFlat:
      return Reason::kNoTexture;
    default:
      return Reason::kNoMatch;
  }
}

// Weakly textured skin: a window of nearly four times the area.
inline int large_window(int window) {
  return std::min(41, 2 * window - 1);
}

inline int small_window(int window) {
  return std::max(9, (window * 3 / 5) | 1);
}

// How far the curvature moves the match of a window, px.
inline float bending_of(int window, const kernels::RowMatch& shape) {
  const auto m2 = static_cast<float>(second_moment(window));
  return m2 * std::sqrt(shape.c20 * shape.c20 + shape.c02 * shape.c02 + shape.c11 * shape.c11 / 2);
}

struct Matcher {
  const kernels::Plane left, right;
  const StereoOptions& options;
  const float rounding;      // the noise of f - g is never below it
  const float damping;       // noise_damping
  const float min_variance;  // one grey level: below it both images may show the same dither
  decltype(&kernels::refine_row_baseline) refine;

  Matcher(const Run& run, const RectifiedImage& l, const RectifiedImage& r, const StereoOptions& o)
      : left(l.plane()),
        right(r.plane()),
        options(o),
        rounding(l.rounding + r.rounding),
        damping(static_cast<float>(noise_damping(l.noise_gain, r.noise_gain))),
        min_variance(4 * std::max(l.rounding, r.rounding)),
        refine(run.isa == Isa::kAvx2 ? kernels::refine_row_avx2 : kernels::refine_row_baseline) {}

  // A single line in the window, of a rim or a shadow, matches to any precision, but says nothing of a surface.
  bool textured(const kernels::RowMatch& match) const {
    return sigma_of(match) <= options.max_sigma && match.spread >= kMinSpread;
  }

  // Refines from the plane in `match`; the reason is kNone when it is accepted.
  Reason solve(int x, int y, kernels::RowMatch& match, float max_move, int window = 0) const {
    match.window = window > 0 ? window : options.window;
    const kernels::RefineOptions o{match.window / 2, 10, min_variance, max_move};
    refine(left, right, x, y, o, &match);
    // ZNCC knows no scale: without this floor the last bits of a blank wall would correlate.
    match.noise = std::max(match.noise, rounding);
    match.texture /= damping;
    if (match.outcome != kernels::kConverged) return reason_of(match.outcome);
    if (!(match.correlation >= options.min_correlation)) return Reason::kNoMatch;
    return textured(match) ? Reason::kNone : Reason::kNoTexture;
  }

  // Matches back from the right image; true when it returns to where it came from.
  bool returns(int x, int y, const kernels::RowMatch& match) const {
    const int x_right = x - static_cast<int>(std::lround(match.d));
    const float s = 1 - match.a;
    const float x_left = static_cast<float>(x) + (static_cast<float>(x_right - x) + match.d) / s;
    kernels::RowMatch back = kNoMatch;
    back.d = static_cast<float>(x_right) - x_left;
    back.a = 1 - 1 / s;
    back.b = -match.b / s;
    // The inverse of the warp to second order.
    const float s3 = s * s * s, b = match.b;
    back.c20 = -match.c20 / s3;
    back.c11 = -2 * match.c20 * b / s3 - match.c11 / (s * s);
    back.c02 = -match.c20 * b * b / s3 - match.c11 * b / (s * s) - match.c02 / s;
    const kernels::RefineOptions o{match.window / 2, 6, min_variance, 2};
    refine(right, left, x_right, y, o, &back);
    if (back.outcome != kernels::kConverged || !(back.correlation >= options.min_correlation)) return false;
    return std::abs(static_cast<float>(x_right) - back.d - x_left) <= options.max_left_right;
  }
};

}  // namespace sgrt
