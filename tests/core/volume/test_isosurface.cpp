// Every one of the 256 cases closes, and lattices of noise give closed, outward meshes.
#include "volume/isosurface.hpp"

#include <map>
#include <random>
#include <set>

#include "scenes.hpp"
#include "volume/skin.hpp"

namespace sgrt {
namespace {

using test::kSilent;

TEST(MarchingCubes, EachCutEdgeIsUsedAndEachCaseTurnsRoundTheInside) {
  const auto cases = marching_cubes_cases();
  EXPECT_TRUE(cases[0].empty());
  EXPECT_TRUE(cases[255].empty());
  for (std::size_t inside = 1; inside < 255; ++inside) {
    std::set<int> used(cases[inside].begin(), cases[inside].end()), cut;
    for (int a = 0; a < 8; ++a) {
      for (int axis = 0; axis < 3; ++axis) {
        const int b = a | 1 << axis;
        if (a == b || ((inside >> a) & 1) == ((inside >> b) & 1)) continue;
        cut.insert(4 * axis + ((a >> (axis + 1) % 3) & 1) + 2 * ((a >> (axis + 2) % 3) & 1));
      }
    }
    EXPECT_EQ(used, cut) << inside;
  }
}

LatticeMesh random_mesh(int seed, int n) {
  std::mt19937 generator(static_cast<unsigned>(seed));
  std::vector<std::uint8_t> nodes(static_cast<std::size_t>(n * n * n));
  for (auto& node : nodes) node = generator() % 2;
  return mesh_of_lattice(kSilent, n, n, n, [&](int z, std::uint8_t* inside) {
    std::copy_n(nodes.begin() + static_cast<std::ptrdiff_t>(z) * n * n, n * n, inside);
  });
}

// REQ-VOL-003
TEST(MarchingCubes, MeshOfNoiseIsClosed) {
  // Each half edge has its opposite, exactly once: no hole, no flipped face, at any pattern of nodes.
  const LatticeMesh mesh = random_mesh(1, 12);
  std::map<std::pair<int, int>, int> edges;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) ++edges[{mesh.faces(f, k), mesh.faces(f, (k + 1) % 3)}];
  }
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    ASSERT_NE(opposite, edges.end());
    EXPECT_EQ(count, opposite->second);
  }
}

TEST(MarchingCubes, VolumeOfOneNodeIsThatOfItsOctahedron) {
  const LatticeMesh mesh = mesh_of_lattice(kSilent, 1, 1, 1, [](int, std::uint8_t* inside) { *inside = 1; });
  ASSERT_EQ(mesh.cuts.size(), 6U);
  ASSERT_EQ(mesh.faces.rows(), 8);
  Points points(6, 3);
  for (Eigen::Index i = 0; i < 6; ++i) {
    const CutEdge& e = mesh.cuts[static_cast<std::size_t>(i)];
    points.row(i) << e.x, e.y, e.z;
    points(i, e.axis) += 0.5 * e.step;
  }
  EXPECT_NEAR(volume_of(points, mesh.faces), 8.0 * 0.5 * 0.5 * 0.5 / 6, 1e-15);  // positive: outward
}

}  // namespace
}  // namespace sgrt
