// Regions: even-odd, normals, boxes, and polygons without area.
#include "core/roi.hpp"

#include <cmath>
#include <limits>

#include "expect.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

Surface at(const Vec3& x, const Vec3& normal = Vec3::UnitZ()) {
  Surface s;
  s.points = x.transpose();
  s.normals = normal.transpose();
  return s;
}

bool in(const Roi& roi, double x, double y) {
  return contains(roi, at(Vec3(x, y, 77)), 0);
}

TEST(Roi, Square) {
  const Roi roi = roi_from_polygon({{0, 0}, {10, 0}, {10, 10}, {0, 10}});
  EXPECT_TRUE(in(roi, 5, 5));
  EXPECT_TRUE(in(roi, 0.001, 9.999));
  for (const Vec2& x : {Vec2(-1, 5), Vec2(11, 5), Vec2(5, -1), Vec2(5, 11), Vec2(-5, 0), Vec2(15, 10)})
    EXPECT_FALSE(in(roi, x.x(), x.y()));
}

// REQ-ROI-001
TEST(Roi, OnlyWhatLooksUp) {
  const Roi roi = roi_from_polygon({{0, 0}, {10, 0}, {0, 10}});
  const Vec3 x(2, 2, 0);
  EXPECT_TRUE(contains(roi, at(x, Vec3(0.8, 0, 0.6)), 0));
  EXPECT_FALSE(contains(roi, at(x, Vec3(0.8, 0, -0.6)), 0));
  EXPECT_FALSE(contains(roi, at(x, Vec3(1, 0, 0)), 0));
  EXPECT_FALSE(contains(roi, at(x, Vec3::Constant(kNaN)), 0));
  Surface bare = at(x);
  bare.normals.resize(0, 3);
  EXPECT_TRUE(contains(roi, bare, 0));
  EXPECT_FALSE(contains(roi, at(Vec3::Constant(kNaN)), 0));
}

// Against the winding of an L, a star with a hole in the middle (even-odd) and a random walk seen by another ray.
TEST(Roi, ConcaveAndSelfCrossing) {
  const Roi ell = roi_from_polygon({{0, 0}, {10, 0}, {10, 4}, {4, 4}, {4, 10}, {0, 10}});
  EXPECT_TRUE(in(ell, 2, 8));
  EXPECT_TRUE(in(ell, 8, 2));
  EXPECT_FALSE(in(ell, 8, 8));
  std::vector<Vec2> star;
  for (int i = 0; i < 5; ++i)
    star.emplace_back(10 * std::cos(0.1 + i * 2.51327412), 10 * std::sin(0.1 + i * 2.51327412));
  const Roi pentagram = roi_from_polygon(star);
  EXPECT_FALSE(in(pentagram, 0, 0));  // crossed twice
  EXPECT_TRUE(in(pentagram, 8 * std::cos(0.1), 8 * std::sin(0.1)));
}

// REQ-ROI-001
TEST(Roi, RandomPolygonsAgainstAVerticalRay) {
  Draw draw(1);
  for (int repeat = 0; repeat < 50; ++repeat) {
    std::vector<Vec2> v;
    for (int i = 0; i < 3 + repeat; ++i) v.emplace_back(draw.uniform(-50, 50), draw.uniform(-50, 50));
    const Roi roi = roi_from_polygon(v);
    for (int k = 0; k < 200; ++k) {
      const double x = draw.uniform(-60, 60), y = draw.uniform(-60, 60);
      int crossings = 0;
      for (std::size_t i = 0; i < v.size(); ++i) {
        const Vec2 a = v[i], b = v[(i + 1) % v.size()];
        const double s = (x - a.x()) / (b.x() - a.x());
        crossings += s >= 0 && s < 1 && a.y() + s * (b.y() - a.y()) > y;
      }
      EXPECT_EQ(in(roi, x, y), crossings % 2 == 1);
    }
  }
}

