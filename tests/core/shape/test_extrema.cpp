// Extrema with their persistence, and crests.

#include <cmath>

#include "shape/extrema.hpp"
#include "shape/surfaces.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::normal_draw;
using test::Wave;
using test::wave;

TEST(ShapeExtrema, PersistenceFindsTheBumpsAndNoiseMakesNone) {
  const int side = 61;
  Draw draw(14);
  Wave w = wave(side, 1, false, true);
  CurvatureOptions o;
  o.radius = 6;
  for (std::int64_t i = 0; i < w.surface.size(); ++i) {
    const double x = w.surface.points(i, 0), y = w.surface.points(i, 1);
    w.surface.points(i, 2) = 4 * std::exp(-((x - 12) * (x - 12) + y * y) / 50) -
                             4 * std::exp(-((x + 12) * (x + 12) + y * y) / 50) + 0.05 * normal_draw(draw);
  }
  w.surface.normals.rowwise() = Eigen::RowVector3d(0, 0, 1);
  const CurvatureField f = surface_curvature(sgrt::Run{}, w.surface, o);
  const auto found = extrema(f, beside_in_sheet(sgrt::Run{}, w.surface, f), 4);
  ASSERT_GE(found.size(), 2u);
  EXPECT_NE(found[0].sign, found[1].sign);
  for (int k = 0; k < 2; ++k) {
    const Vec3 at = w.surface.point(found[static_cast<std::size_t>(k)].row);
    EXPECT_NEAR(at[0], 12 * found[static_cast<std::size_t>(k)].sign, 1.5);
    EXPECT_NEAR(at[1], 0, 1.5);
  }
  // A plane with noise has none that stand out.
  for (std::int64_t i = 0; i < w.surface.size(); ++i) w.surface.points(i, 2) = 0.05 * normal_draw(draw);
  const CurvatureField flat = surface_curvature(sgrt::Run{}, w.surface, o);
  EXPECT_LE(extrema(flat, beside_in_sheet(sgrt::Run{}, w.surface, flat), 4).size(), 1u);
}

TEST(ShapeExtrema, CrestsOfAWave) {
  const int side = 61;
  Wave w = wave(side, 1, false, true);
  for (std::int64_t i = 0; i < w.surface.size(); ++i) {
    const double x = w.surface.points(i, 0);
    w.surface.points(i, 2) = 3 * std::cos(x / 5);
    w.surface.normals.row(i) = Vec3(0.6 * std::sin(x / 5), 0, 1).normalized().transpose();
  }
  CurvatureOptions o;
  o.radius = 2.5;
  o.noise = 1e-3;
  const CurvatureField f = surface_curvature(sgrt::Run{}, w.surface, o);
  const std::vector<std::int32_t> beside = beside_in_sheet(sgrt::Run{}, w.surface, f);
  const std::vector<std::uint8_t> lines = crests(sgrt::Run{}, w.surface, f, beside, 3);
  int ridge = 0, valley = 0;
  for (std::int64_t i = 0; i < w.surface.size(); ++i) {
    const double phase = std::cos(w.surface.points(i, 0) / 5);
    const int line = lines[static_cast<std::size_t>(i)];
    ridge += line == 1;
    valley += line == 2;
    if (line == 1) {
      EXPECT_GT(phase, 0.95);
    } else if (line == 2) {
      EXPECT_LT(phase, -0.95);
    }
  }
  EXPECT_GT(ridge, 40);
  EXPECT_GT(valley, 40);
}

}  // namespace
}  // namespace sgrt
