// Joint unwrapping: exact, with noise, and what it says of doubt.
#include "tof/unwrap.hpp"

#include <gtest/gtest.h>

#include "frames.hpp"
#include "tof/kernels.hpp"

namespace sgrt::test {
namespace {

TEST(Unwrap, FrequenciesRepeatWithTheirGreatestDivisor) {
  EXPECT_NEAR(joint_ambiguity({60e6, 80e6}, kLight), kLight / 40e6, 1e-6);
  EXPECT_NEAR(joint_ambiguity({20e6, 21e6}, kLight), kLight / 2e6, 1e-6);
  EXPECT_NEAR(joint_ambiguity({30e6}, kLight), kLight / 60e6, 1e-6);
  EXPECT_NEAR(joint_ambiguity({12e6, 18e6, 30e6}, kLight), kLight / 12e6, 1e-6);
}

TEST(Unwrap, ExactPhasesGiveTheRangeEverywhere) {
  const Rig rig = tof_rig(200, 2, {60e6, 80e6});
  const auto scene = [](int, int, int, int x) { return Light{20 + 37.0 * x}; };
  const auto r = measured(rig, frames_of(rig, 1, scene));
  for (int x = 0; x < 200; ++x) {
    EXPECT_NEAR(r->range.plane(0)[x], 20 + 37.0 * x, 0.02);
    EXPECT_EQ(r->flags[static_cast<std::size_t>(x)] & kernels::kWrapped, 0);
    EXPECT_GT(r->score.plane(0)[x], 20);
  }
}

// At A / sqrt(B) = 4 one in 2,600 goes wrong: more than 14 of 10,000 is a chance of 1e-5.
TEST(Unwrap, RightInTheNoise) {
  Draw draw(5);
  const Rig rig = tof_rig(100, 100, {60e6, 80e6});
  std::vector<double> truth(10000);
  for (double& d : truth) d = draw.uniform(200, 7300);
  const double B = 2000;
  const auto scene = [&](int, int, int y, int x) {
    return Light{truth[static_cast<std::size_t>(100 * y + x)], B, 4 * std::sqrt(B)};
  };
  const auto r = measured(rig, frames_of(rig, 1, scene, &draw));
  int wrong = 0, wrong_and_silent = 0;
  double square = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double e = r->range.plane(0)[i] - truth[i];
    if (std::abs(e) > 300) {
      ++wrong;
      wrong_and_silent += (r->flags[i] & kernels::kWrapped) == 0;
    } else {
      square += std::pow(e / r->sigma.plane(0)[i], 2);
    }
  }
  EXPECT_LE(wrong, 14);
  EXPECT_LE(wrong_and_silent, wrong);
  EXPECT_NEAR(std::sqrt(square / 10000), 1, 0.1);
}

TEST(Unwrap, ARangeOutsideTheWindowIsInDoubt) {
  const Rig rig = tof_rig(16, 2, {60e6, 80e6});
  TofOptions o;
  o.range_max = 3000;
  const auto scene = [](int, int, int, int x) { return Light{x < 8 ? 1000.0 : 4100.0}; };
  const auto r = measured(rig, frames_of(rig, 1, scene), o);
  for (int x = 0; x < 16; ++x) EXPECT_EQ((r->flags[static_cast<std::size_t>(x)] & kernels::kWrapped) != 0, x >= 8) << x;
}

// REQ-TOF-004
TEST(Unwrap, AWindowOfTwoWavesIsInDoubtThroughout) {
  const Rig rig = tof_rig(16, 2, {60e6, 80e6});
  TofOptions o;
  o.range_max = 14000;
  const auto r = measured(rig, frames_of(rig, 1, [](int, int, int, int x) { return Light{1000 + 50.0 * x}; }), o);
  for (int x = 0; x < 16; ++x) EXPECT_TRUE(r->flags[static_cast<std::size_t>(x)] & kernels::kWrapped);
}

}  // namespace
}  // namespace sgrt::test
