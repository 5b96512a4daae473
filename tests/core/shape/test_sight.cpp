// Lines of sight: what lies before the skin that a sensor saw and what behind it, off the surface, and closed bodies.
#include "shape/sight.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace sgrt {
namespace {

// Points 1 mm apart on z = 0 for x < 0 and z = 10 for x >= 0, seen from +z, turned by R.
Surface step_seen(const Mat3& R, double noise) {
  Surface s;
  s.points.resize(41 * 41, 3);
  s.normals.resize(41 * 41, 3);
  for (int i = 0; i < 41; ++i) {
    for (int j = 0; j < 41; ++j) {
      const Vec3 p(j - 20, i - 20, (j < 20 ? 0 : 10) + noise * ((7 * i + 5 * j) % 3 - 1));
      s.points.row(41 * i + j) = (R * p).transpose();
      s.normals.row(41 * i + j) = (R * Vec3(0, 0, 1)).transpose();
    }
  }
  return s;
}

TEST(Sight, KnowsWhatIsBeforeAndBehindTheSkin) {
  const Mat3 turns[] = {Mat3::Identity(), so3_exp(Vec3(0.4, -1.1, 2))};
  for (const Mat3& R : turns) {
    const Sight sight(step_seen(R, 0), 1);
    EXPECT_NEAR((sight.towards() - R * Vec3(0, 0, 1)).norm(), 0, 1e-12);
    EXPECT_NEAR(sight.before_skin(R * Vec3(-10, 3, 5)), 5, 1e-9);
    EXPECT_NEAR(sight.before_skin(R * Vec3(-10, 3, -4)), -4, 1e-9);
    EXPECT_NEAR(sight.before_skin(R * Vec3(10, -7, 2)), -8, 1e-9);
    EXPECT_TRUE(std::isnan(sight.before_skin(R * Vec3(40, 0, 0))));
    EXPECT_TRUE(std::isnan(sight.before_skin(R * Vec3(0, 1e30, 0))));
  }
}

TEST(Sight, NoiseMovesItNoFurtherThanItself) {
  const Sight sight(step_seen(Mat3::Identity(), 0.5), 1);
  for (int x = -18; x < -2; ++x) EXPECT_NEAR(sight.before_skin(Vec3(x + 0.3, 0.2, 6)), 6, 0.51);
}

TEST(Sight, SaysNothingOfAClosedBodyOrNone) {
  Surface ball;
  ball.points.resize(400, 3);
  for (int i = 0; i < 400; ++i) {
    const double z = (i + 0.5) / 200 - 1, r = std::sqrt(1 - z * z);
    ball.points.row(i) << r * std::cos(2.4 * i), r * std::sin(2.4 * i), z;
  }
  ball.normals = ball.points;
  ball.points *= 50;
  EXPECT_EQ(Sight(ball, 9).towards(), Vec3::Zero());
  EXPECT_TRUE(std::isnan(Sight(ball, 9).before_skin(Vec3(0, 0, 80))));
  Surface unknown = ball;
  unknown.normals.setConstant(std::nan(""));
  EXPECT_TRUE(std::isnan(Sight(unknown, 9).before_skin(Vec3::Zero())));
}

}  // namespace
}  // namespace sgrt
