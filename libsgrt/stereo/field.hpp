// The grid of matches that seeds, growth, checks and triangulation work on.
#pragma once

#include <cstdint>
#include <vector>

#include "stereo/kernels.hpp"
#include "stereo/stereo.hpp"

namespace sgrt {

// Grid point (i, j) is the rectified left pixel (offset + i stride, offset + j stride).
struct Grid {
  int width = 0, height = 0, stride = 4, offset = 0;
  int x(std::int64_t k) const { return offset + static_cast<int>(k % width) * stride; }
  int y(std::int64_t k) const { return offset + static_cast<int>(k / width) * stride; }
  std::int64_t size() const { return static_cast<std::int64_t>(width) * height; }
};

struct MatchField {
  std::vector<kernels::RowMatch> matches;  // one a grid point
  std::vector<Reason> reason;
  std::vector<std::int64_t> wave, tried, labels;  // work
};

// Variance of a match along the row from image noise alone, px^2; sigma_of adds what the window's shape may bias, px.
double variance_of_noise(const kernels::RowMatch& match);
// The residual f - g holds two images' noise after interpolation, which damps the fine grain that the residual sees but
// not the coarse grain that moves a match: by this, where resampling has left the shares given (eq. 11).
double noise_damping(double left_gain, double right_gain);
double sigma_of(const kernels::RowMatch& match);

// The plane of `from` carried to another pixel.
kernels::RowMatch extrapolate(const kernels::RowMatch& from, int dx, int dy);

}  // namespace sgrt
