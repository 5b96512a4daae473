// Cubic B-spline interpolation of images: the recursive prefilter of Unser, Aldroubi, Eden (1993) and the four weights.
#pragma once

#include "core/image.hpp"
#include "core/run.hpp"

namespace sgrt {

// In place: grey values -> coefficients of the interpolating cubic B-spline, mirrored at the ends.
void spline_rows(const Run& run, Image& image);     // along x
void spline_columns(const Run& run, Image& image);  // along y

// Weights of the coefficients k-1 .. k+2 at k + t, 0 <= t < 1.
inline void spline_weights(float t, float w[4]) {
  const float u = 1 - t;
  w[0] = u * u * u / 6;
  w[3] = t * t * t / 6;
  w[1] = 2.F / 3 - t * t * (1 - t / 2);
  w[2] = 2.F / 3 - u * u * (1 - u / 2);
}

// White noise of variance 1 has this variance after interpolation in one direction, averaged over the fraction: the
// integral of the squared cardinal spline.
constexpr double kSplineNoiseGain = 0.87423;

}  // namespace sgrt
