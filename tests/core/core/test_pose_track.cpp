// A pose between two samples lies on the screw that joins them; none beyond the track.
#include "core/pose_track.hpp"

#include <cmath>
#include <limits>

#include "expect.hpp"

namespace sgrt {
namespace {

using test::expect_error;

// About an axis through c along z, with a pitch: the angle is the time in radians.
Pose screw(double angle) {
  const Vec3 c(100, -50, 0);
  const Mat3 R = so3_exp(Vec3(0, 0, angle));
  return {R, c - R * c + Vec3(0, 0, 20 * angle)};
}

// REQ-LASER-004
TEST(PoseTrack, FollowsTheScrewBetweenItsSamples) {
  PoseTrack track;
  for (const double t : {0.0, 0.4, 0.5, 1.3}) {
    track.time.push_back(t);
    track.room_from_body.push_back(screw(t));
  }
  for (const double t : {0.0, 0.1, 0.4, 0.41, 0.5, 0.9, 1.29, 1.3}) {
    const Pose found = pose_at(track, t), truth = screw(t);
    EXPECT_LT((found.R - truth.R).norm(), 1e-12) << t;
    EXPECT_LT((found.t - truth.t).norm(), 1e-10) << t;
  }
}

TEST(PoseTrack, EndsWhereItEnds) {
  PoseTrack track{{1, 2}, {screw(1), screw(2)}};
  for (const double t : {0.999, 2.001, std::numeric_limits<double>::quiet_NaN()})
    expect_error(Status::kInvalidArgument, "the track runs from 1 to 2", [&] { pose_at(track, t); });
  EXPECT_NO_THROW(check_track(track));
  track.time[1] = 1;
  expect_error(Status::kInvalidArgument, "time 1 is 1, expected times that increase", [&] { check_track(track); });
  track.time[1] = std::numeric_limits<double>::infinity();
  expect_error(Status::kInvalidArgument, "time 1 is inf", [&] { check_track(track); });
  track.time.pop_back();
  expect_error(Status::kInvalidArgument, "1 times and 2 poses", [&] { check_track(track); });
  expect_error(Status::kInvalidArgument, "0 times and 0 poses", [] { check_track(PoseTrack{}); });
}

}  // namespace
}  // namespace sgrt
