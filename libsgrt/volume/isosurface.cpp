// Marching cubes over a lattice of inside and outside nodes. The 256 cases are derived from the face rule instead of
// being listed. docs/theory/volume.md eq. 1.
#include "volume/isosurface.hpp"

#include <algorithm>
#include <utility>

#include "core/error.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr int kSlabs = 4;  // slabs a block of work

int edge_between(int corner_a, int corner_b) {
  const int axis = (corner_a ^ corner_b) == 1 ? 0 : (corner_a ^ corner_b) == 2 ? 1 : 2;
  const int base = corner_a & corner_b, b = (axis + 1) % 3, c = (axis + 2) % 3;
  return 4 * axis + ((base >> b) & 1) + 2 * ((base >> c) & 1);
}

// The corners of each face, counter-clockwise seen from outside the cube.
std::array<std::array<int, 4>, 6> cube_faces() {
  std::array<std::array<int, 4>, 6> faces{};
  for (int axis = 0; axis < 3; ++axis) {
    const int a = 1 << axis, b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3;
    faces[static_cast<std::size_t>(2 * axis)] = {0, c, b + c, b};
    faces[static_cast<std::size_t>(2 * axis + 1)] = {a, a + b, a + b + c, a + c};
  }
  return faces;
}

// next[e]: the edge that follows e on the loop round the inside corners; -1 for an edge that is not cut. On each face,
// round each run of inside corners, the surface goes from where the run is entered to where it is left.
std::array<int, 12> loops_of(int inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : cube_faces()) {
    const auto in = [&](int i) { return (inside >> face[static_cast<std::size_t>(i & 3)]) & 1; };
    const auto edge = [&](int i) {
      return edge_between(face[static_cast<std::size_t>(i & 3)], face[static_cast<std::size_t>((i + 1) & 3)]);
    };
    for (int i = 0; i < 4; ++i) {
      if (in(i) || !in(i + 1)) continue;  // the run is entered on the edge from corner i to i + 1
      int last = i + 1;
      while (in(last + 1)) ++last;
      next[static_cast<std::size_t>(edge(i))] = edge(last);
    }
  }
  return next;
}

// A padded slice: one node of outside all round.
struct Slice {
  int nx, ny;
  std::vector<std::uint8_t> plain, inside;
  Slice(int x, int y)
      : nx(x),
        ny(y),
        plain(static_cast<std::size_t>(x) * static_cast<std::size_t>(y)),
        inside(static_cast<std::size_t>(x + 2) * static_cast<std::size_t>(y + 2), 0) {}
  std::size_t width() const { return static_cast<std::size_t>(nx) + 2; }
  void load(const LatticeSlice& slice, int z, int nz) {
    if (z < 0 || z >= nz) return std::fill(inside.begin(), inside.end(), std::uint8_t{0});
    slice(z, plain.data());
    for (int y = 0; y < ny; ++y) {
      const auto from = plain.begin() + static_cast<std::ptrdiff_t>(y) * nx;
      std::copy(from, from + nx, inside.begin() + static_cast<std::ptrdiff_t>((y + 1) * width() + 1));
    }
  }
};

// The cut edges of the slab from slice z to z + 1: those within slice z, and those between the two. In order of node
// and axis, which the second pass walks again.
void cut_edges(const Slice& low, const Slice& high, int z, std::vector<CutEdge>& cuts) {
  const std::size_t w = low.width(), n = low.inside.size();
  const std::size_t offset[3] = {1, w, 0};
  for (std::size_t i = 0; i < n; ++i) {
    const int here = low.inside[i];
    for (std::int8_t axis = 0; axis < 3; ++axis) {
      if (axis < 2 && i + offset[axis] >= n) continue;
      const int there = axis < 2 ? low.inside[i + offset[axis]] : high.inside[i];
      if (here == there) continue;
      CutEdge e{static_cast<std::int32_t>(i % w) - 1, static_cast<std::int32_t>(i / w) - 1, z, axis,
                static_cast<std::int8_t>(here ? 1 : -1)};
      if (!here) (axis == 0 ? e.x : axis == 1 ? e.y : e.z) += 1;
      cuts.push_back(e);
    }
  }
}

// Vertex numbers of a slab's cut edges, by padded node and axis.
struct EdgeMap {
  std::vector<std::int32_t> vertex;
  explicit EdgeMap(std::size_t nodes) : vertex(3 * nodes) {}
  void load(const std::vector<CutEdge>& cuts, std::int32_t first, std::size_t width) {
    for (const CutEdge& e : cuts) {
      const int back = e.step < 0 ? 1 : 0;  // the edge's base node
      const std::size_t x = static_cast<std::size_t>(e.x + 1 - (e.axis == 0 ? back : 0));
      const std::size_t y = static_cast<std::size_t>(e.y + 1 - (e.axis == 1 ? back : 0));
      vertex[3 * (y * width + x) + static_cast<std::size_t>(e.axis)] = first++;
    }
  }
};

using Cases = std::array<std::vector<std::int8_t>, 256>;

