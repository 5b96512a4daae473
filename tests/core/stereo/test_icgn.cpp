// The IC-GN kernel on rows with a known affine warp: exactness, invariance to gain and offset, predicted against
// sampled sigma, the Jacobian against finite differences, refusals.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "stereo/kernels.hpp"
#include "stereo/waves.hpp"

namespace sgrt {
namespace {

using namespace testing;
using kernels::RowMatch;

double texture(double x, double y) {
  static const PlaneWaves waves(3, 30, 5, 12, 12);
  return waves(x, y);
}

RectifiedImage image_of(const std::function<double(double, double)>& grey, double noise = 0, unsigned seed = 1) {
  return rectified_image(80, 120, grey, noise, seed);
}

constexpr kernels::RefineOptions kOptions{7, 20, 0, 4};

RowMatch refine(const RectifiedImage& left, const RectifiedImage& right, float d, int x = 60, int y = 40,
                const kernels::RefineOptions& options = kOptions) {
  RowMatch match{};
  match.d = d;
  kernels::refine_row_baseline(left.plane(), right.plane(), x, y, options, &match);
  return match;
}

// Right image of the plane of disparities d + a (x - 60) + b (y - 40) seen from the left pixel (60, 40).
RectifiedImage warped(double d, double a, double b, double gain, double offset, double noise = 0, unsigned seed = 1) {
  // right(xr, y) = left(x) with xr = x - d - a (x - 60) - b (y - 40)
  return image_of(
      [=](double xr, double y) {
        const double x = (xr + d - a * 60 + b * (y - 40)) / (1 - a);
        return gain * texture(x, y) + offset;
      },
      noise, seed);
}

TEST(Icgn, FindsAnAffineWarpExactly) {
  const RectifiedImage left = image_of(texture);
  for (const double d : {0.0, 3.27, -5.5, 11.93})
    for (const double a : {0.0, 0.12, -0.2})
      for (const double b : {0.0, 0.15}) {
        const RowMatch m = refine(left, warped(d, a, b, 1, 0), static_cast<float>(d + 0.8));
        ASSERT_EQ(m.outcome, kernels::kConverged) << d << ' ' << a << ' ' << b;
        EXPECT_NEAR(m.d, d, 4e-3) << a << ' ' << b;  // what cubic interpolation of 5 px waves leaves
        EXPECT_NEAR(m.a, a, 1e-3);
        EXPECT_NEAR(m.b, b, 1e-3);
        EXPECT_GT(m.correlation, 0.999);
      }
}

TEST(Icgn, GainAndOffsetDoNotMatter) {
  const RectifiedImage left = image_of(texture);
  const RowMatch plain = refine(left, warped(2.4, 0.05, 0.02, 1, 0), 2);
  const RowMatch lit = refine(left, warped(2.4, 0.05, 0.02, 0.45, 70), 2);
  EXPECT_NEAR(plain.d, lit.d, 2e-4);
  EXPECT_NEAR(plain.correlation, lit.correlation, 1e-4);
}

TEST(Icgn, PredictedSigmaIsTheSampledOne) {
  const double noise = 3;
  double sum = 0, sum2 = 0, predicted = 0;
  const int trials = 400;
  for (int t = 0; t < trials; ++t) {
    const RectifiedImage left = image_of(texture, noise, 2 * t + 1);
    const RectifiedImage right = warped(2.35, 0.03, -0.02, 1, 0, noise, 2 * t + 2);
    const RowMatch m = refine(left, right, 2.2F);
    ASSERT_EQ(m.outcome, kernels::kConverged);
    sum += m.d, sum2 += m.d * m.d;
    // Here neither image was resampled before: only the kernel's own interpolation damps, of one of the two.
    predicted += static_cast<double>(m.noise) * m.texture / ((1 + 0.87423) / 2);
  }
  const double mean = sum / trials, variance = sum2 / trials - mean * mean;
  // 400 draws fix a variance to 7 %.
  EXPECT_NEAR(variance / (predicted / trials), 1, 0.25);
  EXPECT_NEAR(mean, 2.35, 5 * std::sqrt(variance / trials) + 2e-3);
}

// texture = [H^-1]_dd with gain and offset projected out: against a numerical least-squares problem in (d, a, b, gain,
// offset).
TEST(Icgn, HessianAgainstFiniteDifferences) {
  const RectifiedImage left = image_of(texture);
  const RowMatch m = refine(left, left, 0.1F);
  Eigen::MatrixXd J(15 * 15, 5);
  const double h = 1e-5;
  int row = 0;
  for (int j = -7; j <= 7; ++j)
    for (int i = -7; i <= 7; ++i, ++row) {
      const double x = 60 + i, y = 40 + j, slope = (texture(x + h, y) - texture(x - h, y)) / (2 * h);
      J.row(row) << slope, slope * i, slope * j, texture(x, y), 1;
    }
  const double expected = Eigen::MatrixXd((J.transpose() * J).inverse())(0, 0);
  EXPECT_NEAR(m.texture / expected, 1, 0.03);
}

TEST(Icgn, RefusesWithAReason) {
  const RectifiedImage left = image_of(texture), flat = image_of([](double, double) { return 50; });
  EXPECT_EQ(refine(left, left, 0, 3, 40).outcome, kernels::kLeftView);
  EXPECT_EQ(refine(left, left, 58, 60, 40).outcome, kernels::kRightView);
  EXPECT_EQ(refine(flat, left, 0).outcome, kernels::kFlat);
  const RowMatch on_flat = refine(left, flat, 0);
  EXPECT_TRUE(on_flat.outcome != kernels::kConverged || std::abs(on_flat.correlation) < 0.1) << on_flat.correlation;
  RectifiedImage clipped = image_of(texture);
  for (std::size_t i = 0; i < clipped.mask.size(); i += 2)
    clipped.mask[i] = static_cast<std::uint8_t>(Reason::kSaturated);
  EXPECT_EQ(refine(clipped, left, 0).outcome, kernels::kClipped);
}

// A few clipped pixels are left out, not taken at their clipped value.
TEST(Icgn, MaskedPixelsDoNotCount) {
  RectifiedImage left = image_of(texture);
  const RectifiedImage right = warped(1.5, 0, 0, 1, 0);
  for (int k = 0; k < 12; ++k) {
    const std::size_t i = static_cast<std::size_t>(36 + k % 5) * 120 + 55 + k;
    left.mask[i] = static_cast<std::uint8_t>(Reason::kSaturated);
    left.value.pixels[i] = 4000;
  }
  const RowMatch m = refine(left, right, 1.2F);
  ASSERT_EQ(m.outcome, kernels::kConverged);
  EXPECT_NEAR(m.d, 1.5, 5e-3);
}

TEST(Icgn, BothInstructionSetsGiveTheSameBits) {
  if (detect_isa() != Isa::kAvx2) GTEST_SKIP() << "this machine has no AVX2";
  const RectifiedImage left = image_of(texture, 2, 1), right = warped(2.4, 0.05, 0.02, 0.7, 9, 2, 2);
  for (int half : {4, 7, 8, 11, 20}) {
    RowMatch a{}, b{};
    a.d = b.d = 2;
    const kernels::RefineOptions o{half, 20, 0, 4};
    kernels::refine_row_baseline(left.plane(), right.plane(), 60, 40, o, &a);
    kernels::refine_row_avx2(left.plane(), right.plane(), 60, 40, o, &b);
    EXPECT_EQ(a.d, b.d);
    EXPECT_EQ(a.correlation, b.correlation);
    EXPECT_EQ(a.noise, b.noise);
  }
}

}  // namespace
}  // namespace sgrt
