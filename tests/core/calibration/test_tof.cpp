// Calibration of the range of a time-of-flight camera: simulated wiggling, amplitude term and pixel offsets found
// again.
#include "calibration/tof.hpp"

#include <gtest/gtest.h>

#include "calibration/report.hpp"
#include "tof/frames.hpp"

namespace sgrt::test {
namespace {

constexpr int kWidth = 32, kHeight = 24;

double wiggle(double d) {
  return 30 * std::sin(4 * 4 * kPi * 20e6 * 1.00027 * d / kLight);
}
double of_amplitude(double a) {
  return 4 * (1 - std::sqrt(a / 4000));
}
double of_pixel(int y, int x) {
  return 3 * std::sin(0.7 * x) * std::cos(0.9 * y);
}

struct Boards {
  std::vector<Frames> frames;
  std::vector<TofPlacement> placements;
};

// A big board before the camera, tilted, its squares dark and light.
Boards boards(const Rig& rig, int count, Draw& draw) {
  const Camera& c = rig.cameras[0];
  const Pose room_from_camera = c.camera_from_room.inverse();
  Boards out;
  for (int i = 0; i < count; ++i) {
    Vec6 twist;
    twist << 0.3 * draw.uniform(), 0.3 * draw.uniform(), 0, 0, 0, 0;
    Pose camera_from_board = se3_exp(twist);
    camera_from_board.t = Vec3(0, 0, 600 + 2000.0 * i / (count - 1));
    const Pose room_from_board = room_from_camera * camera_from_board;
    const Vec3 n = room_from_board.R.col(2), centre = c.centre_in_room();
    const auto scene = [&](int, int, int y, int x) {
      const Vec3 e = unproject(c, Vec2(x, y));
      const double d = (room_from_board.t - centre).dot(n) / e.dot(n);
      const double a = ((x / 4 + y / 4) % 2 ? 2500 : 10000) * (1 + 0.2 * draw.uniform());
      double measured = d;  // the error runs over the measured range
      for (int k = 0; k < 30; ++k) measured = d + wiggle(measured) + of_amplitude(a) + of_pixel(y, x);
      return Light{measured, 2 * a, a};
    };
    // The same light in all taps: draw it once.
    std::vector<Light> light;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) light.push_back(scene(0, 0, y, x));
    out.frames.push_back(frames_of(
        rig, 4, [&](int, int, int y, int x) { return light[static_cast<std::size_t>(y * kWidth + x)]; }, &draw));
    out.placements.push_back({std::to_string(i), room_from_board, {}});
  }
  for (int i = 0; i < count; ++i)
    out.placements[static_cast<std::size_t>(i)].taps = out.frames[static_cast<std::size_t>(i)].view;
  return out;
}

Rig quiet_rig() {
  Rig rig = tof_rig(kWidth, kHeight);
  rig.tofs[0].electrons_per_count = 100;
  return rig;
}

TofCalibrationOptions whole_board() {
  TofCalibrationOptions o;
  o.low = Vec2(-3000, -3000), o.high = Vec2(3000, 3000);
  return o;
}

TEST(CalibrateTof, FindsWigglingAmplitudeAndPixels) {
  Draw draw(1);
  const Rig rig = quiet_rig();
  const Boards b = boards(rig, 50, draw);
  const TofCalibration c = calibrate_tof(kSilent, rig, 0, b.placements, {}, whole_board());
  ASSERT_EQ(c.status, Status::kOk) << c.message;
  EXPECT_GT(c.rms_before, 15);
  EXPECT_LT(c.rms_after, 1.1 * std::hypot(c.expected, 0.5));
  EXPECT_LT(c.placement_rms, 0.5);
  EXPECT_TRUE(c.warnings.empty()) << c.warnings.front();

  // Another board, without noise: what is left of 30 mm.
  Draw fresh(9);
  Rig exact = c.rig;
  const Boards other = boards(quiet_rig(), 9, fresh);
  TofSensor sensor(kSilent, exact, 0, {}, c.pixel_offset);
  double square = 0, count = 0;
  for (std::size_t i = 1; i + 1 < other.placements.size(); ++i) {
    const auto r = sensor.measure(kSilent, other.placements[i].taps);
    const Camera& camera = rig.cameras[0];
    const Vec3 n = other.placements[i].room_from_board.R.col(2), centre = camera.centre_in_room();
    double mean = 0;
    for (int p = 0; p < kWidth * kHeight; ++p) {
      const Vec3 e = unproject(camera, Vec2(p % kWidth, p / kWidth));
      mean += r->range.plane(0)[p] - (other.placements[i].room_from_board.t - centre).dot(n) / e.dot(n);
    }
    square += std::pow(mean / (kWidth * kHeight), 2), ++count;
  }
  EXPECT_LT(std::sqrt(square / count), 0.5);
}

// A rig states where it came from in any words: they stay, whatever they are.
TEST(CalibrateTof, KeepsWhereTheRigCameFrom) {
  TofCalibration c;
  c.unit = "tof0";
  const Rig rig = quiet_rig();
  std::string plain = rig_to_json(rig);
  plain.erase(plain.rfind('}'));
  const auto written = [&](const std::string& provenance) {
    const std::string text = plain + (provenance.empty() ? "" : ", \"provenance\": " + provenance) + "}";
    c.rig = rig_from_json(text.data(), text.size());
    std::string out = rig_with_provenance(c);
    out.erase(std::remove_if(out.begin(), out.end(), [](char x) { return x == ' ' || x == '\n'; }), out.end());
    return out;
  };
  const std::string note = R"("tof0":{"made_by":"sgrttofcalibration")";
  EXPECT_NE(written("").find(R"("provenance":{"tof":{)" + note), std::string::npos);
  EXPECT_NE(written(R"("by hand")").find(R"("provenance":{"before":"byhand","tof":{)" + note), std::string::npos);
  EXPECT_NE(written("[1, 2]").find(R"("provenance":{"before":[1,2],"tof":{)" + note), std::string::npos);
  EXPECT_NE(written(R"({"tof": 3})").find(R"("provenance":{"tof":{"before":3,)" + note), std::string::npos);
  EXPECT_NE(written(R"({"tof": {"tof0": 1, "tof1": true}, "big": 18446744073709551615})")
                .find(R"("provenance":{"tof":{)" + note),
            std::string::npos);
  EXPECT_NE(written(R"({"big": 18446744073709551615})").find(R"("big":18446744073709551615)"), std::string::npos);
}

// REQ-TOF-005
TEST(CalibrateTof, SaysWhatItCannotKnow) {
  Draw draw(2);
  const Rig rig = quiet_rig();
  Boards b = boards(rig, 3, draw);  // a metre apart
  const TofCalibration c = calibrate_tof(kSilent, rig, 0, b.placements, {}, whole_board());
  EXPECT_FALSE(c.warnings.empty());
  TofCalibrationOptions o = whole_board();
  o.low = Vec2(5000, 5000), o.high = Vec2(6000, 6000);
  const TofCalibration none = calibrate_tof(kSilent, rig, 0, b.placements, {}, o);
  EXPECT_EQ(none.status, Status::kInsufficientData);
  o.high = o.low;
  expect_error(Status::kInvalidArgument, "board_mm", [&] { calibrate_tof(kSilent, rig, 0, b.placements, {}, o); });
  expect_error(Status::kInvalidArgument, "placements", [&] { calibrate_tof(kSilent, rig, 0, {}, {}, whole_board()); });
}

}  // namespace
}  // namespace sgrt::test
