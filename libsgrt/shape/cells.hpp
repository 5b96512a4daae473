// Points of a surface sorted into cubic cells, so that the neighbours of a place lie in a few runs of memory. Points
// without a normal and second points at one place are left out.
#pragma once

#include <cstdint>
#include <vector>

#include "core/surface.hpp"
#include "shape/kernels.hpp"

namespace sgrt {

struct SkinCells {
  double size = 0;  // mm, of a cell
  Vec3 low = Vec3::Zero();
  std::int64_t count[3] = {1, 1, 1};
  std::vector<std::int64_t> begin;  // of a cell's points, x fastest; one more at the end
  std::vector<std::int32_t> row;    // of the surface, of each point in order
  std::vector<double> x, y, z, nx, ny, nz, weight;
  std::int64_t duplicates = 0;

  std::int64_t size_of() const { return static_cast<std::int64_t>(row.size()); }
  kernels::Sheet sheet() const {
    return {x.data(), y.data(), z.data(), nx.data(), ny.data(), nz.data(), weight.data()};
  }
  std::int64_t axis_cell(int axis, double value) const;  // places beyond the box count to its border
  std::int64_t cell_of(const Vec3& p) const;
};

// The same surface at several levels of detail: one point in place of each that share a small cube, which changes
// neither the curvature of a fit over a disc that is wide against the cube nor what it knows of its noise.
struct Pyramid {
  std::vector<SkinCells> levels;
  std::vector<double> least_radius;  // mm, from which a level will do
};

// The surface must have normals. size: a wish; larger where the surface is spread too wide for it.
SkinCells make_skin_cells(const Surface& surface, double size);
Pyramid make_pyramid(const Surface& surface, double spacing);

// The area that a point stands for, as a length: the median over the surface. NaN where it has fewer than 3 points.
double spacing_of(const Surface& surface);

}  // namespace sgrt
