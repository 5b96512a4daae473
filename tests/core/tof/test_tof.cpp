// Taps to phase, amplitude, offset, range, sigma and points: exact, against Monte Carlo, and what is wrong with pixels.
#include "tof/tof.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "frames.hpp"
#include "tof/kernels.hpp"

namespace sgrt::test {
namespace {

double ramp(int y, int x) {
  return 400 + 30.0 * x + 41.0 * y;
}

std::function<Light(int, int, int, int)> still(const std::function<Light(int y, int x)>& scene) {
  return [scene](int, int, int y, int x) { return scene(y, x); };
}

// REQ-TOF-001
TEST(Tof, AnyTapsInAnyOrderGiveTheRange) {
  const std::vector<std::vector<double>> all = {
      kQuarters,
      {3 * kPi / 2, 0, kPi, kPi / 2},
      {0, -kPi / 2, -kPi, -3 * kPi / 2},
      {0, 2 * kPi / 3, 4 * kPi / 3},
      {0.1, 1.0, 2.5, 3.3, 5.9},
      {0, kPi / 4, kPi / 2, 3 * kPi / 4, kPi, 5 * kPi / 4, 3 * kPi / 2, 7 * kPi / 4},
  };
  for (const std::vector<double>& phases : all) {
    const Rig rig = tof_rig(21, 13, {20e6}, phases);
    const auto r = measured(rig, frames_of(rig, 1, still([](int y, int x) { return Light{ramp(y, x)}; })));
    EXPECT_EQ(r->point_count, 21 * 13);
    for (int i = 0; i < 21 * 13; ++i) {
      const double d = ramp(i / 21, i % 21);
      ASSERT_NEAR(r->range.plane(0)[i], d, 0.02) << phases.size() << " taps, pixel " << i;
      ASSERT_NEAR(r->amplitude.plane(0)[i], 8000, 0.02);
      ASSERT_NEAR(r->offset.plane(0)[i], 20000, 0.02);
      const double phi = std::fmod(4 * kPi * 20e6 * 1.00027 * d / kLight, 2 * kPi);
      ASSERT_NEAR(r->phase.plane(0)[i], phi, 1e-5);
    }
  }
}

TEST(Tof, PointsLieOnTheUndistortedRays) {
  const Rig rig = tof_rig(19, 11);
  const auto r = measured(rig, frames_of(rig, 1, still([](int y, int x) { return Light{ramp(y, x)}; })));
  for (int i = 0; i < 19 * 11; ++i) {
    const Vec3 x =
        rig.cameras[0].centre_in_room() + ramp(i / 19, i % 19) * unproject(rig.cameras[0], Vec2(i % 19, i / 19));
    for (int k = 0; k < 3; ++k) ASSERT_NEAR(r->points.plane(k)[i], x[k], 0.02);
  }
}

TEST(Tof, TheChaptersSpeedIsExactlyItsOwn) {
  const Rig rig = tof_rig(8, 1);
  const Frames frames = frames_of(rig, 1, still([](int, int x) { return Light{1000.0 + 10 * x}; }));
  TofOptions chapter;
  chapter.chapter_c = true;
  const auto own = measured(rig, frames), printed = measured(rig, frames, chapter);
  for (int i = 0; i < 8; ++i)
    EXPECT_NEAR(printed->range.plane(0)[i] / own->range.plane(0)[i], 3e11 / (kLight / 1.00027), 1e-6);
}

// Eq. 5 for any taps, and the law of four.
// REQ-TOF-002
TEST(Tof, SigmaIsWhatNoiseGives) {
  Draw draw(1);
  for (const std::vector<double>& phases :
       {kQuarters, std::vector<double>{0, 2 * kPi / 3, 4 * kPi / 3}, std::vector<double>{0.1, 1.0, 2.5, 3.3, 5.9}}) {
    const Rig rig = tof_rig(100, 100, {20e6}, phases);
    const auto r = measured(rig, frames_of(rig, 1, still([](int, int) { return Light{1500}; }), &draw));
    double square = 0, mean = 0, predicted = 0;
    for (int i = 0; i < 10000; ++i) {
      const double e = r->range.plane(0)[i] - 1500;
      mean += e / 10000, square += e * e / 10000, predicted += std::pow(r->sigma.plane(0)[i], 2) / 10000;
    }
    EXPECT_NEAR(std::sqrt(square / predicted), 1, 0.03) << phases.size();  // 4 sigma of 10,000 draws
    EXPECT_NEAR(mean, 0, 4 * std::sqrt(square) / 100);
    if (phases.size() == 4)
      EXPECT_NEAR(std::sqrt(predicted), kLight / 1.00027 / (4 * std::sqrt(2) * kPi * 20e6) * std::sqrt(20000) / 8000,
                  0.02);
  }
}

// REQ-DET-007
TEST(Tof, BothInstructionSetsGiveTheSameBits) {
  if (detect_isa() != Isa::kAvx2) GTEST_SKIP() << "this machine has no AVX2";
  Draw draw(2);
  const Rig rig = tof_rig(45, 17);
  const Frames frames = frames_of(rig, 1, still([](int y, int x) { return Light{x > 20 ? 3000 : ramp(y, x)}; }), &draw);
  sgrt::Run fast;
  fast.isa = Isa::kAvx2;
  const auto a = measured(rig, frames), b = measured(rig, frames, {}, fast);
  EXPECT_EQ(a->flags, b->flags);
  for (int i = 0; i < 45 * 17; ++i) {
    for (const auto& [p, q] : {std::pair(&a->range, &b->range), std::pair(&a->sigma, &b->sigma),
                               std::pair(&a->phase, &b->phase), std::pair(&a->points, &b->points)})
      ASSERT_EQ(std::memcmp(p->plane(0) + i, q->plane(0) + i, sizeof(float)), 0);
  }
}

// REQ-TOF-003
TEST(Tof, FlagsNameWhatIsWrong) {
  const Rig rig = tof_rig(16, 9);
  Frames frames = frames_of(rig, 1, [](int, int tap, int y, int x) {
    if (y == 2 && x == 3) return Light{1000, 20000, 0};      // no light of its own
    if (y == 4 && x == 5) return Light{1000.0 + 150 * tap};  // moved between the taps
    if (y == 4 && x == 9) return Light{1000, 20000, 8000};
    return Light{1000};
  });
  frames.taps[6 * 16 + 7] = std::numeric_limits<float>::quiet_NaN();
  frames.taps[6 * 16 + 11] = 65535;
  TofOptions options;
  options.saturation = 65535;
  const auto r = measured(rig, frames, options);
  EXPECT_EQ(r->flags[2 * 16 + 3] & 63, kernels::kLowAmplitude);
  EXPECT_TRUE(r->flags[4 * 16 + 5] & kernels::kMoved);
  EXPECT_TRUE(r->flags[6 * 16 + 7] & kernels::kSaturated);
  EXPECT_TRUE(r->flags[6 * 16 + 11] & kernels::kSaturated);
  EXPECT_EQ(r->point_count, 16 * 9 - 4);
  for (int i : {2 * 16 + 3, 4 * 16 + 5, 6 * 16 + 7, 6 * 16 + 11}) EXPECT_TRUE(std::isnan(r->points.plane(0)[i]));
  EXPECT_FALSE(std::isnan(r->range.plane(0)[4 * 16 + 5]));  // what was measured is there
}

TEST(Tof, TheWindowDecides) {
  const Rig rig = tof_rig(12, 3);  // 7493 mm unambiguous
  const Frames frames = frames_of(rig, 1, still([](int, int x) { return Light{500.0 + 1000 * x}; }));
  TofOptions far;
  far.range_min = 4000, far.range_max = 11000;
  const auto r = measured(rig, frames, far);
  const double wave = kLight / 1.00027 / 40e6;
  for (int x = 0; x < 12; ++x) {
    const double seen = 4000 + std::fmod(500.0 + 1000 * x - 4000 + wave, wave);
    EXPECT_NEAR(r->range.plane(0)[x], seen, 0.1) << x;
    EXPECT_EQ(r->flags[static_cast<std::size_t>(x)] & kernels::kOutOfRange, seen > 11000 ? kernels::kOutOfRange : 0)
        << x;
  }
  far.range_min = 0;  // 7493 to 11000 mm fit into the window twice
  const auto twice = measured(rig, frames, far);
  for (int x = 0; x < 12; ++x) {
    const double first = std::fmod(500.0 + 1000 * x, wave);
    EXPECT_EQ((twice->flags[static_cast<std::size_t>(x)] & kernels::kWrapped) != 0, first + wave < 11000) << x;
  }
}

// REQ-TOF-003
TEST(Tof, PixelsBetweenTwoSurfacesFly) {
  const Rig rig = tof_rig(40, 30);
  const auto scene = [](int, int, int, int x) {  // a mixed column between a body and a wall; a steep body left of it
    return Light{x < 10 ? 1000 + 12.0 * (10 - x) : x < 20 ? 1000 : x == 20 ? 1400 : 2500};
  };
  const auto r = measured(rig, frames_of(rig, 1, scene));
  for (int i = 0; i < 40 * 30; ++i)
    EXPECT_EQ((r->flags[static_cast<std::size_t>(i)] & kernels::kFlying) != 0, i % 40 == 20) << i;
}

TEST(Tof, CorrectionsAreSubtracted) {
  Rig rig = tof_rig(16, 4);
  TofUnit& u = rig.tofs[0];
  u.range_mm = {1000, 1200, 1300}, u.range_error_mm = {10, 30, -10};
  u.amplitude = {4000, 8000}, u.amplitude_error_mm = {5, 7};
  std::vector<float> offsets(16 * 4);
  for (std::size_t i = 0; i < offsets.size(); ++i) offsets[i] = 0.1F * static_cast<float>(i);
  const Frames frames = frames_of(rig, 1, still([](int, int x) { return Light{900 + 30.0 * x, 20000, 6000}; }));
  TofSensor sensor(kSilent, rig, 0, {}, offsets);
  const auto r = sensor.measure(kSilent, frames.view);
  for (int i = 0; i < 16 * 4; ++i) {
    const double d = 900 + 30.0 * (i % 16);
    const double error = d < 1000 ? 10 : d < 1200 ? 10 + (d - 1000) / 10 : d < 1300 ? 30 - 0.4 * (d - 1200) : -10;
    EXPECT_NEAR(r->range.plane(0)[i], d - error - 6 - 0.1 * i, 0.01) << i;
    EXPECT_EQ((r->flags[static_cast<std::size_t>(i)] & kernels::kUncalibrated) != 0, d < 1000 || d > 1300);
    EXPECT_FALSE(std::isnan(r->points.plane(0)[i]));
  }
}

TEST(Tof, FramesAreAveragedAsFarAsNothingMoved) {
  Draw draw(3);
  const Rig rig = tof_rig(60, 40);
  const auto scene = [](int frame, int, int, int x) {  // the right half jumps after frame 3, the far right drifts
    return Light{x < 30 ? 1500 : x < 50 ? (frame < 4 ? 1400.0 : 1500.0) : 1500 - 20.0 * (7 - frame)};
  };
  const auto r = measured(rig, frames_of(rig, 8, scene, &draw));
  double used[3] = {}, square[3] = {}, predicted[3] = {}, count[3] = {}, mean[3] = {};
  for (int i = 0; i < 60 * 40; ++i) {
    const int part = i % 60 < 30 ? 0 : i % 60 < 50 ? 1 : 2;
    const double e = r->range.plane(0)[i] - 1500;
    used[part] += r->frames.plane(0)[i], square[part] += e * e, mean[part] += e;
    predicted[part] += std::pow(r->sigma.plane(0)[i], 2), ++count[part];
  }
  EXPECT_GT(used[0] / count[0], 7.8);
  EXPECT_NEAR(std::sqrt(square[0] / predicted[0]), 1, 0.08);
  EXPECT_LT(used[1] / count[1], 4.1);  // not one frame from before the jump
  EXPECT_NEAR(mean[1] / count[1], 0, 1.5);
  EXPECT_GT(mean[2] / count[2], -32);  // of -70 without a look at motion
}

TEST(Tof, TheSurfaceHasNormalsAndCovariance) {
  const Rig rig = tof_rig(40, 30);
  const Camera& c = rig.cameras[0];
  const Vec3 centre = c.centre_in_room(), axis = c.camera_from_room.R.transpose().col(2);
  const Vec3 n = (-axis + 0.4 * c.camera_from_room.R.transpose().col(0)).normalized(), p = centre + 1200 * axis;
  const auto d = [&](int y, int x) {
    const Vec3 e = unproject(c, Vec2(x, y));
    return (p - centre).dot(n) / e.dot(n);
  };
  const Frames frames =
      frames_of(rig, 1, [&](int, int, int y, int x) { return Light{y == 7 && x == 9 ? 3000 : d(y, x)}; });
  TofSensor sensor(kSilent, rig, 0, {}, {});
  const auto r = sensor.measure(kSilent, frames.view);
  const Surface s = make_surface(sensor.surface(kSilent, *r));
  EXPECT_EQ(s.width, 40);
  EXPECT_EQ(s.height, 30);
  for (int i = 0; i < 40 * 30; ++i) {
    if (i == 7 * 40 + 9) continue;
    const Vec3 e = unproject(c, Vec2(i % 40, i / 40));
    const double sigma = r->sigma.plane(0)[i];
    ASSERT_NEAR((s.point(i) - p).dot(n), 0, 0.02);
    ASSERT_NEAR(s.normal(i).dot(n), 1, 1e-5);
    ASSERT_NEAR(s.sigma(i), sigma * std::abs(n.dot(e)), 1e-3 * sigma);
    ASSERT_NEAR(s.variance_along(i, n), std::pow(sigma * n.dot(e), 2), 1e-3 * sigma * sigma);
  }
}

TEST(Tof, DifferentialTapsHaveNoSigma) {
  Rig rig = tof_rig(12, 5);
  rig.tofs[0].differential = true;
  const Frames frames = frames_of(rig, 1, still([](int y, int x) { return Light{ramp(y, x), 0, 300}; }));
  TofSensor sensor(kSilent, rig, 0, {}, {});
  const auto r = sensor.measure(kSilent, frames.view);
  EXPECT_EQ(r->point_count, 60);
  EXPECT_TRUE(std::isnan(r->sigma.plane(0)[17]));
  EXPECT_TRUE(std::isnan(r->median_sigma));
  const Surface s = make_surface(sensor.surface(kSilent, *r));
  EXPECT_EQ(s.sigma.size(), 0);
  EXPECT_EQ(s.covariance.rows(), 0);
}

TEST(Tof, NonsenseIsNamed) {
  const Rig rig = tof_rig(8, 4);
  Frames frames = frames_of(rig, 1, still([](int, int) { return Light{1000}; }));
  Frames other = frames;
  other.view.shape[4] = 7;
  expect_error(Status::kInvalidArgument, "taps: shape 1 x 1 x 4 x 4 x 7", [&] { measured(rig, other); });
  TofOptions o;
  o.range_min = 2000, o.range_max = 1000;
  expect_error(Status::kInvalidArgument, "range_max_mm: 1000", [&] { measured(rig, frames, o); });
  o = {};
  o.normal_window = 4;
  expect_error(Status::kInvalidArgument, "normal_window_px", [&] { measured(rig, frames, o); });
  expect_error(Status::kInvalidArgument, "pixel_offset_mm",
               [&] { TofSensor(kSilent, rig, 0, {}, std::vector<float>(7)); });
  for (float& t : frames.taps) t = 1e10F;
  const auto r = measured(rig, frames);
  EXPECT_EQ(r->status, Status::kNotFound);
  EXPECT_NE(r->message.find("saturated"), std::string::npos) << r->message;
}

}  // namespace
}  // namespace sgrt::test
