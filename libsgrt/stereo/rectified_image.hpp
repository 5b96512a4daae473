// A rectified image as the kernels read it: grey values, x-gradient and B-spline coefficients along x.
#pragma once

#include <cstdint>
#include <vector>

#include "core/image.hpp"
#include "core/run.hpp"
#include "stereo/kernels.hpp"

namespace sgrt {

// One spare row lets padded lanes read on.
struct RectifiedImage {
  Image value;
  std::vector<float> gradient, coefficient;
  std::vector<std::uint8_t> mask;
  Image scratch;
  double noise_gain = 1;  // what resampling has left of white noise, on average
  float rounding = 0;     // variance that the image's number format alone leaves in a grey level

  kernels::Plane plane() const {
    return {value.pixels.data(), gradient.data(), coefficient.data(), mask.data(), value.width, value.height};
  }
};
// Fills gradient and coefficient from value.
void prepare(const Run& run, RectifiedImage& image);

}  // namespace sgrt
