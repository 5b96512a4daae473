// Cubic B-splines on equal cells: four polynomials, the same in each cell. The fit works on these; the surface that it
// returns is on clamped knots and spans the same splines. docs/theory/nurbs_fit.md eq. 5.
#pragma once

#include <algorithm>

#include "nurbs/fit.hpp"

namespace sgrt {

// Of the functions 0 ... 3 that live in a cell, at t in [0, 1] of it.
inline void cell_basis(double t, double* b) {
  const double s = 1 - t, t2 = t * t, s2 = s * s;
  b[0] = s * s2 * (1.0 / 6);
  b[1] = (4 - 6 * t2 + 3 * t * t2) * (1.0 / 6);
  b[2] = (4 - 6 * s2 + 3 * s * s2) * (1.0 / 6);
  b[3] = t * t2 * (1.0 / 6);
}
// d/dt of it.
inline void cell_basis1(double t, double* b) {
  const double s = 1 - t;
  b[0] = -0.5 * s * s;
  b[1] = t * (1.5 * t - 2);
  b[2] = s * (2 - 1.5 * s);
  b[3] = 0.5 * t * t;
}
inline void cell_basis2(double t, double* b) {
  b[0] = 1 - t;
  b[1] = 3 * t - 2;
  b[2] = 1 - 3 * t;
  b[3] = t;
}

// f(i, j) for a cell and the up to eight about it.
template <class F>
void for_neighbours(const FitGrid& g, int i, int j, F&& f) {
  for (int y = std::max(0, j - 1); y <= std::min(g.cells_v - 1, j + 1); ++y) {
    for (int x = i - 1; x <= i + 1; ++x) {
      const int k = g.periodic ? (x + g.cells_u) % g.cells_u : x;
      if (k >= 0 && k < g.cells_u) f(k, y);
    }
  }
}

// The cell of x in mm from 0 and where in it; x outside belongs to the cell at the end.
struct CellPlace {
  int cell;
  double t;
};
inline CellPlace cell_of(double x, double h, int cells) {
  const double scaled = x / h;
  const int cell = scaled > 0 ? (scaled < cells ? static_cast<int>(scaled) : cells - 1) : 0;
  return {cell, scaled - cell};
}

}  // namespace sgrt
