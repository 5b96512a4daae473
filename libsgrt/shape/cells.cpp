// Counting sort of points into cells.
#include "shape/cells.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sgrt {
namespace {

constexpr double kCellsPerPoint = 24;
constexpr double kNodeCell = 3.5;  // cells of the finest level over the spacing: one node each

// The box leaves out a few far points, which count to the cells at its border.
void lay_cells(const Surface& surface, const std::vector<std::int32_t>& rows, SkinCells& c) {
  Vec3 high;
  const std::size_t step = std::max<std::size_t>(1, rows.size() / 4000);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> v;
    v.reserve(rows.size() / step + 1);
    for (std::size_t i = 0; i < rows.size(); i += step) v.push_back(surface.points(rows[i], axis));
    std::sort(v.begin(), v.end());
    const std::size_t cut = v.size() / 200;
    const double a = v[cut], b = v[v.size() - 1 - cut];
    c.low[axis] = a - 0.1 * (b - a);
    high[axis] = b + 0.1 * (b - a);
  }
  const double most = kCellsPerPoint * static_cast<double>(rows.size()) + 4096;
  const auto side = [&](int axis) { return std::floor((high[axis] - c.low[axis]) / c.size) + 1; };
  while (!(side(0) * side(1) * side(2) <= most)) c.size *= 1.3;
  for (int axis = 0; axis < 3; ++axis) c.count[axis] = static_cast<std::int64_t>(side(axis));
}

// The rows in the order of their cells, whose begins are set.
std::vector<std::int32_t> sorted_by_cell(const Surface& surface, const std::vector<std::int32_t>& rows, SkinCells& c) {
  std::vector<std::int32_t> at(rows.size());
  c.begin.assign(static_cast<std::size_t>(c.count[0] * c.count[1] * c.count[2]) + 1, 0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    at[i] = static_cast<std::int32_t>(c.cell_of(surface.point(rows[i])));
    ++c.begin[static_cast<std::size_t>(at[i]) + 1];
  }
  std::partial_sum(c.begin.begin(), c.begin.end(), c.begin.begin());
  std::vector<std::int64_t> next(c.begin.begin(), c.begin.end() - 1);
  std::vector<std::int32_t> sorted(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    sorted[static_cast<std::size_t>(next[static_cast<std::size_t>(at[i])]++)] = rows[i];
  return sorted;
}

// Within a cell by place, so that second points at one place are found and left out.
void keep_places(const Surface& surface, std::vector<std::int32_t> sorted, SkinCells& c) {
  const auto before = [&](std::int32_t a, std::int32_t b) {
    for (int k = 0; k < 3; ++k) {
      if (surface.points(a, k) != surface.points(b, k)) return surface.points(a, k) < surface.points(b, k);
    }
    return a < b;
  };
  c.row.reserve(sorted.size());
  for (std::size_t k = 0; k + 1 < c.begin.size(); ++k) {
    const auto first = sorted.begin() + static_cast<std::ptrdiff_t>(c.begin[k]);
    const auto last = sorted.begin() + static_cast<std::ptrdiff_t>(c.begin[k + 1]);
    std::sort(first, last, before);
    c.begin[k] = static_cast<std::int64_t>(c.row.size());
    for (auto i = first; i != last; ++i) {
      if (i != first && surface.points.row(*i) == surface.points.row(*(i - 1))) {
        ++c.duplicates;
      } else {
        c.row.push_back(*i);
      }
    }
  }
  c.begin.back() = static_cast<std::int64_t>(c.row.size());
}

}  // namespace

std::int64_t SkinCells::axis_cell(int axis, double value) const {
  const double at = std::floor((value - low[axis]) / size);
  if (!(at > 0)) return 0;
  return at >= static_cast<double>(count[axis]) ? count[axis] - 1 : static_cast<std::int64_t>(at);
}

std::int64_t SkinCells::cell_of(const Vec3& p) const {
  return (axis_cell(2, p[2]) * count[1] + axis_cell(1, p[1])) * count[0] + axis_cell(0, p[0]);
}

