// Points of a surface sorted into cubic cells, so that the neighbours of a place lie in a few runs of memory. Points
// without a normal and second points at one place are left out.
#pragma once

#include <cstdint>
#include <vector>

#include "core/surface.hpp"
#include "shape/kernels.hpp"

namespace sgrt {

// A point whose outward side is known.
inline bool oriented(const Surface& s, std::int64_t i) {
  return s.present(i) && s.normals(i, 0) == s.normals(i, 0);
}

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

  // Calls f(begin, end) for the runs of points in the cells that the ball about p meets.
  template <class F>
  void each_run(const Vec3& p, double radius, F&& f) const {
    std::int64_t from[3], to[3];
    for (int k = 0; k < 3; ++k) {
      from[k] = axis_cell(k, p[k] - radius);
      to[k] = axis_cell(k, p[k] + radius);
    }
    for (std::int64_t k = from[2]; k <= to[2]; ++k) {
      for (std::int64_t j = from[1]; j <= to[1]; ++j) {
        const std::int64_t cell = (k * count[1] + j) * count[0];
        f(begin[static_cast<std::size_t>(cell + from[0])], begin[static_cast<std::size_t>(cell + to[0] + 1)]);
      }
    }
  }
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

}  // namespace sgrt
