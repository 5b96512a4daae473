// Textbook ICP: each residual and each kernel against the truth, steps against exact ones, weights against their
// papers.
#include "registration/residual.hpp"

#include <algorithm>

#include "registration/icp.hpp"
#include "registration/robust.hpp"
#include "scenes.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

using namespace test;

const Vec3 kIso(10, 20, -80);

struct Scene {
  std::shared_ptr<const Reference> reference;
  Surface live;
  Pose D;
};

Scene scene(double sigma, unsigned seed) {
  Draw draw(seed);
  Scene s;
  s.D = displacement(8, 3, kIso, draw);
  s.reference = prepare_reference(kSilent, sample(torso, 5000, sigma, draw), nullptr);
  s.live = estimate_normals(kSilent, moved(sample(torso, 2000, sigma, draw), s.D), NormalsOptions{});
  return s;
}

double error_mm(const IcpResult& r, const Pose& D) {
  return about(r.reference_from_live * D, kIso).t.norm();
}

IcpResult run(const Scene& s, Residual residual, Kernel kernel, double keep = 1) {
  IcpOptions o;
  o.residual = residual;
  o.kernel = kernel;
  o.keep_share = keep;
  o.max_iterations = 500;
  o.step_tolerance = 1e-3;
  return align(kSilent, *s.reference, s.live, kIso, Pose{}, o);
}

constexpr Residual kResiduals[] = {Residual::kPlane, Residual::kPointSvd, Residual::kPointQuaternion,
                                   Residual::kSymmetric};
constexpr Kernel kKernels[] = {Kernel::kAuto, Kernel::kNone, Kernel::kTukey, Kernel::kWelsch};

// REQ-ICP-007
TEST(Residual, EachWithEachKernelFindsTheTruth) {
  const Scene s = scene(0.1, 1);
  for (const Residual residual : kResiduals) {
    for (const Kernel kernel : kKernels) {
      const IcpResult r = run(s, residual, kernel);
      ASSERT_EQ(r.status, Status::kOk) << static_cast<int>(residual) << static_cast<int>(kernel) << r.message;
      EXPECT_EQ(r.verdict, Verdict::kOk) << r.verdict_words;
      EXPECT_LT(error_mm(r, s.D), 0.1) << static_cast<int>(residual) << static_cast<int>(kernel);
      EXPECT_GT(r.covariance(3, 3), 0);
    }
  }
}

// A lump that the reference does not have: least squares follow it, robust kernels and trimming do not.
TEST(Residual, OutliersCountOnlyWithLeastSquares) {
  Scene s = scene(0.1, 2);
  Draw draw(3);
  for (std::int64_t i = 0; i < s.live.size(); i += 5) s.live.points(i, 2) += draw.uniform(2, 5);
  EXPECT_GT(error_mm(run(s, Residual::kPlane, Kernel::kNone), s.D), 0.5);
  for (const Residual residual : kResiduals) {
    EXPECT_LT(error_mm(run(s, residual, Kernel::kTukey), s.D), 0.15) << static_cast<int>(residual);
    EXPECT_LT(error_mm(run(s, residual, Kernel::kWelsch), s.D), 0.15) << static_cast<int>(residual);
    const IcpResult trimmed = run(s, residual, Kernel::kNone, 0.7);
    EXPECT_LT(error_mm(trimmed, s.D), 0.15) << static_cast<int>(residual) << trimmed.message;
  }
}

std::vector<ClosestPair> pairs_of(const Pose& move, Draw& draw) {
  std::vector<ClosestPair> pairs(50);
  for (ClosestPair& c : pairs) {
    c.y = draw.vec3(100);
    c.q = move * c.y;
    c.n = draw.direction();
    c.m = c.n;
    c.r = c.n.dot(c.y - c.q);
    c.w = draw.uniform(0.5, 2);
  }
  return pairs;
}

