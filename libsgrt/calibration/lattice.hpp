// Points of an image as a square lattice: integer coordinates that grow from a seed, step by step. It follows
// perspective and lens distortion, because a step is predicted from its neighbours only.
#pragma once

#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "calibration/saddle.hpp"

namespace sgrt {

using Cell = std::pair<int, int>;     // steps along both axes
using Lattice = std::map<Cell, int>;  // the point at each

struct Extent {
  int i0 = 0, j0 = 0, columns = 0, rows = 0;
};
Extent extent_of(const Lattice& lattice);

// Without its outer lines of which less than half is there, the emptiest first: what grew beyond the board.
Lattice trimmed(const Lattice& lattice);

// The largest lattice of corners that share edges: the neighbour along a corner's falling edge has its rising edge
// there. At most `enough` corners are looked for.
Lattice grow_chessboard(const std::vector<Saddle>& saddles, std::size_t enough);

// The lattice that grows from `seed` with these two steps; points lie within a third of a step of where they are
// expected.
Lattice grow_points(const std::vector<Vec2>& points, int seed, const Vec2& a, const Vec2& b, std::size_t most);

// Without the points that lie off where their neighbours' steps expect them, the worst first, and without what then
// hangs on nothing.
Lattice cleaned(const Lattice& lattice, const std::function<Vec2(int)>& at);

// Where a cell should lie by its neighbours' steps; NaN where none tells.
Vec2 predicted(const Lattice& lattice, const Cell& cell, const std::function<Vec2(int)>& at);

}  // namespace sgrt
