// The tracker in C++: the drift and the prediction against the truth, cancel, and the amplitude's predicted sigma.
#include "tracking/tracker.hpp"

#include <cmath>
#include <limits>

#include "scenes.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

using namespace test;

const Vec3 kIso(10, -20, -30);

Surface with_normals(const Surface& s) {
  return estimate_normals(kSilent, s, NormalsOptions{});
}

std::shared_ptr<const Surface> torso_surface(std::int64_t n, double sigma, Draw& draw) {
  return std::make_shared<const Surface>(with_normals(sample(torso, n, sigma, draw)));
}

LivePoints points_of(const Surface& s) {
  LivePoints live;
  read_live(s, live);
  return live;
}

TEST(Tracker, FollowsAndTellsTheDrift) {
  Draw draw(1);
  Tracker tracker(kSilent, torso_surface(4000, 0.1, draw), kIso, nullptr, nullptr, TrackerOptions{});
  const Pose start = displacement(3, 1, kIso, draw);
  for (int i = 0; i < 5; ++i) {
    const Pose drift = about(Pose{so3_exp(Vec3(0, 0, 0.004 * i)), Vec3(0, 0.5 * i, 0)}, -kIso);
    const Surface live = with_normals(moved(sample(torso, 3000, 0.1, draw), drift * start));
    const TrackFrame& f = tracker.push(kSilent, &live, 0.1 * i);
    ASSERT_EQ(f.icp.status, Status::kOk);
    EXPECT_EQ(f.index, i);
    EXPECT_NEAR(f.drift.lng_mm, 0.5 * i, 0.06);
    EXPECT_NEAR(f.drift.rtn_deg, 0.004 * i * 180 / kPi, 0.03);
    EXPECT_NEAR(f.drift.vrt_mm, 0, 0.06);
    EXPECT_EQ(f.attempts, 1);
  }
}

// Gone, and back far from where he was: found by the search anywhere, which runs once a second at most.
// REQ-TRACK-005
TEST(Tracker, FindsAPatientWhoCameBackElsewhere) {
  Draw draw(5);
  const auto reference = torso_surface(5000, 0.1, draw);
  const Pose D = displacement(150, 100, kIso, draw);
  const Surface near = with_normals(sample(torso, 3000, 0.1, draw));
  const Surface far = moved(with_normals(sample(torso, 3000, 0.1, draw)), D);
  const Surface table = with_normals(sample(plane, 2000, 0.1, draw));
  for (const bool search : {false, true}) {
    TrackerOptions o;
    o.search = search;
    Tracker tracker(kSilent, reference, kIso, nullptr, nullptr, o);
    ASSERT_TRUE(tracker.push(kSilent, &near, 0).beam);
    EXPECT_FALSE(tracker.last().searched);
    const TrackFrame& gone = tracker.push(kSilent, &table, 0.1);
    EXPECT_EQ(gone.state, TrackState::kLost);
    EXPECT_EQ(gone.searched, search);
    EXPECT_FALSE(tracker.push(kSilent, &far, 0.2).searched);
    EXPECT_EQ(tracker.last().state, TrackState::kLost);
    const TrackFrame& back = tracker.push(kSilent, &far, 1.2);
    EXPECT_EQ(back.searched, search);
    EXPECT_EQ(back.state, search ? TrackState::kFound : TrackState::kLost);
    EXPECT_FALSE(back.beam);
    if (!search) continue;
    EXPECT_LT(about(back.icp.reference_from_live * D, kIso).t.norm(), 0.1);
    EXPECT_EQ(back.icp.verdict_words, "ok: found by a search anywhere");
    EXPECT_EQ(tracker.push(kSilent, &far, 1.3).state, TrackState::kTracking);
    EXPECT_EQ(tracker.last().attempts, 1);
  }
}

// Also where he is found without a search: nothing is predicted from before the loss.
// REQ-TRACK-005
TEST(Tracker, TheFirstFrameAfterALossIsFound) {
  Draw draw(6);
  TrackerOptions o;
  o.search = false;
  Tracker tracker(kSilent, torso_surface(5000, 0.1, draw), kIso, nullptr, nullptr, o);
  const Surface live = with_normals(sample(torso, 3000, 0.1, draw));
  EXPECT_EQ(tracker.push(kSilent, &live, 0).state, TrackState::kTracking);
  EXPECT_EQ(tracker.push(kSilent, nullptr, 0.1).state, TrackState::kLost);
  EXPECT_EQ(tracker.push(kSilent, &live, 0.2).state, TrackState::kFound);
  EXPECT_EQ(tracker.push(kSilent, &live, 0.3).state, TrackState::kTracking);
}

