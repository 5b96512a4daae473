// The first guess: ZNCC over the whole search range on reduced images, left-right consistent. docs/theory/stereo.md eq.
// 4-5.
#pragma once

#include <cstdint>
#include <vector>

#include "core/image.hpp"
#include "core/run.hpp"

namespace sgrt {

struct CoarseOptions {
  int scale = 4;  // reduction
  int half = 4;   // window of 9 x 9 reduced pixels
  float min_correlation = 0.5F;
  double disparity_min, disparity_max;  // px of the rectified images
};

// A plane of disparities round a reduced pixel: d + a i + b j, px of the rectified images. d is NaN where there is
// none.
struct CoarseMatch {
  float d, a, b;
};

struct CoarseMap {
  int scale = 4, width = 0, height = 0;  // reduced pixel (x, y) covers full pixels scale x .. scale x + scale - 1
  std::vector<CoarseMatch> matches;

  std::vector<std::uint8_t> ambiguous;  // like matches: another place correlates nearly as well

  bool ambiguous_at(int x, int y) const { return ambiguous[static_cast<std::size_t>(y / scale) * width + x / scale]; }
  const CoarseMatch& at_pixel(int x, int y) const {
    return matches[static_cast<std::size_t>(y / scale) * width + x / scale];
  }
};

// Buffers kept from frame to frame.
struct CoarseWork {
  Image left, right, left_mean, left_norm, right_mean, right_norm;
  std::vector<float> best_left, second_left, disparity_left, best_right;
  std::vector<int> disparity_right;
  std::vector<float> consistent;  // disparity after the left-right check, NaN else
  std::vector<float> scratch;     // one slice a block
  std::vector<double> sum, square;
  std::vector<int> bad;
};

void coarse_match(const Run& run, const Image& left, const std::vector<std::uint8_t>& left_mask, const Image& right,
                  const std::vector<std::uint8_t>& right_mask, const CoarseOptions& options, CoarseWork& work,
                  CoarseMap& map);

}  // namespace sgrt
