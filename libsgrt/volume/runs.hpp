// A mask over a volume as runs of voxels along x: a body of 50 million voxels is some hundred thousand runs, so that
// components, erosion and dilation cost milliseconds and the memory of a picture. docs/theory/volume.md.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/eigen.hpp"
#include "core/run.hpp"

namespace sgrt {

struct Span {
  int begin, end;  // voxels [begin, end) of a row
};
using RowSpans = std::vector<Span>;  // ascending, apart by at least one voxel

// rows[z * ny + y]
struct Runs {
  int nx = 0, ny = 0, nz = 0;
  std::vector<RowSpans> rows;

  Runs() = default;
  Runs(int x, int y, int z) : nx(x), ny(y), nz(z), rows(static_cast<std::size_t>(y) * static_cast<std::size_t>(z)) {}
  RowSpans& row(int y, int z) { return rows[static_cast<std::size_t>(z) * ny + y]; }
  const RowSpans& row(int y, int z) const { return rows[static_cast<std::size_t>(z) * ny + y]; }
  bool inside(int x, int y, int z) const;
  std::int64_t count() const;
};

void intersect(const RowSpans& a, const RowSpans& b, RowSpans& out);  // appends
Runs intersect(const Run& run, const Runs& a, const Runs& b);
Runs complement(const Run& run, const Runs& a);
// By a ball of radius_mm. Beyond the volume lies what `outside` says.
Runs dilate(const Run& run, const Runs& mask, double radius_mm, const Vec3& spacing_mm);
Runs erode(const Run& run, const Runs& mask, double radius_mm, const Vec3& spacing_mm, bool outside);

// The largest component over faces (6 neighbours); empty for an empty mask.
Runs largest_component(const Runs& mask);
// The components that hold a voxel for which `seed` is true of one of their spans.
Runs components_with(const Runs& mask, const std::function<bool(const Span&, int y, int z)>& seed);

}  // namespace sgrt
