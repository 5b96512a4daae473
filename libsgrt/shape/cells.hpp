// Points of a surface sorted into cubic cells, so that the neighbours of a place lie in a few runs of memory. Points
// without a normal and second points at one place are left out.
#pragma once

#include <cstdint>
#include <vector>

#include "core/surface.hpp"
#include "shape/kernels.hpp"

namespace sgrt {

struct Cells {
  double size = 0;  // mm, of a cell
  Vec3 low = Vec3::Zero();
  std::int64_t count[3] = {1, 1, 1};
  std::vector<std::int64_t> begin;  // of a cell's points, x fastest; one more at the end
  std::vector<std::int32_t> row;    // of the surface, of each point in order
  std::vector<double> x, y, z, nx, ny, nz;
  std::int64_t duplicates = 0;

  std::int64_t size_of() const { return static_cast<std::int64_t>(row.size()); }
  kernels::Sheet sheet() const { return {x.data(), y.data(), z.data(), nx.data(), ny.data(), nz.data()}; }
  std::int64_t axis_cell(int axis, double value) const;  // places beyond the box count to its border
  std::int64_t cell_of(const Vec3& p) const;
};

// The surface must have normals. size: a wish; larger where the surface is spread too wide for it.
Cells make_cells(const Surface& surface, double size);

// The area that a point stands for, as a length: the median over the surface. NaN where it has fewer than 3 points.
double spacing_of(const Surface& surface);

}  // namespace sgrt
