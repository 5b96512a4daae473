// Registration without a start: from anywhere, of a part, and refused where the answer is not one.
#include "registration/coarse.hpp"

#include "core/parallel.hpp"
#include "registration/icp.hpp"
#include "scenes.hpp"

namespace sgrt {
namespace {

using namespace test;

const Vec3 kIso(10, 20, -80);

Pose anywhere(Draw& draw) {
  return about(Pose{so3_exp(kPi * draw.uniform(0, 1) * draw.direction()), draw.vec3(300)}, -kIso);
}

IcpResult run(const Surface& reference, const Surface& live) {
  IcpOptions o;
  o.anywhere = true;
  return align(kSilent, reference, live, kIso, nullptr, {}, o);
}

// REQ-COARSE-001
TEST(Coarse, FromAnywhere) {
  Draw draw(1);
  for (int i = 0; i < 8; ++i) {
    const Pose D = anywhere(draw);
    Surface live = sample(torso, 4000, 0.2, draw);
    if (i % 2 == 1) {  // one pod is blocked: 60 % are left
      for (std::int64_t k = 0; k < live.size(); ++k) {
        if (live.points(k, 0) < -30) live.points.row(k).setConstant(std::nan(""));
      }
    }
    const IcpResult r = run(sample(torso, 4000, 0.2, draw), moved(live, D));
    ASSERT_EQ(r.status, Status::kOk) << r.message;
    EXPECT_LT(about(r.reference_from_live * D, kIso).t.norm(), 0.3);
    EXPECT_GT(r.coarse_score, 0.5);
    EXPECT_LT(r.coarse_runner_up, 0.6 * r.coarse_score);
  }
}

TEST(Coarse, ASphereIsDegenerateAndNamed) {
  Draw draw(2);
  const IcpResult r = run(sample(sphere, 3000, 0.2, draw), moved(sample(sphere, 3000, 0.2, draw), anywhere(draw)));
  EXPECT_EQ(r.status, Status::kDegenerate) << r.verdict_words;
  EXPECT_EQ(r.free.size(), 3u);
  EXPECT_TRUE(std::isnan(r.reference_from_live.t[0]));
}

// A saddle that half a turn about the vertical lays on itself.
// REQ-COARSE-002
TEST(Coarse, TwoAnswersAreNone) {
  const Shape saddle = [](double u, double v) {
    const double x = 300 * u - 150, y = 400 * v - 200;
    return Vec3(x, y, 40 * std::cos(x / 60) * std::cos(y / 75) - x * x / 400 + x * y / 500);
  };
  Draw draw(3);
  const IcpResult r = run(sample(saddle, 4000, 0.2, draw), moved(sample(saddle, 4000, 0.2, draw), anywhere(draw)));
  EXPECT_EQ(r.status, Status::kDegenerate) << r.verdict_words;
  EXPECT_NE(r.message.find("two poses fit nearly as well"), std::string::npos) << r.message;
  EXPECT_TRUE(std::isnan(r.reference_from_live.t[0]));
}

// REQ-COARSE-001
TEST(Coarse, AnotherBodyIsNotFoundOrWeak) {
  Draw draw(4);
  const Shape bowl = [](double u, double v) {
    const double x = 200 * u - 100, y = 200 * v - 100;
    return Vec3(x, y, (x * x + y * y) / 40 + 10 * std::sin(x / 9));
  };
  const IcpResult r = run(sample(torso, 4000, 0.2, draw), sample(bowl, 4000, 0.2, draw));
  EXPECT_FALSE(r.status == Status::kOk && r.verdict == Verdict::kOk) << r.verdict_words;
}

// REQ-DET-003
TEST(Coarse, SameBitsAtAnyNumberOfThreads) {
  Draw draw(5);
  const Surface reference = sample(torso, 2000, 0.2, draw),
                live = moved(sample(torso, 2000, 0.2, draw), anywhere(draw));
  const IcpResult one = run(reference, live);
  IcpOptions o;
  o.anywhere = true;
  for (const int threads : {2, 3}) {
    ThreadPool pool(threads);
    sgrt::Run many;
    many.pool = &pool;
    const IcpResult r = align(many, reference, live, kIso, nullptr, {}, o);
    EXPECT_EQ(r.reference_from_live.t, one.reference_from_live.t);
    EXPECT_EQ(r.coarse_score, one.coarse_score);
    EXPECT_EQ(r.coarse_runner_up, one.coarse_runner_up);
  }
}

}  // namespace
}  // namespace sgrt
