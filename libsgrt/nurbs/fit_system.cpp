// Sums by cell: a point costs 100 multiply-adds, however many control points there are. A cell is summed by one thread
// in the order of its points, and cells are put together in order: the same bits at any number of threads.
#include "nurbs/fit_system.hpp"

#include <cstring>

#include "core/parallel.hpp"
#include "nurbs/fit_cells.hpp"

namespace sgrt {
namespace {

// Where (a, b) of a symmetric 4 x 4 stands among its 10 entries.
constexpr int kPair[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};

void pairs(const double* b, double* p) {
  for (int i = 0, k = 0; i < 4; ++i)
    for (int j = i; j < 4; ++j) p[k++] = b[i] * b[j];
}

void sum_cell(const FitPoints& p, std::int64_t begin, std::int64_t end, CellSums& sums) {
  CellSums s;
  std::memset(&s, 0, sizeof s);
  for (std::int64_t k = begin; k < end; ++k) {
    const double w = p.weight[k];
    if (w == 0) continue;
    double bu[4], bv[4], pu[10], pv[10];
    cell_basis(p.tu[k], bu);
    cell_basis(p.tv[k], bv);
    pairs(bu, pu);
    pairs(bv, pv);
    for (int i = 0; i < 10; ++i) {
      const double f = w * pv[i];
      for (int j = 0; j < 10; ++j) s.gram[i][j] += f * pu[j];
    }
    for (int d = 0; d < p.columns; ++d) {
      const double wy = w * p.y[d][k];
      for (int i = 0; i < 4; ++i) {
        const double f = wy * bv[i];
        for (int j = 0; j < 4; ++j) s.right[d][4 * i + j] += f * bu[j];
      }
    }
  }
  sums = s;
}

void add_cell(const FitGrid& grid, const CellSums& sums, std::int64_t cell, int columns, Normal& n) {
  int at[16];
  cell_indices(grid, cell, at);
  for (int a = 0; a < 16; ++a) {
    for (int b = 0; b < 16; ++b)
      if (at[a] >= at[b]) n.gram(at[a], at[b]) += sums.gram[kPair[a / 4][b / 4]][kPair[a % 4][b % 4]];
    for (int d = 0; d < columns; ++d) n.right(at[a], d) += sums.right[d][a];
  }
}

// Integrals over a cell of side h of B_i^(r) B_k^(r), by four Gauss points: exact to degree 7.
Eigen::Matrix4d gram_1d(int order, double h) {
  constexpr double kNode[4] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
  constexpr double kWeight[4] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
  Eigen::Matrix4d g = Eigen::Matrix4d::Zero();
  for (int q = 0; q < 4; ++q) {
    Eigen::Vector4d b;
    const double t = 0.5 + 0.5 * kNode[q];
    order == 0 ? cell_basis(t, b.data()) : order == 1 ? cell_basis1(t, b.data()) : cell_basis2(t, b.data());
    g += 0.5 * kWeight[q] * b * b.transpose();
  }
  return g * (order == 0 ? h : order == 1 ? 1 / h : 1 / (h * h * h));
}

}  // namespace

void cell_indices(const FitGrid& grid, std::int64_t cell, int* indices) {
  const int cu = static_cast<int>(cell % grid.cells_u), cv = static_cast<int>(cell / grid.cells_u);
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) indices[4 * j + i] = grid.index(cu + i, cv + j);
}

FitPoints sort_points(const Run& run, const FitGrid& grid, int columns, const std::vector<std::int64_t>& row,
                      const std::vector<ChartPoint>& at, const Points* xyz, const std::vector<double>& precision) {
  run.poll(0, "sorting");
  const std::size_t n = row.size(), cells = static_cast<std::size_t>(grid.cells_u) * grid.cells_v;
  std::vector<std::int32_t> cell(n);
  FitPoints p;
  p.columns = columns;
  p.cell_begin.assign(cells + 1, 0);
  for (std::size_t k = 0; k < n; ++k) {
    cell[k] =
        cell_of(at[k].v, grid.hv, grid.cells_v).cell * grid.cells_u + cell_of(at[k].u, grid.hu, grid.cells_u).cell;
    ++p.cell_begin[static_cast<std::size_t>(cell[k]) + 1];
  }
  for (std::size_t c = 0; c < cells; ++c) p.cell_begin[c + 1] += p.cell_begin[c];
  for (auto* v : {&p.tu, &p.tv, &p.precision, &p.weight}) v->resize(n);
  for (int d = 0; d < columns; ++d) p.y[d].resize(n);
  p.row.resize(n);
  std::vector<std::int64_t> next(p.cell_begin.begin(), p.cell_begin.end() - 1);
  for (std::size_t k = 0; k < n; ++k) {
    const auto to = static_cast<std::size_t>(next[static_cast<std::size_t>(cell[k])]++);
    p.row[to] = row[k];
    p.tu[to] = cell_of(at[k].u, grid.hu, grid.cells_u).t;
    p.tv[to] = cell_of(at[k].v, grid.hv, grid.cells_v).t;
    p.precision[to] = p.weight[to] = precision[k];
    if (columns == 1) p.y[0][to] = at[k].f;
    for (int d = 0; columns == 3 && d < 3; ++d) p.y[d][to] = (*xyz)(row[k], d);
  }
  return p;
}

Normal normal_equations(const Run& run, const FitGrid& grid, const FitPoints& p) {
  const auto cells = static_cast<std::int64_t>(p.cell_begin.size()) - 1;
  std::vector<CellSums> sums(static_cast<std::size_t>(cells));
  parallel_for(
      run, cells, kCellBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t c = begin; c < end; ++c) sum_cell(p, p.cell_begin[c], p.cell_begin[c + 1], sums[c]);
      },
      "summing");
  Normal n{Band(grid.size(), grid.band_width()), Eigen::MatrixXd::Zero(grid.size(), p.columns), 0};
  for (std::int64_t c = 0; c < cells; ++c) add_cell(grid, sums[c], c, p.columns, n);
  for (int d = 0; d < p.columns; ++d)
    for (std::int64_t k = 0; k < p.size(); ++k) n.yy += p.weight[k] * p.y[d][k] * p.y[d][k];
  return n;
}

CellEnergy cell_energy(const FitGrid& grid) {
  Eigen::Matrix4d u[3], v[3];
  for (int r = 0; r < 3; ++r) u[r] = gram_1d(r, grid.hu), v[r] = gram_1d(r, grid.hv);
  CellEnergy e;
  for (int a = 0; a < 16; ++a) {
    for (int b = 0; b < 16; ++b) {
      const auto part = [&](int r, int s) { return u[r](a % 4, b % 4) * v[s](a / 4, b / 4); };
      e(a, b) = part(2, 0) + 2 * part(1, 1) + part(0, 2);
    }
  }
  return e;
}

Band bending_energy(const FitGrid& grid, const std::vector<double>& stiffness) {
  const CellEnergy e = cell_energy(grid);
  Band p(grid.size(), grid.band_width());
  for (std::size_t c = 0; c < stiffness.size(); ++c) {
    int at[16];
    cell_indices(grid, static_cast<std::int64_t>(c), at);
    for (int a = 0; a < 16; ++a)
      for (int b = 0; b < 16; ++b)
        if (at[a] >= at[b]) p(at[a], at[b]) += stiffness[c] * e(a, b);
  }
  return p;
}

}  // namespace sgrt
