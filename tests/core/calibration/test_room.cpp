// The room: phantoms seen by calibrated pods, against the truth, with noise against the predicted covariance.
#include "calibration/room.hpp"

#include <gtest/gtest.h>

#include "rig/uncertainty.hpp"
#include "rigs.hpp"

using namespace sgrt;
using namespace sgrt::test;

namespace {

Points phantom() {
  Points p(10, 3);
  p << 0, 0, 0, 80, 0, 10, -80, 5, 20, 0, 90, -10, 10, -90, 0, 60, 60, 60, -60, -60, 50, 60, -60, -40, -60, 60, -50, 0,
      0, 100;
  return p;
}

CalibrationData seen_by(const std::vector<Camera>& cameras, const Points& points, double noise, Draw& draw) {
  CalibrationData data;
  data.points = points;
  data.placements = {"phantom"};
  for (const Camera& c : cameras) data.cameras.push_back({c.id, c.width, c.height});
  for (int c = 0; c < static_cast<int>(cameras.size()); ++c) {
    for (int i = 0; i < static_cast<int>(points.rows()); ++i) {
      Vec2 pixel = project(cameras[c], points.row(i).transpose());
      for (int k = 0; k < 2; ++k) pixel(k) += noise * normal_of(draw);
      data.sights.push_back({c, 0, i, pixel, 1});
    }
  }
  return data;
}

// The pod as its own calibration leaves it: the frame of its first camera.
Rig pod(const std::vector<Camera>& cameras, std::size_t first, const char* id) {
  Rig rig;
  rig.id = id;
  rig.room = "camera";
  for (std::size_t c = first; c < first + 2; ++c) {
    Camera camera = cameras[c];
    camera.camera_from_room = camera.camera_from_room * cameras[first].camera_from_room.inverse();
    rig.cameras.push_back(camera);
  }
  rig.pairs = {{id, 0, 1}};
  return rig;
}

}  // namespace

TEST(Room, TwoPodsComeIntoOneRoom) {
  const std::vector<Camera> cameras = two_pods();
  const Rig a = pod(cameras, 0, "pod1"), b = pod(cameras, 2, "pod2");
  Draw draw(1);
  const RoomResult r = room_from_phantom(sgrt::Run{}, {&a, &b}, seen_by(cameras, phantom(), 0, draw), {});
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  ASSERT_EQ(r.rig.cameras.size(), 4U);
  EXPECT_EQ(r.rig.room, "IEC 61217 fixed, mm");
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_LT((r.rig.cameras[c].camera_from_room.t - cameras[c].camera_from_room.t).norm(), 1e-6);
    EXPECT_LT((r.rig.cameras[c].camera_from_room.R - cameras[c].camera_from_room.R).norm(), 1e-9);
  }
  EXPECT_EQ(r.rig.pairs[1].left, 2);
  EXPECT_LT(r.pair_disagreement_mm, 1e-6);
  EXPECT_LT(r.rigs[1].point_rms_mm, 1e-6);
}

TEST(Room, TheCovarianceAtTheIsocentreIsHonest) {
  constexpr int kTrials = 100;
  const std::vector<Camera> cameras = two_pods();
  const Rig a = pod(cameras, 0, "pod1");
  const std::vector<Camera> two(cameras.begin(), cameras.begin() + 2);
  RoomOptions o;
  o.noise_px = 0.05;
  double nees = 0, modes = 0;
  for (int t = 0; t < kTrials; ++t) {
    Draw draw(10 + t);
    const RoomResult r = room_from_phantom(sgrt::Run{}, {&a}, seen_by(two, phantom(), 0.05, draw), o);
    ASSERT_EQ(r.status, Status::kOk) << r.message;
    const Pose truth = cameras[0].camera_from_room;  // rig_from_room, the rig's frame is its first camera
    const Vec6 e = se3_log(r.rigs[0].rig_from_room.inverse() * truth);
    nees += e.dot(r.rigs[0].covariance.ldlt().solve(e)) / 6 / kTrials;
    // The same uncertainty, by the modes of the rig: a point at the isocentre.
    const Vec2 off = project(cameras[1], Vec3::Zero()) - project(r.rig.cameras[1], Vec3::Zero());
    const Mat2X m = pixel_modes(r.rig, 1, Vec3::Zero());
    modes += off.dot((m * m.transpose()).inverse() * off) / 2 / kTrials;
  }
  EXPECT_NEAR(nees, 1, 4 * std::sqrt(2.0 / 6 / kTrials));
  EXPECT_NEAR(modes, 1, 4 * std::sqrt(1.0 / kTrials));
}

TEST(Room, AWrongPointIsNamedAndWhatHasNoAnswer) {
  const std::vector<Camera> cameras = two_pods();
  const Rig a = pod(cameras, 0, "pod1"), b = pod(cameras, 2, "pod2");
  Draw draw(2);
  CalibrationData data = seen_by(cameras, phantom(), 0.02, draw);
  data.sights[13].pixel += Vec2(4, 0);
  RoomOptions o;
  o.noise_px = 0.02;
  const RoomResult r = room_from_phantom(sgrt::Run{}, {&a, &b}, data, o);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  ASSERT_EQ(r.discarded.size(), 1U);
  EXPECT_EQ(r.discarded[0].camera, 1);
  EXPECT_EQ(r.discarded[0].point, 3);
  CalibrationData few = data;
  few.sights.erase(std::remove_if(few.sights.begin(), few.sights.end(), [](const Sight& s) { return s.point > 1; }),
                   few.sights.end());
  EXPECT_EQ(room_from_phantom(sgrt::Run{}, {&a, &b}, few, o).status, Status::kInsufficientData);
  Points line = phantom();
  for (int i = 0; i < 10; ++i) line.row(i) << 20.0 * i, 0, 0;
  EXPECT_EQ(room_from_phantom(sgrt::Run{}, {&a, &b}, seen_by(cameras, line, 0, draw), o).status, Status::kDegenerate);
  expect_error(Status::kInvalidArgument, "stands in two", [&] { room_from_phantom(sgrt::Run{}, {&a, &a}, data, o); });
  expect_error(Status::kInvalidArgument, "is in none of the rigs",
               [&] { room_from_phantom(sgrt::Run{}, {&a}, data, o); });
}

// REQ-CALIB-004
TEST(Room, APhantomThatMovedIsToldByHowMuch) {
  const std::vector<Camera> cameras = two_pods();
  Rig rig;
  rig.id = "room";
  rig.room = "IEC 61217 fixed, mm";
  rig.cameras = cameras;
  rig.pairs = {{"pod1", 0, 1}, {"pod2", 2, 3}};
  Draw draw(3);
  Points moved = phantom();
  for (int i = 0; i < 10; ++i) moved.row(i) += Vec3(0.3, -0.4, 1.2).transpose();
  CalibrationData data = seen_by(cameras, moved, 0, draw);
  data.points = phantom();
  const RoomResult r = room_from_phantom(sgrt::Run{}, {&rig}, data, {});
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_LT((r.rigs[0].rig_from_room.t - Vec3(0.3, -0.4, 1.2)).norm(), 1e-6);
  EXPECT_EQ(r.pairs.size(), 2U);
}