SkinCells make_skin_cells(const Surface& surface, double size) {
  SkinCells c;
  c.size = size;
  std::vector<std::int32_t> rows;
  rows.reserve(static_cast<std::size_t>(surface.size()));
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (oriented(surface, i)) rows.push_back(static_cast<std::int32_t>(i));
  }
  if (rows.empty()) {
    c.begin = {0, 0};
  } else {
    lay_cells(surface, rows, c);
    keep_places(surface, sorted_by_cell(surface, rows, c), c);
  }
  const std::size_t n = c.row.size() + 4;
  for (auto* v : {&c.x, &c.y, &c.z, &c.nx, &c.ny, &c.nz, &c.weight}) v->assign(n, 0);
  for (std::size_t i = 0; i < c.row.size(); ++i) {
    const Vec3 p = surface.point(c.row[i]), m = surface.normal(c.row[i]);
    c.x[i] = p[0], c.y[i] = p[1], c.z[i] = p[2];
    c.nx[i] = m[0], c.ny[i] = m[1], c.nz[i] = m[2];
    c.weight[i] = 1;
  }
  return c;
}

namespace {

// Means of the points of each cell.
Surface thinned(const SkinCells& fine, std::vector<double>* weight) {
  Surface s;
  std::vector<double> rows;
  rows.reserve(6 * fine.row.size());
  for (std::size_t cell = 0; cell + 1 < fine.begin.size(); ++cell) {
    Vec3 x = Vec3::Zero(), n = Vec3::Zero();
    double sum = 0;
    for (std::int64_t i = fine.begin[cell]; i < fine.begin[cell + 1]; ++i) {
      const auto k = static_cast<std::size_t>(i);
      x += fine.weight[k] * Vec3(fine.x[k], fine.y[k], fine.z[k]);
      n += fine.weight[k] * Vec3(fine.nx[k], fine.ny[k], fine.nz[k]);
      sum += fine.weight[k];
    }
    if (!(n.norm() > 0.3 * sum)) continue;  // two sheets back to back
    x /= sum;
    n.normalize();
    rows.insert(rows.end(), {x[0], x[1], x[2], n[0], n[1], n[2]});
    weight->push_back(sum);
  }
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>> all(
      rows.data(), static_cast<Eigen::Index>(weight->size()), 6);
  s.points = all.leftCols<3>();
  s.normals = all.rightCols<3>();
  return s;
}

}  // namespace

Pyramid make_pyramid(const Surface& surface, double spacing) {
  constexpr double kSide = 2, kWide = 3.5,
                   kBox = 2;  // of a cube over the spacing; of a disc, and of a cell, over a cube
  Pyramid p;
  p.levels.push_back(make_skin_cells(surface, kNodeCell * spacing));
  p.least_radius.push_back(0);
  double side = kSide * spacing;
  for (int k = 0; k < 5 && p.levels.back().size_of() > 200; ++k, side *= 2) {
    std::vector<double> weight;
    Surface all;
    const SkinCells& fine = p.levels.back();
    // The level below, sorted anew into cubes.
    all.points.resize(fine.size_of(), 3);
    all.normals.resize(fine.size_of(), 3);
    for (std::int64_t i = 0; i < fine.size_of(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      all.points.row(i) << fine.x[at], fine.y[at], fine.z[at];
      all.normals.row(i) << fine.nx[at], fine.ny[at], fine.nz[at];
    }
    SkinCells cubes = make_skin_cells(all, side);
    if (cubes.size > 1.01 * side) break;  // spread too wide
    for (std::size_t i = 0; i < cubes.row.size(); ++i)
      cubes.weight[i] = fine.weight[static_cast<std::size_t>(cubes.row[i])];
    const Surface means = thinned(cubes, &weight);
    if (means.size() < 50) break;
    SkinCells level = make_skin_cells(means, kBox * side);
    for (std::size_t i = 0; i < level.row.size(); ++i) level.weight[i] = weight[static_cast<std::size_t>(level.row[i])];
    p.levels.push_back(std::move(level));
    p.least_radius.push_back(kWide * side);
  }
  return p;
}

}  // namespace sgrt
