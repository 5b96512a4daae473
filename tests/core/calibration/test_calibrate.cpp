// Calibration against made rigs: exact data, noise against the predicted covariance, outliers, and what has no answer.
#include "calibration/calibrate.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "calibration/check.hpp"
#include "rig/uncertainty.hpp"
#include "rigs.hpp"

using namespace sgrt;
using namespace sgrt::test;

namespace {

CalibrationOptions quick() {
  CalibrationOptions o;
  o.split_half = false;
  return o;
}

std::vector<Camera> one_pod() {
  std::vector<Camera> cameras = two_pods();
  cameras.resize(2);
  return cameras;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

}  // namespace

// REQ-CALIB-001
TEST(Calibrate, ExactPixelsGiveTheRigBack) {
  SeenOptions o;
  o.noise = 0;
  o.warp = Vec3(0.4, -0.1, 0.2);
  const Seen seen = see(two_pods(), o, 7);
  const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, quick());
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_LT(r.rms, 1e-3);  // the priors pull by so much
  const Eigen::VectorXd e = errors_of(r, seen.truth);
  for (Eigen::Index i = 0; i < e.size(); ++i)
    EXPECT_LT(std::abs(e(i)), 0.02 * std::max(1.0, std::abs(e(i)))) << r.parameters[i];
  EXPECT_LT((r.scene.warp - o.warp).norm(), 0.01);
  EXPECT_EQ(r.rig.room, "camera pod1-left");
}

// REQ-CALIB-001
TEST(Calibrate, NoiseIsFoundAndTheCovarianceIsHonest) {
  constexpr int kTrials = 12;
  double nees = 0, dof = 0, noise = 0;
  for (int t = 0; t < kTrials; ++t) {
    const Seen seen = see(one_pod(), SeenOptions{}, 100 + t);
    const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, quick());
    ASSERT_EQ(r.status, Status::kOk) << r.message;
    const auto [square, free] = nees_of(errors_of(r, seen.truth), r.covariance);
    nees += square;
    dof += free;
    noise += r.noise / kTrials;
    EXPECT_TRUE(r.discarded.empty());
  }
  EXPECT_NEAR(noise, 0.05, 0.001);
  EXPECT_NEAR(nees / dof, 1, 4 * std::sqrt(2 / dof));
}

TEST(Calibrate, OrderOfImagesAndCamerasDoesNotMatter) {
  SeenOptions o;
  o.boards = 12;
  const Seen seen = see(one_pod(), o, 5);
  const CalibrationResult a = calibrate(sgrt::Run{}, seen.data, quick());
  CalibrationData shuffled = seen.data;
  std::reverse(shuffled.sights.begin(), shuffled.sights.end());
  std::reverse(shuffled.placements.begin(), shuffled.placements.end());
  for (Sight& s : shuffled.sights) s.placement = o.boards - 1 - s.placement;
  const CalibrationResult b = calibrate(sgrt::Run{}, shuffled, quick());
  ASSERT_TRUE(a.status == Status::kOk && b.status == Status::kOk) << a.message << b.message;
  EXPECT_NEAR(a.rig.cameras[1].fx, b.rig.cameras[1].fx, 1e-7);
  EXPECT_LT((a.rig.cameras[1].camera_from_room.t - b.rig.cameras[1].camera_from_room.t).norm(), 1e-7);
  std::swap(shuffled.cameras[0], shuffled.cameras[1]);
  for (Sight& s : shuffled.sights) s.camera = 1 - s.camera;
  const CalibrationResult c = calibrate(sgrt::Run{}, shuffled, quick());
  ASSERT_EQ(c.status, Status::kOk);
  EXPECT_EQ(c.rig.room, "camera pod1-right");
  EXPECT_NEAR(a.rig.cameras[0].fx, c.rig.cameras[1].fx, 1e-4);
  const Pose there = a.rig.cameras[1].camera_from_room, back = c.rig.cameras[1].camera_from_room;
  EXPECT_LT((there * back).t.norm(), 1e-4);
}

