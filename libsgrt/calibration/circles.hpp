// Dark discs in an image, and an asymmetric grid of them. docs/theory/calibration.md, "Detection".
#pragma once

#include "calibration/board.hpp"

namespace sgrt {

// A disc seen as an ellipse: its centre by the darkness-weighted centroid, and its second moments.
struct Disc {
  Vec2 at;
  Eigen::Matrix2d moments;  // px2; of a full ellipse: a quarter of its half axes squared
  double area = 0, sigma_px = 0, contrast = 0;
};

// Dark discs on a brighter ground, by their place: row, then column.
std::vector<Disc> find_discs(const Image& image);

Detection detect_circles(const Run& run, const Board& board, const Image& image);

}  // namespace sgrt