TEST(Residual, StepsOfKnownPairs) {
  Draw draw(4);
  Vec6 twist;
  twist << 0.3, -0.2, 0.4, 5, -3, 2;
  const Pose move{so3_exp(twist.head<3>()), twist.tail<3>()};
  const auto pairs = pairs_of(move, draw);
  EXPECT_LT((step_of(Residual::kPointSvd, pairs, 100) - twist).norm(), 1e-9);
  EXPECT_LT((step_of(Residual::kPointQuaternion, pairs, 100) - twist).norm(), 1e-9);
  const Vec6 small = 1e-5 * twist;
  const auto near = pairs_of(Pose{so3_exp(small.head<3>()), small.tail<3>()}, draw);
  EXPECT_LT((step_of(Residual::kPlane, near, 100) - small).norm(), 1e-8);
  EXPECT_LT((step_of(Residual::kSymmetric, near, 100) - small).norm(), 1e-8);
}

// Rusinkiewicz' point: any two places of one sphere have the symmetric distance 0.
TEST(Residual, ASphereSlidesOnItselfAtNoCost) {
  Draw draw(5);
  std::vector<ClosestPair> pairs(40);
  for (ClosestPair& c : pairs) {
    c.n = draw.direction();
    c.m = so3_exp(draw.vec3(0.3)) * c.n;
    c.q = 50 * c.n;
    c.y = 50 * c.m;
    c.r = c.n.dot(c.y - c.q);
    c.w = 1;
  }
  EXPECT_LT(step_of(Residual::kSymmetric, pairs, 50).norm(), 1e-9);
  EXPECT_GT(step_of(Residual::kPlane, pairs, 50).norm(), 0.1);
}

TEST(Residual, RefusesWhatItCannot) {
  Scene s = scene(0.1, 6);
  expect_error(Status::kInvalidArgument, "keep_share", [&] { run(s, Residual::kPlane, Kernel::kAuto, 0); });
  s.live.normals.resize(0, 3);
  expect_error(Status::kInvalidArgument, "normals", [&] { run(s, Residual::kSymmetric, Kernel::kAuto); });
  s.live = moved(s.live, Pose{Mat3::Identity(), Vec3(0, 0, 500)});
  EXPECT_EQ(run(s, Residual::kPointSvd, Kernel::kTukey).status, Status::kNotFound);
}

TEST(Robust, Weights) {
  EXPECT_EQ(weight_of(Kernel::kNone, 100), 1);
  for (const Kernel kernel : {Kernel::kTukey, Kernel::kWelsch}) {
    EXPECT_EQ(weight_of(kernel, 0), 1);
    EXPECT_GT(weight_of(kernel, 1), 0.85);
    EXPECT_LT(weight_of(kernel, 6), 0.02);
  }
  EXPECT_NEAR(weight_of(Kernel::kWelsch, 2.985), std::exp(-1.0), 1e-15);
  EXPECT_NEAR(weight_of(Kernel::kTukey, 4.685 / std::sqrt(2.0)), 0.25, 1e-15);
  EXPECT_EQ(weight_of(Kernel::kTukey, 4.7), 0);
}

TEST(Robust, TheScaleShrinksToItsLeast) {
  GraduatedScale scale;
  EXPECT_EQ(scale.next(2), 6);
  EXPECT_FALSE(scale.settled());
  EXPECT_NEAR(scale.next(2), 4.2, 1e-12);
  for (int i = 0; i < 3; ++i) scale.next(2);
  EXPECT_EQ(scale.next(2), 2.0);
  EXPECT_TRUE(scale.settled());
}

TEST(Robust, MedianIsExact) {
  Draw draw(7);
  std::vector<float> scratch;
  EXPECT_EQ(median_of({}, scratch), 0);
  for (const std::size_t n : {1U, 2U, 3U, 10U, 999U, 1000U}) {
    std::vector<float> v(n);
    for (float& x : v) x = static_cast<float>(std::pow(10.0, draw.uniform(-6, 4)));
    if (n == 10) std::fill(v.begin(), v.end(), 3.0F);
    std::vector<float> sorted = v;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(median_of(v, scratch), static_cast<double>(sorted[n / 2]));
    EXPECT_EQ(trim_limit(v, 0.25, scratch), sorted[static_cast<std::size_t>(0.25 * static_cast<double>(n - 1))]);
    EXPECT_TRUE(std::isinf(trim_limit(v, 1, scratch)));
  }
}

}  // namespace
}  // namespace sgrt