// REQ-CALIB-003
TEST(Calibrate, OutliersAreNamedAndDoNotCount) {
  SeenOptions o;
  o.boards = 15;
  Seen seen = see(one_pod(), o, 6);
  seen.data.sights[20].pixel += Vec2(3, -2);
  seen.data.sights[500].pixel += Vec2(0, 0.8);
  const int bad = seen.data.sights[900].placement, camera = seen.data.sights[900].camera;
  Draw draw(1);
  for (Sight& s : seen.data.sights) {
    if (s.placement == bad && s.camera == camera) s.pixel += Vec2(draw.uniform(), draw.uniform()) * 30;
  }
  const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, quick());
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_NEAR(r.noise, 0.05, 0.003);
  bool first = false, second = false, whole = false;
  for (const Discarded& d : r.discarded) {
    const auto is = [&](const Sight& s) {
      return d.camera == s.camera && d.placement == s.placement && d.point == s.point;
    };
    first = first || is(seen.data.sights[20]);
    second = second || is(seen.data.sights[500]);
    whole = whole || (d.camera == camera && d.placement == bad && d.point == -1);
  }
  EXPECT_TRUE(first && second && whole);
  EXPECT_EQ(r.discarded.size(), 3U);
  const auto [square, free] = nees_of(errors_of(r, seen.truth), r.covariance);
  EXPECT_LT(square / free, 2.5);
}

// A start by least squares would follow one gross corner of twenty to no answer at all.
TEST(Calibrate, OneGrossCornerOfTwentyIsDiscarded) {
  SeenOptions o;
  o.columns = 5;
  o.rows = 4;
  o.square = 60;
  o.boards = 6;
  o.spread = 100;
  o.tilt_deg = 20;
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const Seen clean = see(one_pod(), o, seed);
    const CalibrationResult wanted = calibrate(sgrt::Run{}, clean.data, quick());
    ASSERT_EQ(wanted.status, Status::kOk) << wanted.message;
    ASSERT_TRUE(wanted.discarded.empty());
    for (const double off : {20., 100., 300.}) {
      for (const bool each : {false, true}) {  // one in all, one on every board
        Seen seen = clean;
        std::size_t moved = 0;
        for (std::size_t i = 0; i < seen.data.sights.size(); ++i) {
          if (each ? i % 20 != (7 * (i / 20) + seed) % 20 : i != 73 + seed) continue;
          Vec2& pixel = seen.data.sights[i].pixel;
          pixel += off * Vec2(pixel.x() < 640 ? 0.8 : -0.8, pixel.y() < 512 ? 0.6 : -0.6);  // stays in the image
          ++moved;
        }
        const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, quick());
        ASSERT_EQ(r.status, Status::kOk) << r.message;
        EXPECT_EQ(r.discarded.size(), moved);
        for (std::size_t c = 0; c < 2; ++c)  // what is left says the same: within three sigma of all corners' answer
          EXPECT_NEAR(r.rig.cameras[c].fx, wanted.rig.cameras[c].fx, 3 * std::sqrt(wanted.covariance(15 * c, 15 * c)));
      }
    }
  }
}

