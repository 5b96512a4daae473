// Masks as runs against the same operations voxel by voxel.
#include "volume/runs.hpp"

#include <gtest/gtest.h>

#include <random>

#include "scenes.hpp"

namespace sgrt {
namespace {

using test::kSilent;

constexpr int kX = 23, kY = 17, kZ = 11;
const Vec3 kSpacing(1, 1.5, 2.2);

Runs random_mask(unsigned seed, unsigned one_in) {
  std::mt19937 generator(seed);
  Runs mask(kX, kY, kZ);
  for (auto& row : mask.rows) {
    for (int x = 0; x < kX; ++x) {
      if (generator() % one_in) continue;
      if (!row.empty() && row.back().end == x) {
        ++row.back().end;
      } else {
        row.push_back({x, x + 1});
      }
    }
  }
  return mask;
}

template <class Is>
void expect_mask(const Runs& mask, Is&& is) {
  for (int z = 0; z < kZ; ++z) {
    for (int y = 0; y < kY; ++y) {
      for (int x = 0; x < kX; ++x) ASSERT_EQ(mask.inside(x, y, z), is(x, y, z)) << x << " " << y << " " << z;
    }
  }
}

// Any (all) of the voxels within the radius; `beyond` for those outside the volume.
bool in_ball(const Runs& m, int x, int y, int z, double radius, bool all, bool beyond) {
  bool any = false, every = true;
  for (int dz = -4; dz <= 4; ++dz) {
    for (int dy = -4; dy <= 4; ++dy) {
      for (int dx = -4; dx <= 4; ++dx) {
        if (Vec3(dx, dy, dz).cwiseProduct(kSpacing).norm() > radius) continue;
        const bool out = x + dx < 0 || y + dy < 0 || z + dz < 0 || x + dx >= kX || y + dy >= kY || z + dz >= kZ;
        const bool in = out ? beyond : m.inside(x + dx, y + dy, z + dz);
        any = any || in;
        every = every && in;
      }
    }
  }
  return all ? every : any;
}

TEST(Runs, SetOperations) {
  const Runs a = random_mask(1, 2), b = random_mask(2, 3);
  const Runs both = intersect(kSilent, a, b), other = complement(kSilent, a);
  expect_mask(both, [&](int x, int y, int z) { return a.inside(x, y, z) && b.inside(x, y, z); });
  expect_mask(other, [&](int x, int y, int z) { return !a.inside(x, y, z); });
  EXPECT_EQ(a.count() + other.count(), kX * kY * kZ);
}

TEST(Runs, DilationAndErosionByABall) {
  const Runs sparse = random_mask(3, 40), dense = complement(kSilent, random_mask(4, 40));
  expect_mask(dilate(kSilent, sparse, 3.1, kSpacing),
              [&](int x, int y, int z) { return in_ball(sparse, x, y, z, 3.1, false, false); });
  for (const bool outside : {false, true}) {
    expect_mask(erode(kSilent, dense, 3.1, kSpacing, outside),
                [&](int x, int y, int z) { return in_ball(dense, x, y, z, 3.1, true, outside); });
  }
}

TEST(Runs, ComponentsOverFaces) {
  Runs mask(kX, kY, kZ);
  mask.row(3, 3) = {{2, 9}, {12, 14}};  // 7 and 2
  mask.row(4, 3) = {{8, 10}};           // joins the first
  mask.row(4, 4) = {{10, 20}};          // only an edge from it: 10 of its own
  mask.row(8, 8) = {{0, 5}};
  EXPECT_EQ(largest_component(mask).count(), 10);
  const Runs seeded =
      components_with(mask, [](const Span& s, int y, int z) { return y == 4 && z == 3 && s.begin == 8; });
  EXPECT_EQ(seeded.count(), 9);
  EXPECT_EQ(largest_component(Runs(kX, kY, kZ)).count(), 0);
}

}  // namespace
}  // namespace sgrt
