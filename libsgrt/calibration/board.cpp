// Targets, see calibration/board.hpp.
#include "calibration/board.hpp"

#include "core/error.hpp"

namespace sgrt {

void check_board(const Board& board) {
  const auto side = [](const char* name, int value) {
    if (value < 3 || value > 100)
      fail(Status::kInvalidArgument, std::string(name) + ": " + std::to_string(value) + ", expected 3 to 100");
  };
  if (board.kind != BoardKind::kChessboard && board.kind != BoardKind::kCircles)
    fail(Status::kInvalidArgument, "board.kind: " + std::to_string(static_cast<int>(board.kind)) + ", expected 1 or 2");
  side("board.columns", board.columns);
  side("board.rows", board.rows);
  if (!(board.spacing_mm > 0 && board.spacing_mm <= 1000))
    fail(Status::kInvalidArgument,
         "board.spacing_mm: " + text_of(board.spacing_mm) + ", expected more than 0, at most 1000 mm");
}

Points board_points(const Board& board) {
  Points points(board.columns * board.rows, 3);
  const bool circles = board.kind == BoardKind::kCircles;
  for (int i = 0; i < board.rows; ++i) {
    for (int j = 0; j < board.columns; ++j)
      points.row(i * board.columns + j) << (circles ? 2 * j + i % 2 : j) * board.spacing_mm, i * board.spacing_mm, 0;
  }
  return points;
}

bool half_turn_ambiguous(const Board& board) {
  return board.kind == BoardKind::kCircles ? board.rows % 2 == 0 : (board.columns + board.rows) % 2 == 0;
}

}  // namespace sgrt
