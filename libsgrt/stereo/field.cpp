#include "stereo/field.hpp"

#include <cmath>

#include "stereo/spline.hpp"

namespace sgrt {

using kernels::RowMatch;

double variance_of_noise(const RowMatch& match) {
  return static_cast<double>(match.noise) * match.texture * match.gain;
}

double noise_damping(double left_gain, double right_gain) {
  return (left_gain + right_gain * kQuinticNoiseGain) / 2;
}

double sigma_of(const RowMatch& match) {
  return std::sqrt(variance_of_noise(match) + match.bias2);
}

RowMatch extrapolate(const RowMatch& from, int dx, int dy) {
  RowMatch match = from;
  match.d = from.d + from.a * static_cast<float>(dx) + from.b * static_cast<float>(dy);
  match.c20 = match.c11 = match.c02 = 0;
  return match;
}

}  // namespace sgrt
