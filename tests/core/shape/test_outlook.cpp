// The bias of a disc as its drifts foretell it.

#include "shape/outlook.hpp"

#include <cmath>

#include "expect.hpp"

namespace sgrt {
namespace {

constexpr std::size_t kRungs = 12;
constexpr double kNoise = 1e-3;  // of the tensor at a radius of 10, 1/mm

struct Bench {
  double radii[kRungs];
  Drift drifts[kRungs];
  double variance(double r) const { return kNoise * kNoise * std::pow(10 / r, 6); }
};

Mat3 tangential(double a, double c) {
  return Vec3(a, c, 0).asDiagonal();
}

// bias(r): of the tensor.
template <class F>
Bench bench(F&& bias) {
  Bench b;
  for (std::size_t k = 0; k < kRungs; ++k) b.radii[k] = 2.2 * std::pow(1.25, static_cast<double>(k));
  for (std::size_t k = 0; k + 1 < kRungs; ++k) {
    b.drifts[k].mean = bias(b.radii[k + 1]) - bias(b.radii[k]);
    b.drifts[k].variance = (b.variance(b.radii[k]) - b.variance(b.radii[k + 1])) / 6;
  }
  return b;
}

TEST(ShapeOutlook, FindsTheBiasThatFollowsTheLaw) {
  const Mat3 rate = tangential(-4e-5, 1e-5);
  const Bench b = bench([&](double r) { return Mat3(r * r * rate); });
  const Outlook o = outlook_of(b.drifts, b.radii, kRungs, 2, 10, b.variance(10));
  const Mat3 bias = 100 * rate;
  EXPECT_LT((o.bias - bias).norm(), 0.2 * bias.norm());
  EXPECT_GT(o.left2, (o.bias - bias).squaredNorm());
  EXPECT_LT(o.left2, 0.2 * bias.squaredNorm());
  EXPECT_GT(o.inflate, 1);
  EXPECT_LT(o.inflate, 2);
  EXPECT_NEAR(o.mean_part, 1.5 * 1.5 / 17, 0.05);  // H has -1.5e-5 of a tensor whose squared norm is 17e-10
}

// Drifts that noise explains are not taken for bias: nothing is taken off and nothing is added.
TEST(ShapeOutlook, NoiseIsNotBias) {
  Bench b = bench([](double) { return Mat3(Mat3::Zero()); });
  double sign = 1;
  for (std::size_t k = 0; k + 1 < kRungs; ++k, sign = -sign)
    b.drifts[k].mean = tangential(0.5 * sign * std::sqrt(b.drifts[k].variance), 0);
  const Outlook o = outlook_of(b.drifts, b.radii, kRungs, 2, 10, b.variance(10));
  EXPECT_LT(o.bias.norm(), 0.2 * kNoise);
  EXPECT_LT(o.left2, 0.1 * kNoise * kNoise);
}

// A bias that has stopped growing at the radius asked for is as large as it has become, not none.
TEST(ShapeOutlook, BiasThatTurnsBackIsSaid) {
  const Mat3 rate = tangential(-1e-3, 2e-4);
  const Bench b = bench([&](double r) { return Mat3(std::min(r * r, 64.0) * rate); });
  const Outlook o = outlook_of(b.drifts, b.radii, kRungs, 2, 12, b.variance(12));
  EXPECT_GT(std::sqrt(o.left2) + o.bias.norm(), 0.25 * 64 * rate.norm());
  EXPECT_GT(std::sqrt(o.left2), 5 * std::sqrt(b.variance(12)));
}

// Nodes that differ by more than noise leave a doubt of that size.
TEST(ShapeOutlook, SpreadIsDoubt) {
  const Mat3 rate = tangential(-4e-5, 1e-5);
  Bench b = bench([&](double r) { return Mat3(r * r * rate); });
  const double before = outlook_of(b.drifts, b.radii, kRungs, 2, 10, b.variance(10)).left2;
  for (std::size_t k = 0; k + 1 < kRungs; ++k) b.drifts[k].spread = b.drifts[k].mean.squaredNorm();
  const Outlook o = outlook_of(b.drifts, b.radii, kRungs, 2, 10, b.variance(10));
  EXPECT_GT(o.left2, 3 * before);
  EXPECT_LT(o.bias.norm(), 70 * rate.norm());
}

// Without noise, without drift, without any rung.
TEST(ShapeOutlook, Degenerate) {
  Bench b = bench([](double) { return Mat3(Mat3::Zero()); });
  for (Drift& d : b.drifts) d.variance = 0;
  const Outlook flat = outlook_of(b.drifts, b.radii, kRungs, 2, 10, 0);
  EXPECT_EQ(flat.bias.norm(), 0);
  EXPECT_EQ(flat.left2, 0);
  EXPECT_TRUE(std::isfinite(flat.mean_part));
  for (Drift& d : b.drifts) d.variance = -1;
  EXPECT_EQ(outlook_of(b.drifts, b.radii, kRungs, 2, 10, 1e-6).left2, 0);
  EXPECT_EQ(outlook_of(b.drifts, b.radii, 1, 2, 10, 1e-6).inflate, 1);
}

}  // namespace
}  // namespace sgrt
