// Sub-pixel centres from the grey levels about a candidate: a Gaussian by least squares, or the ridge of the smoothed
// image. docs/theory/laser.md eq. 2-8.
#pragma once

#include <array>
#include <vector>

#include "laser/candidates.hpp"

namespace sgrt {

// Of a Gaussian, for what noise grows with the signal (eq. 7-8).
struct Fit {
  double residual = 0;           // sum of squares over the variance and the degrees of freedom; 0: none
  double variance = 0;           // px2, by the noise of dark pixels
  double shot = 0;               // how noise of variance a would add to the variance, a being the signal at a pixel
  double excess = 0, power = 0;  // sums of (r2 - noise2) a and of a2
};

struct Centre {
  double centre = 0, variance = 0;  // px, px2 by the noise alone
  float signal = 0, width = 0, asymmetry = 0, asymmetry_sigma = 0;
  Fit fit;
  LineReason reason = LineReason::kNone;
};

struct ProfileNoise {
  double sigma, gain;  // grey levels; grey levels an electron
};

Centre centroid_centre(const Lines& lines, int line, const Candidate& c, int half, const ProfileNoise& noise);
Centre gaussian_centre(const Run& run, const Lines& lines, int line, const Candidate& c, const ProfileNoise& noise);

// Derivatives of a Gaussian of sigma px.
struct RidgeKernel {
  explicit RidgeKernel(double sigma);
  int radius;
  std::vector<float> g0, g1, g2;
  double noise_gain;  // variance of a first derivative over that of a pixel
};
Centre ridge_centre(const Lines& lines, int line, const Candidate& c, const RidgeKernel& kernel,
                    const ProfileNoise& noise);

}  // namespace sgrt