// REQ-TRACK-003
TEST(Tracker, ACancelledFrameHoldsTheBeam) {
  Draw draw(2);
  Tracker tracker(kSilent, torso_surface(4000, 0.1, draw), kIso, nullptr, nullptr, TrackerOptions{});
  const Surface live = with_normals(sample(torso, 3000, 0.1, draw));
  ASSERT_TRUE(tracker.push(kSilent, &live, 0).beam);
  sgrt::Run cancel;
  cancel.progress = [](double, const char*) { return true; };
  expect_error(Status::kCancelled, "", [&] { tracker.push(cancel, &live, 0.1); });
  EXPECT_FALSE(tracker.last().beam);
  EXPECT_TRUE(std::isnan(tracker.last().icp.displacement.lat_mm));
  EXPECT_TRUE(tracker.push(kSilent, &live, 0.1).beam);
}

TEST(Tracker, Nonsense) {
  Draw draw(3);
  const auto reference = torso_surface(2000, 0.1, draw);
  const auto with = [&](auto change) {
    TrackerOptions o;
    change(o);
    Tracker(kSilent, reference, kIso, nullptr, nullptr, o);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_error(Status::kInvalidArgument, "tolerance_mm", [&] { with([&](auto& o) { o.tolerance_mm = nan; }); });
  expect_error(Status::kInvalidArgument, "hysteresis", [&] { with([&](auto& o) { o.hysteresis = nan; }); });
  expect_error(Status::kInvalidArgument, "max_gap_s", [&] { with([&](auto& o) { o.max_gap = 0; }); });
  expect_error(Status::kInvalidArgument, "gate_roi", [&] { with([&](auto& o) { o.gated = true; }); });
  expect_error(Status::kInvalidArgument, "isocentre",
               [&] { Tracker(kSilent, reference, Vec3(nan, 0, 0), nullptr, nullptr, TrackerOptions{}); });
}

// The amplitude of a lifted patch, many times: unbiased, and as uncertain as it says.
// REQ-TRACK-007
TEST(Breathing, AmplitudeAndItsSigma) {
  Draw draw(4);
  const auto reference = torso_surface(6000, 0.02, draw);
  const Roi patch = roi_from_box(Vec3(-60, -60, -200), Vec3(60, 60, 200));
  Breathing breathing(kSilent, *reference, patch);
  double sum = 0, sum2 = 0, predicted = 0;
  const int trials = 150;
  for (int i = 0; i < trials; ++i) {
    const Pose lift{Mat3::Identity(), 7 * breathing.direction()};
    const Surface live = moved(sample(torso, 3000, 0.5, draw), lift);
    const Amplitude a = breathing.measure(kSilent, points_of(live));
    ASSERT_GT(a.points, 100);
    sum += a.mm;
    sum2 += a.mm * a.mm;
    predicted += a.sigma;
  }
  const double mean = sum / trials, sigma = std::sqrt(sum2 / trials - mean * mean);
  EXPECT_NEAR(mean, 7, 0.05);
  EXPECT_GT(sigma / (predicted / trials), 0.7);
  EXPECT_LT(sigma / (predicted / trials), 1.4);
  const Surface away = moved(sample(torso, 3000, 0.5, draw), Pose{Mat3::Identity(), Vec3(0, 0, 300)});
  EXPECT_TRUE(std::isnan(breathing.measure(kSilent, points_of(away)).mm));
}

TEST(Breathing, AnotherReferenceHasItsOwnPatch) {
  Draw draw(7);
  const auto reference = torso_surface(6000, 0.02, draw);
  const Roi patch = roi_from_box(Vec3(-60, -60, -200), Vec3(60, 60, 200));
  Tracker tracker(kSilent, reference, kIso, nullptr, &patch, TrackerOptions{});
  const Vec3 up = Breathing(kSilent, *reference, patch).direction();
  const Surface live = with_normals(moved(sample(torso, 3000, 0.1, draw), Pose{Mat3::Identity(), 4 * up}));
  EXPECT_NEAR(tracker.push(kSilent, &live, 0).breathing.mm, 4, 0.1);
  const auto lifted = std::make_shared<const Surface>(moved(*reference, Pose{Mat3::Identity(), 3 * up}));
  tracker.replace_reference(kSilent, lifted, nullptr, &patch);
  EXPECT_NEAR(tracker.push(kSilent, &live, 1).breathing.mm, 1, 0.1);
  tracker.replace_reference(kSilent, lifted, nullptr, nullptr);
  EXPECT_TRUE(std::isnan(tracker.push(kSilent, &live, 2).breathing.mm));
}

}  // namespace
}  // namespace sgrt
