// Closed triangle mesh between the inside and the outside of a lattice. Marching cubes (Lorensen and Cline 1987) with
// the rule that on a face with two inside corners across a diagonal those are kept apart: both cubes of a face decide
// alike, so the mesh is closed and each edge has two triangles (Nielson and Hamann 1991). docs/theory/volume.md eq. 1.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

// A lattice edge that the surface cuts: from an inside node to its outside neighbour along `axis` (the direction by
// `step`, +1 or -1). The outside neighbour may lie beyond the lattice.
struct CutEdge {
  std::int32_t x, y, z;
  std::int8_t axis, step;
};

struct LatticeMesh {
  std::vector<CutEdge> cuts;  // a vertex each
  Faces faces;                // counter-clockwise seen from outside in a right-handed frame of x, y, z
};

// slice(z, inside): writes ny x nx bytes, 1 inside. All beyond the lattice is outside.
using LatticeSlice = std::function<void(int z, std::uint8_t* inside)>;
LatticeMesh mesh_of_lattice(const Run& run, int nx, int ny, int nz, const LatticeSlice& slice);

// Triangles of each of the 256 cases as cube edges, three a triangle; edge = 4 * axis + (the base corner's bits of the
// two other axes, the next axis first). Corner = x + 2 y + 4 z. For the tests.
std::array<std::vector<std::int8_t>, 256> marching_cubes_cases();

}  // namespace sgrt