TEST(Calibrate, TwoHalvesDifferByWhatIsPredicted) {
  SeenOptions o;
  o.boards = 24;
  Seen seen = see(one_pod(), o, 21);
  CalibrationOptions options = quick();
  options.split_half = true;
  const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, options);
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  for (const CameraFigures& f : r.cameras) {
    EXPECT_GT(f.split_predicted, 0);
    EXPECT_LT(f.split_rms, 3 * f.split_predicted);
  }
  // Every other image through another lens: the two halves are of two rigs.
  for (Sight& s : seen.data.sights) {
    const Vec2 off = s.pixel - Vec2(645, 505);
    if (s.placement % 2 == 1) s.pixel += 0.02 * off.squaredNorm() / (640 * 640) * off;
  }
  const CalibrationResult two = calibrate(sgrt::Run{}, seen.data, options);
  ASSERT_EQ(two.status, Status::kOk) << two.message;
  EXPECT_GT(two.cameras[0].split_rms, 3 * r.cameras[0].split_rms);
  EXPECT_TRUE(std::any_of(two.warnings.begin(), two.warnings.end(), [](const std::string& words) {
    return words.find("two halves of the images differ") != std::string::npos;
  }));
  // Too few for halves: said, and no figure.
  o.boards = 4;
  const CalibrationResult few = calibrate(sgrt::Run{}, see(one_pod(), o, 22).data, options);
  ASSERT_EQ(few.status, Status::kOk) << few.message;
  EXPECT_TRUE(std::isnan(few.cameras[0].split_rms));
  EXPECT_TRUE(std::any_of(few.warnings.begin(), few.warnings.end(), [](const std::string& words) {
    return words.find("no comparison of two halves") != std::string::npos;
  }));
}

TEST(Calibrate, ImagesThatContradictEachOtherAreTooFew) {
  SeenOptions o;
  o.boards = 4;
  Seen seen = see(one_pod(), o, 6);
  Draw draw(1);
  for (Sight& s : seen.data.sights) {  // two of four images are of nothing
    if (s.placement < 2 && s.camera == 1) s.pixel += Vec2(draw.uniform(), draw.uniform()) * 40;
  }
  const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, quick());
  EXPECT_EQ(r.status, Status::kInsufficientData);
  EXPECT_NE(r.message.find("'pod1-right'"), std::string::npos) << r.message;
}

TEST(Calibrate, CornersThatAreNamedWrongAreAWarning) {
  SeenOptions o;
  o.boards = 12;
  Seen seen = see(one_pod(), o, 5);
  int of_view = 0;
  for (std::size_t i = 0; i + 1 < seen.data.sights.size(); ++i) {  // three pairs of neighbours change names in each
    of_view = i > 0 && seen.data.sights[i].placement == seen.data.sights[i - 1].placement ? of_view + 1 : 0;
    if (of_view % 30 == 4) std::swap(seen.data.sights[i].point, seen.data.sights[i + 1].point);
  }
  const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, quick());
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  EXPECT_NEAR(r.noise, 0.05, 0.003);
  EXPECT_TRUE(std::any_of(r.warnings.begin(), r.warnings.end(), [](const std::string& words) {
    return words.find("corners of") != std::string::npos && words.find("do not fit") != std::string::npos;
  }));
}

// REQ-CALIB-002
TEST(Calibrate, WhatHasNoAnswer) {
  SeenOptions o;
  o.boards = 10;
  Seen seen = see(two_pods(), o, 8);
  const auto message_of = [&](const CalibrationData& data, Status status) {
    const CalibrationResult r = calibrate(sgrt::Run{}, data, quick());
    EXPECT_EQ(static_cast<int>(r.status), static_cast<int>(status)) << r.message;
    return r.message;
  };
  // A camera that shares no placement with the others.
  CalibrationData cut = seen.data;
  for (int b = 0; b < 10; ++b) cut.placements.push_back("other" + std::to_string(b));
  for (Sight& s : cut.sights) s.placement += s.camera == 3 ? 10 : 0;
  EXPECT_NE(message_of(cut, Status::kInsufficientData).find("'pod2-right': not connected"), std::string::npos);
  // Two views.
  CalibrationData few = seen.data;
  few.sights.erase(std::remove_if(few.sights.begin(), few.sights.end(), [](const Sight& s) { return s.placement > 1; }),
                   few.sights.end());
  EXPECT_NE(message_of(few, Status::kInsufficientData).find("expected at least 3"), std::string::npos);
  // The same image under three names.
  CalibrationData same = few;
  same.cameras.resize(1);
  same.sights.clear();
  for (int b = 0; b < 3; ++b) {
    for (const Sight& s : seen.data.sights) {
      if (s.placement == 0 && s.camera == 0) same.sights.push_back({0, b, s.point, s.pixel, 1});
    }
  }
  EXPECT_NE(message_of(same, Status::kInsufficientData).find("1 usable images"), std::string::npos);
  // Boards all parallel to the sensor, turned and moved about: not a lens.
  SeenOptions flat = o;
  flat.tilt_deg = 0.01;
  std::vector<Camera> above = {pod_camera("above", {0, 1, 2000}, {0, 0, 0})};
  EXPECT_NE(message_of(see(above, flat, 9).data, Status::kDegenerate).find("tilt the board"), std::string::npos);
  flat.turn_deg = 0.5;
  flat.spread = 3;
  EXPECT_NE(message_of(see(above, flat, 9).data, Status::kDegenerate).find("tilt the board"), std::string::npos);
}

