#include "stereo/field.hpp"

#include <cmath>

#include "stereo/spline.hpp"

namespace sgrt {

using kernels::RowMatch;

double variance_of_noise(const RowMatch& match) {
  // The residual f - g holds two images' noise after interpolation (left: x and y; right: x, y and x again), which
  // damps the fine grain that the residual sees but not the coarse grain that moves the match.
  constexpr double kGain2 = kSplineNoiseGain * kSplineNoiseGain;
  constexpr double kDamping = (kGain2 + kGain2 * kSplineNoiseGain) / 2;
  return static_cast<double>(match.noise) * match.texture * match.gain / kDamping;
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
