// Rectification and the spline below it, against the rig's own projection and against polynomials.
#include "stereo/rectify.hpp"

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "stereo/scene.hpp"
#include "stereo/spline.hpp"
#include "stereo/stereo.hpp"

namespace sgrt {
namespace {

using namespace testing;
const Vec3 kAll = Vec3::Constant(std::numeric_limits<double>::infinity());

TEST(Rectify, APointLiesOnOneRowWithTheDisparityOfItsDepth) {
  const Rig rig = small_rig();
  const Rectification r = make_rectification({}, rig.cameras[0], rig.cameras[1], -kAll, kAll);
  const Vec3 right_centre = rig.cameras[1].centre_in_room();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> draw(-80, 80);
  for (int i = 0; i < 100; ++i) {
    const Vec3 x(draw(random), draw(random), draw(random));
    const Vec3 p = r.room_from_rectified.transpose() * (x - r.centre),
               q = r.room_from_rectified.transpose() * (x - right_centre);
    const Vec2 left(r.f * p.x() / p.z() + r.left.cx, r.f * p.y() / p.z() + r.left.cy);
    const Vec2 right(r.f * q.x() / q.z() + r.right.cx, r.f * q.y() / q.z() + r.right.cy);
    EXPECT_NEAR(left.y(), right.y(), 1e-9);
    EXPECT_NEAR(left.x() - right.x(), r.f * r.baseline / p.z() + r.disparity_at_infinity(), 1e-9);
    EXPECT_LT((r.source_pixel(r.left, left.x(), left.y()) - project(rig.cameras[0], x)).norm(), 1e-9);
    EXPECT_LT((r.source_pixel(r.right, right.x(), right.y()) - project(rig.cameras[1], x)).norm(), 1e-9);
  }
}

TEST(Rectify, ResamplesASmoothImageAndMasksTheRest) {
  const Rig rig = small_rig();
  const Rectification r = make_rectification({}, rig.cameras[0], rig.cameras[1], -kAll, kAll);
  const auto grey = [](double x, double y) { return 100 + 40 * std::sin(x / 3) * std::cos(y / 4); };
  std::vector<float> pixels;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) pixels.push_back(static_cast<float>(grey(x, y)));
  RectifyWork work;
  Image out;
  std::vector<std::uint8_t> mask;
  rectify({}, view_of(pixels, rig.cameras[0]), r.left, work, out, mask);
  int good = 0;
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      const Vec2 p = r.source_pixel(r.left, x, y);
      const bool deep = p.x() > 8 && p.y() > 8 && p.x() < 311 && p.y() < 231;
      if (!deep) continue;
      ASSERT_EQ(mask[static_cast<std::size_t>(y) * out.width + x], 0);
      ASSERT_NEAR(out.row(y)[x], grey(p.x(), p.y()), 0.05);
      ++good;
    }
  EXPECT_GT(good, 40000);
  EXPECT_GT(std::count(mask.begin(), mask.end(), static_cast<std::uint8_t>(Reason::kOutOfView)), 0);
}

TEST(Rectify, CropsToTheVolume) {
  const Rig rig = small_rig();
  const Rectification all = make_rectification({}, rig.cameras[0], rig.cameras[1], -kAll, kAll);
  const Rectification small =
      make_rectification({}, rig.cameras[0], rig.cameras[1], Vec3(-20, -20, -5), Vec3(20, 20, 5));
  EXPECT_LT(small.left.width * small.left.height, all.left.width * all.left.height / 4);
  EXPECT_THROW(make_rectification({}, rig.cameras[0], rig.cameras[1], Vec3(5000, 0, 0), Vec3(5020, 20, 20)), Error);
}

TEST(Spline, ReproducesPolynomialsAndItsOwnSamples) {
  Image image;
  image.resize(40, 60);
  const auto f = [](double x, double y) {
    return 3 + 0.2 * x - 0.1 * y + 0.01 * x * x - 0.0004 * x * x * x + 0.02 * x * y;
  };
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x) image.row(y)[x] = static_cast<float>(f(x, y));
  spline_rows({}, image);
  spline_columns({}, image);
  for (const double x : {20.0, 25.25, 30.9})
    for (const double y : {18.0, 19.5, 21.3}) {
      float wx[4], wy[4], value = 0;
      const int kx = static_cast<int>(x), ky = static_cast<int>(y);
      spline_weights(static_cast<float>(x - kx), wx);
      spline_weights(static_cast<float>(y - ky), wy);
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) value += wy[j] * wx[i] * image.row(ky - 1 + j)[kx - 1 + i];
      EXPECT_NEAR(value, f(x, y), 1e-4);
    }
}

TEST(Spline, NoiseGainIsTheIntegralOfTheSquaredCardinalSpline) {
  Image impulse;
  impulse.resize(1, 81);
  std::fill(impulse.pixels.begin(), impulse.pixels.end(), 0.F);
  impulse.pixels[40] = 1;
  spline_rows({}, impulse);
  for (const float t : {0.F, 0.2F, 0.5F, 0.77F}) {
    double gain = 0;
    float w[4];
    spline_weights(t, w);
    for (int k = 2; k < 78; ++k) {
      float value = 0;
      for (int i = 0; i < 4; ++i) value += w[i] * impulse.pixels[k - 1 + i];
      gain += static_cast<double>(value) * value;
    }
    EXPECT_NEAR(gain, cubic_noise_gain(t), 1e-3) << t;
  }
}

}  // namespace
}  // namespace sgrt
