// Rectified images of a smooth texture that is known everywhere: a sum of plane waves.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "stereo/match.hpp"

namespace sgrt::testing {

struct PlaneWaves {
  double amplitude;                          // of each, grey levels about 100
  std::vector<std::array<double, 3>> waves;  // rad a px along x and y, phase

  // Wavelengths in px.
  PlaneWaves(unsigned seed, int count, double shortest, double longest, double amplitude_) : amplitude(amplitude_) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> angle(0, 2 * M_PI), length(shortest, longest);
    waves.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      const double k = 2 * M_PI / length(random), a = angle(random);
      waves.push_back({k * std::cos(a), k * std::sin(a), angle(random)});
    }
  }
  double operator()(double x, double y) const {
    double sum = 0;
    for (const auto& w : waves) sum += std::cos(w[0] * x + w[1] * y + w[2]);
    return 100 + amplitude * sum;
  }
};

inline RectifiedImage rectified_image(int height, int width, const std::function<double(double, double)>& grey,
                                      double noise = 0, unsigned seed = 1) {
  RectifiedImage image;
  image.value.resize(height, width);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.value.row(y)[x] = static_cast<float>(grey(x, y) + noise * normal(random));
  image.mask.assign(image.value.pixels.size(), 0);
  prepare({}, image);
  return image;
}

}  // namespace sgrt::testing
