// Temporal filter: noise falls as predicted, motion is followed without lag, what is absent stays absent.
#include "surface/temporal.hpp"

#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "scenes.hpp"

namespace sgrt {
namespace {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kSide = 64;

// A plane at height z, with noise along its normal.
Surface frame_at(double z, double sigma, Draw& draw) {
  Surface s;
  s.height = s.width = kSide;
  s.points.resize(kSide * kSide, 3);
  s.normals = Points::Zero(kSide * kSide, 3);
  s.normals.col(2).setOnes();
  s.sigma = Eigen::VectorXd::Constant(kSide * kSide, sigma);
  for (int i = 0; i < kSide * kSide; ++i) s.points.row(i) << i % kSide, i / kSide, z + sigma * gauss(draw);
  return s;
}

double mean_z(const Surface& s) {
  return s.points.col(2).mean();
}
double rms_z(const Surface& s, double z) {
  return std::sqrt((s.points.col(2).array() - z).square().mean());
}
std::int64_t count_of(const TemporalFilter& f, TemporalState state) {
  return f.counts()[static_cast<std::size_t>(state)];
}

// REQ-SURF-015
TEST(Temporal, NoiseFallsAsPredicted) {
  Draw draw(1);
  TemporalFilter f({4, 0});
  std::shared_ptr<Surface> out;
  for (int k = 0; k < 16; ++k) out = f.push(kSilent, frame_at(5, 0.4, draw), 0.1 * k);
  EXPECT_NEAR(rms_z(*out, 5), 0.1, 0.005);
  EXPECT_NEAR(out->sigma.mean(), 0.1, 0.002);  // a few pixels have started again by chance
  EXPECT_GT(count_of(f, TemporalState::kAveraged), 4000);
}

TEST(Temporal, SigmaIsHonestWhereSkinWanders) {
  // Each pixel wanders by itself by 0.1 mm in a second: what remains of noise and lag together is the sigma that is
  // said.
  Draw draw(2);
  TemporalFilter f({6, 0.1});
  Surface truth = frame_at(0, 0, draw);
  std::shared_ptr<Surface> out;
  for (int k = 0; k < 40; ++k) {
    Surface frame = truth;
    for (int i = 0; i < kSide * kSide; ++i) {
      truth.points(i, 2) += 0.1 * gauss(draw);
      frame.points(i, 2) = truth.points(i, 2) + 0.3 * gauss(draw);
    }
    frame.sigma.setConstant(0.3);
    out = f.push(kSilent, frame, k);
  }
  const Eigen::VectorXd error = out->points.col(2) - truth.points.col(2);
  EXPECT_NEAR(std::sqrt(error.squaredNorm() / static_cast<double>(error.size())), out->sigma.mean(), 0.01);
  EXPECT_LT(out->sigma.mean(), 0.18);
}

// REQ-SURF-015
TEST(Temporal, AShiftOfHalfASigmaIsSeenByThePatch) {
  Draw draw(3);
  TemporalFilter f({});
  for (int k = 0; k < 20; ++k) f.push(kSilent, frame_at(0, 0.4, draw), 0.1 * k);
  const auto out = f.push(kSilent, frame_at(0.2, 0.4, draw), 2);
  EXPECT_EQ(count_of(f, TemporalState::kMoved), kSide * kSide);
  EXPECT_NEAR(mean_z(*out), 0.2, 0.03);
  EXPECT_NEAR(out->sigma.mean(), 0.4, 1e-12);
}

TEST(Temporal, BreathingIsFollowed) {
  Draw draw(4);
  TemporalFilter f({});
  double worst = 0;
  for (int k = 0; k < 60; ++k) {
    const double z = 5 * std::sin(2 * kPi * 0.25 * 0.1 * k);
    const auto out = f.push(kSilent, frame_at(z, 0.3, draw), 0.1 * k);
    worst = std::max(worst, std::abs(mean_z(*out) - z));
  }
  EXPECT_LT(worst, 0.05);
}

TEST(Temporal, AMovingHandLeavesTheRestAlone) {
  Draw draw(5);
  TemporalFilter f({});
  for (int k = 0; k < 20; ++k) f.push(kSilent, frame_at(0, 0.3, draw), 0.1 * k);
  Surface frame = frame_at(0, 0.3, draw);
  for (int i = 0; i < kSide * kSide; ++i) {
    if (i % kSide < 10 && i / kSide < 10) frame.points(i, 2) += 20;
  }
  const auto out = f.push(kSilent, frame, 2);
  EXPECT_NEAR(out->points(5 * kSide + 5, 2), 20, 1.5);
  EXPECT_LT(out->sigma[60 * kSide + 60], 0.1);  // far from the hand the average goes on
}

TEST(Temporal, AbsentStaysAbsentAndComesBack) {
  Draw draw(6);
  TemporalFilter f({4, 0});
  f.push(kSilent, frame_at(0, 0.3, draw), 0);
  Surface holed = frame_at(0, 0.3, draw);
  holed.points.row(100).setConstant(kNan);
  auto out = f.push(kSilent, holed, 1);
  EXPECT_FALSE(out->present(100));
  EXPECT_EQ(count_of(f, TemporalState::kAbsent), 1);
  out = f.push(kSilent, frame_at(0, 0.3, draw), 2);
  EXPECT_TRUE(out->present(100));
  EXPECT_LT(out->sigma[100], 0.25);  // of two frames
  EXPECT_LT(out->sigma[101], out->sigma[100]);
}

TEST(Temporal, APointWithoutNormalPasses) {
  Draw draw(7);
  TemporalFilter f({});
  Surface frame = frame_at(0, 0.3, draw);
  frame.normals.row(7).setConstant(kNan);
  for (int k = 0; k < 3; ++k) {
    const auto out = f.push(kSilent, frame, k);
    EXPECT_EQ(out->points.row(7), frame.points.row(7));
    EXPECT_EQ(f.states()[7], TemporalState::kStarted);
  }
}

// REQ-DET-009
TEST(Temporal, SameBitsAtAnyThreadCountAndNothingWrittenUnderAHolder) {
  Draw draw(8);
  std::vector<Surface> frames;
  for (int k = 0; k < 4; ++k) frames.push_back(frame_at(0.1 * k, 0.3, draw));
  ThreadPool pool(3);
  const sgrt::Run run{&pool};
  TemporalFilter a({}), b({});
  for (int k = 0; k < 4; ++k) {
    const std::shared_ptr<Surface> one = a.push(kSilent, frames[static_cast<std::size_t>(k)], k);
    const Points copy = one->points;
    EXPECT_EQ(b.push(run, frames[static_cast<std::size_t>(k)], k)->points, one->points);
    a.push(kSilent, frames[static_cast<std::size_t>(k)], k);
    EXPECT_EQ(one->points, copy);
    b.push(run, frames[static_cast<std::size_t>(k)], k);
  }
}

TEST(Temporal, Refuses) {
  Draw draw(9);
  expect_error(Status::kInvalidArgument, "motion_sigmas is 0", [] { TemporalFilter({0, 1}); });
  expect_error(Status::kInvalidArgument, "drift_mm is -1", [] { TemporalFilter({4, -1}); });
  TemporalFilter f({});
  const Surface frame = frame_at(0, 0.3, draw);
  f.push(kSilent, frame, 5);
  expect_error(Status::kInvalidArgument, "time_s is 4", [&] { f.push(kSilent, frame, 4); });
  expect_error(Status::kInvalidArgument, "time_s", [&] { f.push(kSilent, frame, kNan); });
  Surface other = frame;
  other.height = kSide / 2;
  other.width = 2 * kSide;
  expect_error(Status::kInvalidArgument, "32 x 128, expected that of the push before, 64 x 64",
               [&] { f.push(kSilent, other, 6); });
  other.height = other.width = 0;
  expect_error(Status::kInvalidArgument, "organised", [&] { f.push(kSilent, other, 6); });
  other = frame;
  other.sigma.resize(0);
  expect_error(Status::kInvalidArgument, "neither sigma", [&] { f.push(kSilent, other, 6); });
  other = frame;
  other.normals.resize(0, 3);
  expect_error(Status::kInvalidArgument, "no normals", [&] { f.push(kSilent, other, 6); });
}

}  // namespace
}  // namespace sgrt
