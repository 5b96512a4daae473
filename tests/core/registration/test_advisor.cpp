// Advice on regions: what they see badly is said, the errors are those that registrations make, the proposal is better.
#include "registration/advisor.hpp"

#include <algorithm>

#include "registration/icp.hpp"
#include "scenes.hpp"

namespace sgrt {
namespace {

using namespace test;

const Vec3 kIso(0, 0, -60);

Roi square(double x, double y, double half) {
  return roi_from_polygon({{x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}});
}

// REQ-ICP-010
TEST(Advisor, RanksAsRegistrationsErr) {
  Draw draw(1);
  const Surface reference = sample(torso, 6000, 0.3, draw);
  const std::vector<Roi> rois = {square(60, 60, 60), square(0, -120, 40), square(0, 0, 130)};
  std::vector<const Roi*> pointers;
  for (const Roi& roi : rois) pointers.push_back(&roi);
  AdviceOptions o;
  o.live_sigma = 0.3;
  const Advice advice = advise(kSilent, reference, pointers, kIso, o);
  ASSERT_EQ(advice.candidates.size(), 3U);
  EXPECT_EQ(advice.order[0], 2);
  std::vector<double> real(3, 0);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto prepared = prepare_reference(kSilent, reference, &rois[k]);
    const int trials = 30;
    for (int i = 0; i < trials; ++i) {
      const IcpResult r = align(kSilent, *prepared, sample(torso, 6000, 0.3, draw), kIso, Pose{}, {});
      ASSERT_EQ(r.status, Status::kOk) << r.message;
      real[k] += about(r.reference_from_live, kIso).t.squaredNorm() / trials;
    }
    EXPECT_GT(advice.candidates[k].mm / std::sqrt(real[k]), 0.5) << k;
    EXPECT_LT(advice.candidates[k].mm / std::sqrt(real[k]), 2) << k;
  }
  EXPECT_TRUE(real[2] < real[0] && real[2] < real[1]);
}

TEST(Advisor, FlagsACylinderAndProposesWhatIsNone) {
  Draw draw(2);
  // A limb: a cylinder with an elbow at one end.
  const Shape limb = [](double u, double v) {
    Vec3 x = cylinder(u, v);
    if (x.y() > 100) x.x() += 0.004 * (x.y() - 100) * (x.y() - 100);
    x.z() += 14 * std::exp(-0.5 * ((x.y() - 150) * (x.y() - 150) + (x.x() - 50) * (x.x() - 50)) / 400);
    return x;
  };
  const Surface reference = sample(limb, 6000, 0.2, draw);
  const Roi straight = square(0, -90, 80), far = square(900, 900, 20);
  const Advice advice = advise(kSilent, reference, {&straight, &far}, kIso, {});
  EXPECT_TRUE(advice.candidates[0].flagged);
  EXPECT_NE(advice.candidates[0].words.find("LNG"), std::string::npos) << advice.candidates[0].words;
  EXPECT_TRUE(advice.candidates[1].flagged);
  EXPECT_EQ(advice.candidates[1].share, 0);
  EXPECT_TRUE(advice.better);
  EXPECT_FALSE(advice.proposal.flagged) << advice.proposal.words;
  EXPECT_LT(advice.proposal.share, 1.1 * advice.candidates[0].share);
  // The proposal keeps its promise.
  const Roi roi = roi_from_polygon([&] {
    std::vector<Vec2> vertices;
    for (Eigen::Index i = 0; i < advice.polygon.rows(); ++i) vertices.push_back(advice.polygon.row(i).transpose());
    return vertices;
  }());
  const IcpResult r = align(kSilent, reference, sample(limb, 6000, 0.2, draw), kIso, &roi, Pose{}, {});
  EXPECT_EQ(r.verdict, Verdict::kOk) << r.verdict_words;
  EXPECT_LT(about(r.reference_from_live, kIso).t.norm(), 4 * advice.proposal.mm);
}

TEST(Advisor, RefusesNothingToAdviseOn) {
  Draw draw(3);
  expect_error(Status::kInsufficientData, "6", [&] { advise(kSilent, sample(torso, 3, 0, draw), {}, kIso, {}); });
  const Advice free = advise(kSilent, sample(torso, 2000, 0.2, draw), {}, kIso, {});
  EXPECT_TRUE(free.order.empty() && free.better && free.proposal.share < 0.45);
}

}  // namespace
}  // namespace sgrt
