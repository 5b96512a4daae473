// Targets: a chessboard's inner corners or an asymmetric grid of circles, and finding one in an image.
// docs/theory/calibration.md, "Detection".
#pragma once

#include <string>
#include <vector>

#include "core/geometry.hpp"
#include "core/image.hpp"
#include "core/run.hpp"

namespace sgrt {

enum class BoardKind { kChessboard = 1, kCircles = 2 };

struct Board {
  BoardKind kind = BoardKind::kChessboard;
  int columns = 0, rows = 0;  // inner corners; circles a row, and rows
  double spacing_mm = 0;  // side of a square; of circles: half the distance of neighbours in a row, as OpenCV has it
};

// Throws kInvalidArgument: sides below 3 or above 100, spacing not positive.
void check_board(const Board& board);

// Row by row, z = 0: chessboard (j, i) spacing; circles (2 j + i mod 2, i) spacing.
Points board_points(const Board& board);

// Turned by half a turn it looks the same, so that an image does not tell which of its ends comes first.
bool half_turn_ambiguous(const Board& board);

struct Detection {
  bool found = false;
  std::string why;         // where it was not found: what was seen
  std::vector<int> index;  // of the points found, in the board's order
  std::vector<Vec2> pixel;
  std::vector<double> sigma_px;  // of each coordinate, from the image's noise
  int seen_columns = 0, seen_rows = 0;
};

// The whole board must be in the image; single points of it may be hidden. The time is bounded by the image's size.
Detection detect_board(const Run& run, const Board& board, const ImageView& image);

}  // namespace sgrt
