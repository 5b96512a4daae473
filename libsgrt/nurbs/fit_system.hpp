// The normal equations of the fit: points sorted by cell, weighted sums of each cell, the bending energy, and the band
// matrix they make. docs/theory/nurbs_fit.md eq. 5-8.
#pragma once

#include <cstdint>
#include <vector>

#include "nurbs/fit.hpp"
#include "nurbs/fit_band.hpp"

namespace sgrt {

// Points in the order of their cells (u fastest), so that a cell's sums stay in registers.
struct FitPoints {
  int columns = 1;
  std::vector<std::int64_t> cell_begin;  // cells + 1
  std::vector<std::int64_t> row;         // of the surface
  std::vector<double> tu, tv;            // place in the cell
  std::vector<double> y[3];              // what is fitted, less the trend, mm
  std::vector<double> precision;         // 1 / variance of y at w = 1; of one sample shared by correlation_points
  std::vector<double> weight;            // precision x geometry x robust weight: what the sums take

  std::int64_t size() const { return static_cast<std::int64_t>(row.size()); }
};

// Sums of a cell: with U = bu bu^T and V = bv bv^T, sum w U V has 10 x 10 different entries.
struct CellSums {
  double gram[10][10];
  double right[3][16];
};
struct Sums {
  std::vector<CellSums> cells;
  double yy = 0;      // sum w y^2, all columns
  double weight = 0;  // sum w
};

// The data's part of the normal equations: X^T W X and X^T W y.
struct Normal {
  Band gram;
  Eigen::MatrixXd right;
  double yy = 0;
};

FitPoints sort_points(const Run& run, const FitGrid& grid, int columns, const std::vector<std::int64_t>& row,
                      const std::vector<ChartPoint>& at, const Points* xyz, const std::vector<double>& precision);

Normal normal_equations(const Run& run, const FitGrid& grid, const FitPoints& points);

// The integral of f_uu^2 + 2 f_uv^2 + f_vv^2 over one cell as a form in its 16 coefficients; 0 for planes.
using CellEnergy = Eigen::Matrix<double, 16, 16>;
CellEnergy cell_energy(const FitGrid& grid);

// The same over the chart, each cell times its stiffness.
Band bending_energy(const FitGrid& grid, const std::vector<double>& stiffness);

// The 16 coefficients of a cell, u fastest.
void cell_indices(const FitGrid& grid, std::int64_t cell, int* indices);

// Blocks of cells for the threads: fixed, whatever their number.
constexpr std::int64_t kCellBlock = 64;

}  // namespace sgrt