// REQ-CALIB-003
TEST(Calibrate, AHalfTurnedOrMirroredBoardIsNamed) {
  SeenOptions o;
  o.boards = 14;
  const Seen seen = see(one_pod(), o, 12);
  const auto rename = [&](int placement, auto&& name) {
    CalibrationData data = seen.data;
    for (Sight& s : data.sights) {
      if (s.placement == placement && s.camera == 1) s.point = name(s.point);
    }
    return data;
  };
  CalibrationData turned = rename(2, [&](int i) { return o.columns * o.rows - 1 - i; });
  const CalibrationResult r = calibrate(sgrt::Run{}, turned, quick());
  ASSERT_EQ(r.status, Status::kOk) << r.message;
  ASSERT_EQ(r.discarded.size(), 1U);
  EXPECT_NE(r.discarded[0].why.find("half-turned"), std::string::npos) << r.discarded[0].why;
  turned.half_turn_ambiguous = true;
  const CalibrationResult same = calibrate(sgrt::Run{}, turned, quick());
  EXPECT_TRUE(same.status == Status::kOk && same.discarded.empty());
  const CalibrationResult m =
      calibrate(sgrt::Run{},
                rename(2, [&](int i) { return i / o.columns * o.columns + o.columns - 1 - i % o.columns; }), quick());
  ASSERT_EQ(m.status, Status::kOk) << m.message;
  ASSERT_EQ(m.discarded.size(), 1U);
  EXPECT_NE(m.discarded[0].why.find("mirrored"), std::string::npos) << m.discarded[0].why;
}

// Boards in the middle of the image only: the error outside lies within the stated uncertainty, and the coverage is
// warned of.
TEST(Calibrate, AThinSetIsNotConfident) {
  double square = 0, count = 0;
  for (unsigned seed = 0; seed < 6; ++seed) {
    SeenOptions o;
    o.reach = 0.45;
    o.columns = 8;
    o.rows = 6;
    o.square = 25;
    o.boards = 60;
    o.spread = 120;
    const std::vector<Camera> one = {pod_camera("above", {0, 1, 2000}, {0, 0, 0})};
    const Seen seen = see(one, o, 20 + seed);
    const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, quick());
    ASSERT_EQ(r.status, Status::kOk) << r.message;
    EXPECT_NE(joined(r.warnings).find("thin coverage"), std::string::npos) << joined(r.warnings);
    // Points of the camera's own frame over the whole image.
    for (int i = 0; i < 63; ++i) {
      const Vec2 pixel(i % 9 * 1279.0 / 8, i / 9 * 1023.0 / 6);
      const Vec3 x = 2000 * undistort(seen.truth[0], pixel).homogeneous();
      const Mat2X modes = pixel_modes(r.rig, 0, x);
      if (!modes.allFinite()) continue;
      const Vec2 e = project_camera(r.rig.cameras[0], x) - pixel;
      square += e.dot((modes * modes.transpose()).inverse() * e) / 2;
      ++count;
    }
  }
  EXPECT_LT(square / count, 2);
  EXPECT_GT(count, 300);
}

