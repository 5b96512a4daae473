// Sums by cell: a point costs 100 multiply-adds, however many control points there are. A cell is summed by one thread
// in the order of its points, and cells are put together in order: the same bits at any number of threads.
#include "nurbs/fit_system.hpp"

#include <array>
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

// Integrals of B_i^(r) B_k^(r), k - i = 0 ... 3, along one direction; wraps round where it is closed.
std::vector<std::array<double, 7>> gram_1d(int order, int cells, double h, bool periodic) {
  constexpr double kNode[4] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
  constexpr double kWeight[4] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
  double local[4][4] = {};
  for (int q = 0; q < 4; ++q) {
    double b[4];
    const double t = 0.5 + 0.5 * kNode[q];
    order == 0 ? cell_basis(t, b) : order == 1 ? cell_basis1(t, b) : cell_basis2(t, b);
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 4; ++k) local[i][k] += 0.5 * kWeight[q] * b[i] * b[k];
  }
  const double scale = order == 0 ? h : order == 1 ? 1 / h : 1 / (h * h * h);
  const int n = periodic ? cells : cells + 3;
  std::vector<std::array<double, 7>> g(static_cast<std::size_t>(n), std::array<double, 7>{});
  for (int c = 0; c < cells; ++c)
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 4; ++k) g[static_cast<std::size_t>((c + i) % n)][k - i + 3] += scale * local[i][k];
  return g;
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
    cell[k] = cell_of(at[k].v, grid.hv, grid.cells_v).cell * grid.cells_u + cell_of(at[k].u, grid.hu, grid.cells_u).cell;
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

Band bending_energy(const FitGrid& grid) {
  std::vector<std::array<double, 7>> gu[3], gv[3];
  for (int r = 0; r < 3; ++r) {
    gu[r] = gram_1d(r, grid.cells_u, grid.hu, grid.periodic);
    gv[r] = gram_1d(r, grid.cells_v, grid.hv, false);
  }
  Band p(grid.size(), grid.band_width());
  const int nu = grid.nu(), nv = grid.nv();
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      for (int dj = -3; dj <= 3; ++dj) {
        for (int di = -3; di <= 3; ++di) {
          const int jj = j + dj, ii = grid.periodic ? (i + di + nu) % nu : i + di;
          if (jj < 0 || jj >= nv || ii < 0 || ii >= nu) continue;
          const int a = grid.index(ii, jj), b = grid.index(i, j);
          if (a < b) continue;
          const auto energy = [&](int r, int s) { return gu[r][i][di + 3] * gv[s][j][dj + 3]; };
          p(a, b) += energy(2, 0) + 2 * energy(1, 1) + energy(0, 2);
        }
      }
    }
  }
  return p;
}

}  // namespace sgrt