// Neighbouring polygons that share an edge cover each point once: no seam, no doubling.
TEST(Roi, SharedEdges) {
  const Roi left = roi_from_polygon({{0, 0}, {5, 0}, {5, 10}, {0, 10}}),
            right = roi_from_polygon({{5, 0}, {10, 0}, {10, 10}, {5, 10}});
  for (double y = 0; y < 10; y += 0.5) EXPECT_NE(in(left, 5, y), in(right, 5, y));
}

TEST(Roi, Box) {
  const Roi roi = roi_from_box(Vec3(-1, -2, -3), Vec3(1, 2, 3));
  EXPECT_TRUE(contains(roi, at(Vec3(0, 0, 0), -Vec3::UnitZ()), 0));  // whichever way it looks
  EXPECT_TRUE(contains(roi, at(Vec3(1, -2, 3)), 0));
  for (int k = 0; k < 3; ++k) {
    EXPECT_FALSE(contains(roi, at((k + 1.001) * Vec3::Unit(k)), 0));
    EXPECT_FALSE(contains(roi, at(-(k + 1.001) * Vec3::Unit(k)), 0));
  }
  EXPECT_FALSE(contains(roi, at(Vec3::Constant(kNaN)), 0));
}

// REQ-ROI-002
TEST(Roi, NoArea) {
  const auto refused = [](std::vector<Vec2> v) {
    expect_error(Status::kInvalidArgument, "no area", [&] { roi_from_polygon(v); });
  };
  refused({{0, 0}, {10, 10}, {20, 20}});
  refused({{0, 0}, {0, 0}, {0, 0}});
  refused({{3, 5}, {7, 5}, {-2, 5}, {1, 5}});
  refused({{5, 3}, {5, 7}, {5, -2}});
  refused({{0, 0}, {10, 0}, {10, 10}, {10, 0}});                    // out and back
  refused({{0.1, 0.2}, {0.3, 0.6}, {0.2, 0.4}, {0.7, 1.4}});        // a line up to rounding
  refused({{0, 0}, {10, 0}, {10, 10}, {0, 0}, {10, 0}, {10, 10}});  // twice round: even everywhere
}

TEST(Roi, FigureOfEightHasArea) {
  for (double turn : {0.0, 0.3, 1.5707963267948966}) {
    const Mat3 R = Eigen::AngleAxisd(turn, Vec3::UnitZ()).toRotationMatrix();
    std::vector<Vec2> v;
    for (const Vec3& x : {Vec3(0, 0, 0), Vec3(10, 10, 0), Vec3(10, 0, 0), Vec3(0, 10, 0)})
      v.push_back((R * x).head<2>());
    const Roi roi = roi_from_polygon(v);
    const Vec3 inside = R * Vec3(1, 5, 0), outside = R * Vec3(5, 1, 0);
    EXPECT_TRUE(in(roi, inside.x(), inside.y()));
    EXPECT_FALSE(in(roi, outside.x(), outside.y()));
  }
}

// REQ-ROI-002
TEST(Roi, Nonsense) {
  for (int n : {0, 1, 2}) {
    expect_error(Status::kInvalidArgument, "at least 3, got " + std::to_string(n),
                 [&] { roi_from_polygon(std::vector<Vec2>(n, Vec2(0, 0))); });
  }
  for (double bad : {kNaN, kInf, 1e6}) {
    expect_error(Status::kInvalidArgument, "vertices_xy_mm[1]", [&] {
      roi_from_polygon({{0, 0}, {10, bad}, {10, 10}});
    });
  }
  for (double bad : {kNaN, kInf}) {
    expect_error(Status::kInvalidArgument, "min_mm[1]", [&] { roi_from_box(Vec3(0, bad, 0), Vec3(1, 1, 1)); });
    expect_error(Status::kInvalidArgument, "max_mm[2]", [&] { roi_from_box(Vec3(0, 0, 0), Vec3(1, 1, bad)); });
  }
  expect_error(Status::kInvalidArgument, "min_mm[2]: expected less",
               [&] { roi_from_box(Vec3(0, 0, 1), Vec3(1, 1, 1)); });
  expect_error(Status::kLimit, "at most 10000", [&] { roi_from_polygon(std::vector<Vec2>(10001, Vec2(0, 0))); });
}

}  // namespace
}  // namespace sgrt
