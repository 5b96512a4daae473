// B-spline interpolation of images: the recursive prefilters of Unser, Aldroubi, Eden (1993) and the cubic's four
// weights.
#pragma once

#include <cmath>

#include "core/image.hpp"
#include "core/run.hpp"

namespace sgrt {

// In place: grey values -> coefficients of the interpolating cubic B-spline, mirrored at the ends.
void spline_rows(const Run& run, Image& image);     // along x
void spline_columns(const Run& run, Image& image);  // along y
void quintic_spline_rows(const Run& run, Image& image);

// Weights of the coefficients k-1 .. k+2 at k + t, 0 <= t < 1.
inline void spline_weights(float t, float w[4]) {
  const float u = 1 - t;
  w[0] = u * u * u / 6;
  w[3] = t * t * t / 6;
  w[1] = 2.F / 3 - t * t * (1 - t / 2);
  w[2] = 2.F / 3 - u * u * (1 - u / 2);
}

// What interpolation at the fraction t leaves of white noise of variance 1: the squares of the cardinal cubic spline,
// as a cosine series to 0.0008.
inline double cubic_noise_gain(double t) {
  constexpr double kTurn = 6.283185307179586;
  return 0.87425 + 0.12131 * std::cos(kTurn * t) + 0.00366 * std::cos(2 * kTurn * t);
}
// The quintic's, averaged over the fraction.
constexpr double kQuinticNoiseGain = 0.91797;

}  // namespace sgrt
