// From the coarse map to a sub-pixel match at every grid point: seeds, growth from solved neighbours, left-right check,
// removal of islands. docs/theory/stereo.md.
#pragma once

#include <cstdint>
#include <vector>

#include "core/image.hpp"
#include "core/run.hpp"
#include "stereo/coarse.hpp"
#include "stereo/kernels.hpp"
#include "stereo/stereo.hpp"

namespace sgrt {

// A rectified image with what the kernels need; one spare row lets padded lanes read on.
struct RectifiedImage {
  Image value;
  std::vector<float> gradient, coefficient;
  std::vector<std::uint8_t> mask;
  Image scratch;

  kernels::Plane plane() const {
    return {value.pixels.data(), gradient.data(), coefficient.data(), mask.data(), value.width, value.height};
  }
};
// Fills gradient and coefficient from value.
void prepare(const Run& run, RectifiedImage& image);

// Grid point (i, j) is the rectified left pixel (offset + i stride, offset + j stride).
struct Grid {
  int width = 0, height = 0, stride = 4, offset = 0;
  int x(std::int64_t k) const { return offset + static_cast<int>(k % width) * stride; }
  int y(std::int64_t k) const { return offset + static_cast<int>(k / width) * stride; }
  std::int64_t size() const { return static_cast<std::int64_t>(width) * height; }
};

struct MatchField {
  std::vector<kernels::RowMatch> matches;  // one a grid point
  std::vector<kernels::RowMatch> bent;     // work: the second pass
  std::vector<Reason> reason;
  std::vector<std::int64_t> wave, tried, labels;  // work
  std::vector<float> noise;                       // work
  std::vector<double> medians[3];                 // work
  double gain = 0;                                // bending_gain, once it is known
};

void match_grid(const Run& run, const RectifiedImage& left, const RectifiedImage& right, const CoarseMap& coarse,
                const Grid& grid, const StereoOptions& options, MatchField& field);

// How much the variance of d grows when the curvature comes from the neighbours' slopes, which share noise with it (eq.
// 12).
double bending_gain(int window, int stride);

// Variance of a match along the row from image noise alone, px^2; sigma_of adds what the window's shape may bias, px.
double variance_of_noise(const kernels::RowMatch& match);
double sigma_of(const kernels::RowMatch& match);

}  // namespace sgrt
