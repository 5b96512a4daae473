// The grey levels about a candidate, and what all three fits ask of them.
#pragma once

#include <algorithm>
#include <cmath>

#include "laser/profile_fit.hpp"

namespace sgrt {

constexpr int kMostPixels = 401;

// The grey levels of a window round a candidate, cut at the image's border.
struct Window {
  float v[kMostPixels + 3];  // room to be read by fours
  int from, count, clipped = 0;

  Window(const Lines& lines, int line, int at, int half) {
    half = std::min(half, (kMostPixels - 1) / 2);
    from = std::max(0, at - half);
    count = std::min(lines.width(), at + half + 1) - from;
    lines.read(line, from, count, v);
    for (int i = 0; i < count; ++i) clipped += v[i] >= Lines::kClipped ? 1 : 0;
    for (int i = count; i < count + 3; ++i) v[i] = Lines::kClipped;
  }
  bool good(int i) const { return v[i] < Lines::kClipped; }
};

// Of a Gaussian: a crossing moves by the noise over the slope there, both middles together over the width.
inline float asymmetry_sigma(double sigma, double contrast) {
  return static_cast<float>(1.35 * sigma / contrast);
}

inline void set_shape(const Lines& lines, Window& w, double centre, double background, double contrast, double sigma,
                      Centre& out) {
  level(w.v, w.count, lines.clip);
  const auto low = static_cast<float>(background);
  const float high = std::min(static_cast<float>(contrast), lines.clip - low);
  out.asymmetry = asymmetry_of(w.v, w.count, static_cast<float>(centre - w.from), out.width, low, high);
  out.asymmetry_sigma = asymmetry_sigma(sigma, contrast);
}

// Enough that is not clipped on both sides to tell the centre.
inline bool flanks(const Window& w, double centre, double width) {
  int left = 0, right = 0;
  for (int i = 0; i < w.count; ++i) {
    const double d = w.from + i - centre;
    if (!w.good(i) || std::abs(d) > 3.5 * width + 1) continue;
    (d < 0 ? left : right) += 1;
  }
  return left >= 2 && right >= 2;
}

}  // namespace sgrt