TEST(Calibrate, RejectsNonsense) {
  SeenOptions o;
  o.boards = 4;
  const Seen seen = see(one_pod(), o, 13);
  const auto refused = [&](const std::string& words, auto&& spoil) {
    CalibrationData data = seen.data;
    spoil(data);
    expect_error(Status::kInvalidArgument, words, [&] { calibrate(sgrt::Run{}, data, quick()); });
  };
  refused("stands twice", [](CalibrationData& d) { d.cameras[1].id = d.cameras[0].id; });
  refused("empty id", [](CalibrationData& d) { d.cameras[1].id.clear(); });
  refused("an image side of 0", [](CalibrationData& d) { d.cameras[1].width = 0; });
  refused("index[3]: camera 7", [](CalibrationData& d) { d.sights[3].camera = 7; });
  refused("index[3]: point -1", [](CalibrationData& d) { d.sights[3].point = -1; });
  refused("pixels[2]", [](CalibrationData& d) { d.sights[2].pixel.x() = std::nan(""); });
  refused("pixels[2]", [](CalibrationData& d) { d.sights[2].pixel.x() = 5000; });
  refused("sigma[1]", [](CalibrationData& d) { d.sights[1].sigma = 0; });
  refused("twice in placement", [](CalibrationData& d) { d.sights[1] = d.sights[0]; });
  refused("a name stands twice", [](CalibrationData& d) { d.placements[1] = d.placements[0]; });
  refused("expected a flat target", [](CalibrationData& d) { d.points(3, 2) = 50; });
  refused("extends along its x and y", [](CalibrationData& d) { d.points.col(1).setZero(); });
  refused("pairs[0]", [](CalibrationData& d) { d.pairs.push_back({"p", 0, 0}); });
}

TEST(Calibrate, SplitHalvesOfGoodDataAgree) {
  const Seen seen = see(one_pod(), SeenOptions{}, 31);
  CalibrationOptions o;
  const CalibrationResult r = calibrate(sgrt::Run{}, seen.data, o);
  ASSERT_EQ(r.status, Status::kOk);
  for (const CameraFigures& f : r.cameras) {
    EXPECT_GT(f.split_predicted, 0);
    EXPECT_LT(f.split_rms, 2 * f.split_predicted);
    EXPECT_GT(f.split_rms, 0.2 * f.split_predicted);
  }
}

// REQ-CALIB-004
TEST(Check, UnseenImagesOfTheSameRigFitAndOfAMovedOneDoNot) {
  SeenOptions o;
  const Seen made = see(one_pod(), o, 41);
  const CalibrationResult r = calibrate(sgrt::Run{}, made.data, quick());
  ASSERT_EQ(r.status, Status::kOk);
  o.boards = 10;
  const Seen fresh = see(one_pod(), o, 42);
  const CheckResult good = check_rig(sgrt::Run{}, r.rig, fresh.data, quick());
  ASSERT_EQ(good.status, Status::kOk) << good.message;
  EXPECT_NEAR(good.rms, good.expected_rms, 0.1 * good.expected_rms);
  EXPECT_TRUE(good.warnings.empty());
  std::vector<Camera> moved = one_pod();
  Vec6 twist;
  twist << 2e-4, 1e-4, 0, 0.1, 0, 0;
  moved[1].camera_from_room = se3_exp(twist) * moved[1].camera_from_room;
  const CheckResult bad = check_rig(sgrt::Run{}, r.rig, see(moved, o, 42).data, quick());
  ASSERT_EQ(bad.status, Status::kOk);
  EXPECT_GT(bad.rms, 2 * good.rms);
  EXPECT_EQ(bad.warnings.size(), 1U);
}