void triangles(const Slice& low, const Slice& high, const EdgeMap& here, const EdgeMap& above, const Cases& cases,
               std::vector<std::int32_t>& out) {
  const std::size_t w = low.width(), rows = low.inside.size() / w;
  for (std::size_t y = 0; y + 1 < rows; ++y) {
    const std::uint8_t *a = &low.inside[y * w], *b = a + w, *c = &high.inside[y * w], *d = c + w;
    for (std::size_t x = 0; x + 1 < w; ++x) {
      const int inside =
          a[x] | a[x + 1] << 1 | b[x] << 2 | b[x + 1] << 3 | c[x] << 4 | c[x + 1] << 5 | d[x] << 6 | d[x + 1] << 7;
      for (const std::int8_t edge : cases[static_cast<std::size_t>(inside)]) {
        const int axis = edge / 4, next = edge & 1, after = edge >> 1 & 1;
        const int bit[3] = {axis == 0   ? 0
                            : axis == 1 ? after
                                        : next,
                            axis == 1   ? 0
                            : axis == 2 ? after
                                        : next,
                            axis == 2   ? 0
                            : axis == 0 ? after
                                        : next};
        const std::size_t node = (y + static_cast<std::size_t>(bit[1])) * w + x + static_cast<std::size_t>(bit[0]);
        out.push_back((bit[2] ? above : here).vertex[3 * node + static_cast<std::size_t>(axis)]);
      }
    }
  }
}

}  // namespace

std::array<std::vector<std::int8_t>, 256> marching_cubes_cases() {
  Cases cases;
  for (int inside = 0; inside < 256; ++inside) {
    std::array<int, 12> next = loops_of(inside);
    for (int first = 0; first < 12; ++first) {
      if (next[static_cast<std::size_t>(first)] < 0) continue;
      std::vector<int> loop;
      for (int e = first; next[static_cast<std::size_t>(e)] >= 0;) {
        loop.push_back(e);
        e = std::exchange(next[static_cast<std::size_t>(e)], -1);
      }
      auto& out = cases[static_cast<std::size_t>(inside)];
      for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
        for (const int e : {loop[0], loop[i], loop[i + 1]}) out.push_back(static_cast<std::int8_t>(e));
      }
    }
  }
  return cases;
}

LatticeMesh mesh_of_lattice(const Run& run, int nx, int ny, int nz, const LatticeSlice& slice) {
  const int slabs = nz + 1;  // slab s lies between slices s - 1 and s
  std::vector<std::vector<CutEdge>> cuts(static_cast<std::size_t>(slabs) + 1);
  std::vector<std::vector<std::int32_t>> corners(static_cast<std::size_t>(slabs));
  parallel_for(
      run, slabs, kSlabs,
      [&](std::int64_t begin, std::int64_t end) {
        Slice low(nx, ny), high(nx, ny);
        high.load(slice, static_cast<int>(begin) - 1, nz);
        for (std::int64_t s = begin; s < end; ++s) {
          std::swap(low.inside, high.inside);
          high.load(slice, static_cast<int>(s), nz);
          cut_edges(low, high, static_cast<int>(s) - 1, cuts[static_cast<std::size_t>(s)]);
        }
      },
      "finding the skin");

  std::vector<std::int64_t> first(cuts.size() + 1, 0);
  for (std::size_t s = 0; s < cuts.size(); ++s) first[s + 1] = first[s] + static_cast<std::int64_t>(cuts[s].size());
  if (first.back() > kMaxPoints) fail(Status::kLimit, "the skin has more than 50 million vertices");

  const Cases cases = marching_cubes_cases();
  parallel_for(
      run, slabs, kSlabs,
      [&](std::int64_t begin, std::int64_t end) {
        Slice low(nx, ny), high(nx, ny);
        EdgeMap here(low.inside.size()), above(low.inside.size());
        const auto load = [&](std::int64_t s) {
          const auto i = static_cast<std::size_t>(s);
          above.load(cuts[i], static_cast<std::int32_t>(first[i]), low.width());
        };
        high.load(slice, static_cast<int>(begin) - 1, nz);
        load(begin);
        for (std::int64_t s = begin; s < end; ++s) {
          std::swap(low.inside, high.inside);
          std::swap(here.vertex, above.vertex);
          high.load(slice, static_cast<int>(s), nz);
          load(s + 1);
          triangles(low, high, here, above, cases, corners[static_cast<std::size_t>(s)]);
        }
      },
      "meshing the skin");

  LatticeMesh mesh;
  mesh.cuts.reserve(static_cast<std::size_t>(first.back()));
  std::size_t numbers = 0;
  for (const auto& c : corners) numbers += c.size();
  mesh.faces.resize(static_cast<Eigen::Index>(numbers / 3), 3);
  std::int32_t* out = mesh.faces.data();
  for (const auto& c : corners) out = std::copy(c.begin(), c.end(), out);
  for (const auto& c : cuts) mesh.cuts.insert(mesh.cuts.end(), c.begin(), c.end());
  return mesh;
}

}  // namespace sgrt
