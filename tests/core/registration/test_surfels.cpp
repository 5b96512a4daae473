// The look-up structure against a tree and against the surface it was sampled from.
#include "registration/surfels.hpp"

#include "core/nearest.hpp"
#include "registration/pass.hpp"
#include "registration/reference.hpp"
#include "scenes.hpp"

namespace sgrt {
namespace {

using namespace test;

TEST(Surfels, EveryPointNearTheSurfaceFindsOneThatATreeWouldTake) {
  Draw draw(1);
  const Surface s = sample(torso, 20000, 0.1, draw);
  const SurfelField field = make_surfels(kSilent, s, {});
  Points q(static_cast<Eigen::Index>(field.levels[0].surfels.size()) - 1, 3);
  for (Eigen::Index i = 0; i < q.rows(); ++i) {
    q.row(i) = (point_of(field.levels[0].surfels[static_cast<std::size_t>(i) + 1]) + field.centre).transpose();
  }
  const Nearest tree(kSilent, q);
  int missed = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x = torso(draw.uniform(0.02, 0.98), draw.uniform(0.02, 0.98)) + draw.vec3(0.3 * field.cell);
    const std::int32_t code = find_surfel(field, x - field.centre, 0, 1);
    if (code < 0) {
      ++missed;
      continue;
    }
    const double found = (point_of(surfel_of(field, code)) + field.centre - x).norm();
    const double nearest = std::sqrt(tree.nearest(x, 1e9).distance2);
    EXPECT_LT(found, nearest + 1.1 * field.cell);
  }
  EXPECT_EQ(missed, 0);
}

// The pass's residuals of exact points, as distances from the surface that noisy samples stand for.
TEST(Surfels, HeightsAreThoseOfTheSurfaceWithinTheirVariance) {
  Draw draw(2);
  const Surface s = sample(torso, 20000, 0.2, draw);
  const auto reference = prepare_reference(kSilent, s, nullptr);
  LivePoints live;
  read_live(sample(torso, 5000, 0, draw), live);
  std::vector<float> r(live.x.size());
  PassOptions o;
  o.unit_noise = true;
  o.r = r.data();
  do_pass(kSilent, reference->field, live, Pose{}, o);
  double sum2 = 0;
  int count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(live.count); ++i) {
    if (!(r[i] == r[i])) continue;
    sum2 += r[i] * r[i];
    ++count;
  }
  EXPECT_GT(count, 4900);
  const double rms = std::sqrt(sum2 / count);
  EXPECT_LT(rms, 0.12);  // of 0.2 mm samples
  EXPECT_NEAR(rms, std::sqrt(reference->typical_height), 0.04);
  EXPECT_NEAR(std::sqrt(reference->field.roughness2), 0.2, 0.02);
}

TEST(Surfels, InformationIsThatOfCentralDifferencesOfTheGradient) {
  Draw draw(3);
  const auto reference = prepare_reference(kSilent, sample(torso, 8000, 0.05, draw), nullptr);
  LivePoints live;
  read_live(sample(torso, 4000, 0, draw), live);
  PassOptions o;
  o.unit_noise = true;
  const SurfelField& field = reference->field;
  const Sums at = do_pass(kSilent, field, live, Pose{}, o);
  for (int k = 0; k < 6; ++k) {
    Vec6 h = Vec6::Zero();
    h[k] = k < 3 ? 2e-4 : 0.02;
    const Sums plus = do_pass(kSilent, field, live, motion_about(h, field.centre), o);
    const Sums minus = do_pass(kSilent, field, live, motion_about(-h, field.centre), o);
    const Vec6 slope = (plus.g - minus.g) / (2 * h[k]);
    Vec6 unit;
    unit << Vec3::Constant(1 / field.lever), Vec3::Ones();
    const Vec6 error = unit.cwiseProduct(slope - at.A.col(k)) * unit[k];
    EXPECT_LT(error.norm(), 0.05 * at.weight) << k;  // the second derivative of n and what changes surfels
  }
}

TEST(Surfels, SameBitsAtEveryInstructionSet) {
  if (detect_isa() != Isa::kAvx2) GTEST_SKIP() << "this machine has no AVX2";
  Draw draw(4);
  const auto reference = prepare_reference(kSilent, sample(torso, 5000, 0.2, draw), nullptr);
  LivePoints live;
  read_live(sample(torso, 3333, 0.2, draw), live);
  PassOptions o;
  o.scale = 1;
  sgrt::Run avx2;
  avx2.isa = Isa::kAvx2;
  const Sums a = do_pass(kSilent, reference->field, live, Pose{}, o),
             b = do_pass(avx2, reference->field, live, Pose{}, o);
  EXPECT_EQ(a.A, b.A);
  EXPECT_EQ(a.g, b.g);
  EXPECT_EQ(a.cost, b.cost);
}

TEST(Surfels, StraysAndDuplicatesDoNotMatter) {
  Draw draw(5);
  Surface s = sample(torso, 5000, 0.1, draw);
  const double cell = make_surfels(kSilent, s, {}).cell;
  s.points.row(0) << 9e4, 9e4, -9e4;
  for (int i = 1; i < 500; ++i) s.points.row(i) = s.points.row(600);
  const SurfelField field = make_surfels(kSilent, s, {});
  EXPECT_NEAR(field.cell, cell, 0.2 * cell);
}

}  // namespace
}  // namespace sgrt
