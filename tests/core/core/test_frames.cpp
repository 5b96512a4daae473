// The six numbers and the frames, from what the words mean: where a patient's left, head and front point in the room.
#include "core/frames.hpp"

#include <cmath>
#include <limits>

#include "expect.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Mat3 about_axis(double deg, const Vec3& axis) {
  return Eigen::AngleAxisd(deg * kDegree, axis).toRotationMatrix();
}

PatientDisplacement displacement(double lat, double lng, double vrt, double pitch, double roll, double rtn) {
  PatientDisplacement d;
  static_cast<SixDof&>(d) = {lat, lng, vrt, pitch, roll, rtn, 0};
  return d;
}

void expect_near(const SixDof& a, const SixDof& b, double tolerance) {
  EXPECT_NEAR(a.lat_mm, b.lat_mm, tolerance);
  EXPECT_NEAR(a.lng_mm, b.lng_mm, tolerance);
  EXPECT_NEAR(a.vrt_mm, b.vrt_mm, tolerance);
  EXPECT_NEAR(a.pitch_deg, b.pitch_deg, tolerance);
  EXPECT_NEAR(a.roll_deg, b.roll_deg, tolerance);
  EXPECT_NEAR(a.rtn_deg, b.rtn_deg, tolerance);
}

// REQ-FRAME-001
TEST(Frames, DisplacementIsWhatItSays) {
  Draw draw(1);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 iso = draw.vec3(500), x = draw.vec3(500);
    const PatientDisplacement d = displacement(draw.uniform(-50, 50), draw.uniform(-50, 50), draw.uniform(-50, 50),
                                               draw.uniform(-89, 89), draw.uniform(-180, 180), draw.uniform(-180, 180));
    // formats: D(x) = R (x - iso) + iso + t, R = Rz(rtn) Rx(pitch) Ry(roll).
    const Mat3 R = about_axis(d.rtn_deg, Vec3::UnitZ()) * about_axis(d.pitch_deg, Vec3::UnitX()) *
                   about_axis(d.roll_deg, Vec3::UnitY());
    const Vec3 moved = R * (x - iso) + iso + Vec3(d.lat_mm, d.lng_mm, d.vrt_mm);
    const Pose reference_from_live = pose_of(d, iso);
    EXPECT_LT((reference_from_live * moved - x).norm(), 1e-12 * 1000);
    const PatientDisplacement back = displacement_of(reference_from_live, iso);
    expect_near(back, d, 1e-10);
    EXPECT_NEAR(back.mag_mm, std::sqrt(d.lat_mm * d.lat_mm + d.lng_mm * d.lng_mm + d.vrt_mm * d.vrt_mm), 1e-10);
  }
}

// REQ-FRAME-002
TEST(Frames, CorrectionUndoesTheDisplacement) {
  Draw draw(2);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 iso = draw.vec3(500), x = draw.vec3(500);
    const PatientDisplacement d = displacement(draw.uniform(-50, 50), draw.uniform(-50, 50), draw.uniform(-50, 50),
                                               draw.uniform(-80, 80), draw.uniform(-80, 80), draw.uniform(-180, 180));
    const Pose reference_from_live = pose_of(d, iso);
    const CouchCorrection c = correction_of(reference_from_live, iso);
    // The correction as a motion of its own brings the displaced point back.
    const Mat3 R = about_axis(c.rtn_deg, Vec3::UnitZ()) * about_axis(c.pitch_deg, Vec3::UnitX()) *
                   about_axis(c.roll_deg, Vec3::UnitY());
    const Vec3 live = reference_from_live.inverse() * x;
    EXPECT_LT((R * (live - iso) + iso + Vec3(c.lat_mm, c.lng_mm, c.vrt_mm) - x).norm(), 1e-9);
    EXPECT_LT((pose_of(c, iso).matrix() - reference_from_live.matrix()).norm(), 1e-9);
    EXPECT_NEAR(c.mag_mm, displacement_of(reference_from_live, iso).mag_mm, 1e-10);
  }
}

// REQ-FRAME-002
TEST(Frames, CorrectionIsNotMinusTheSixNumbers) {
  const PatientDisplacement d = displacement(10, 0, 0, 0, 0, 90);
  const CouchCorrection c = correction_of(pose_of(d, Vec3::Zero()), Vec3::Zero());
  // t = (10, 0, 0), R = Rz(90): -R^T t = (0, 10, 0), where minus the six numbers would say (-10, 0, 0).
  EXPECT_NEAR(c.rtn_deg, -90, 1e-12);
  EXPECT_NEAR(c.lat_mm, 0, 1e-12);
  EXPECT_NEAR(c.lng_mm, 10, 1e-12);
}

// The book's warning: half a degree about a centre 200 mm away is 1.75 mm at the isocentre.
TEST(Frames, TranslationIsReportedAtTheIsocentre) {
  const Pose turn_elsewhere = about({about_axis(-0.5, Vec3::UnitZ()), Vec3::Zero()}, -Vec3(200, 0, 0));
  const PatientDisplacement d = displacement_of(turn_elsewhere, Vec3::Zero());
  EXPECT_NEAR(d.mag_mm, 2 * 200 * std::sin(0.25 * kDegree), 1e-12);
  EXPECT_NEAR(d.mag_mm, 1.745, 1e-3);
  EXPECT_NEAR(d.rtn_deg, 0.5, 1e-12);
  EXPECT_NEAR(displacement_of(turn_elsewhere, Vec3(200, 0, 0)).mag_mm, 0, 1e-12);
}

// REQ-FRAME-003
TEST(Frames, AtNinetyDegreesOfPitchRollIsZero) {
  Draw draw(3);
  for (double pitch : {90.0, -90.0, 90 - 1e-10, 90 - 1e-5}) {
    for (int i = 0; i < 50; ++i) {
      const Pose pose =
          pose_of(displacement(1, 2, 3, pitch, draw.uniform(-180, 180), draw.uniform(-180, 180)), Vec3::Zero());
      const PatientDisplacement d = displacement_of(pose, Vec3::Zero());
      if (std::abs(pitch) > 89.9999999) EXPECT_EQ(d.roll_deg, 0);
      EXPECT_NEAR(d.pitch_deg, pitch, 1e-6);
      EXPECT_LT((pose_of(d, Vec3::Zero()).R - pose.R).norm(), 1e-7);
    }
  }
}

// REQ-FRAME-008
TEST(Frames, NoPoseIsNaN) {
  Pose none;
  none.R.setConstant(kNaN);
  none.t.setConstant(kNaN);
  const PatientDisplacement d = displacement_of(none, Vec3::Zero());
  for (double v : {d.lat_mm, d.lng_mm, d.vrt_mm, d.pitch_deg, d.roll_deg, d.rtn_deg, d.mag_mm})
    EXPECT_TRUE(std::isnan(v));
}

TEST(Frames, NonsenseIsRefused) {
  const double inf = std::numeric_limits<double>::infinity();
  expect_error(Status::kInvalidArgument, "rtn_deg", [&] { pose_of(displacement(0, 0, 0, 0, 0, inf), Vec3::Zero()); });
  expect_error(Status::kInvalidArgument, "lat_mm: expected a finite number, got nan",
               [&] { pose_of(displacement(kNaN, 0, 0, 0, 0, 0), Vec3::Zero()); });
  expect_error(Status::kInvalidArgument, "isocentre_mm",
               [&] { pose_of(displacement(0, 0, 0, 0, 0, 0), Vec3(0, kNaN, 0)); });
  expect_error(Status::kInvalidArgument, "isocentre_dicom_mm",
               [&] { fixed_from_dicom(PatientPosition::kHfs, Vec3(0, kNaN, 0)); });
  expect_error(Status::kInvalidArgument, "couch_deg", [&] { fixed_from_couch(inf); });
  for (int position : {-1, 8}) {
    expect_error(Status::kInvalidArgument, "patient_position",
                 [&] { fixed_from_dicom(static_cast<PatientPosition>(position), Vec3::Zero()); });
  }
}

// An observer at the foot of the couch faces the gantry: X is to the right, Y towards the gantry, Z up. The words of a
// position say where the patient's head and front point. The left hand follows from the body: a person who stands
// upright and faces south has it in the east, which fixes the order of the product.
struct Lying {
  PatientPosition position;
  Vec3 head, front;
};

Vec3 left_of(const Vec3& head, const Vec3& front) {
  return head.cross(front);
}

// REQ-FRAME-004
TEST(Frames, DicomOfEveryPosition) {
  const Vec3 east(1, 0, 0), south(0, -1, 0), up(0, 0, 1);
  ASSERT_EQ(left_of(up, south), east);  // upright, facing south: the left hand is in the east

  const Vec3 X(1, 0, 0), gantry(0, 1, 0), ceiling(0, 0, 1);
  const Lying all[] = {
      {PatientPosition::kHfs, gantry, ceiling},   // on the back
      {PatientPosition::kHfp, gantry, -ceiling},  // on the belly
      {PatientPosition::kFfs, -gantry, ceiling}, {PatientPosition::kFfp, -gantry, -ceiling},
      {PatientPosition::kHfdl, gantry, X},  // on the left side, checked below: left is down
      {PatientPosition::kHfdr, gantry, -X},      {PatientPosition::kFfdl, -gantry, -X},
      {PatientPosition::kFfdr, -gantry, X},
  };
  const Vec3 iso(12, -34, 560);
  for (const Lying& lying : all) {
    const Pose fixed_from_dicom_pose = fixed_from_dicom(lying.position, iso);
    const Vec3 left = left_of(lying.head, lying.front);
    // DICOM's axes: x to the patient's left, y to the back, z to the head.
    EXPECT_EQ(fixed_from_dicom_pose * (iso + Vec3(1, 0, 0)), left);
    EXPECT_EQ(fixed_from_dicom_pose * (iso + Vec3(0, 1, 0)), -lying.front);
    EXPECT_EQ(fixed_from_dicom_pose * (iso + Vec3(0, 0, 1)), lying.head);
    EXPECT_EQ((fixed_from_dicom_pose * iso).norm(), 0);
    EXPECT_EQ(fixed_from_dicom_pose.R.determinant(), 1);
    const bool on_left = lying.position == PatientPosition::kHfdl || lying.position == PatientPosition::kFfdl;
    const bool on_right = lying.position == PatientPosition::kHfdr || lying.position == PatientPosition::kFfdr;
    if (on_left) EXPECT_EQ(left, -ceiling);
    if (on_right) EXPECT_EQ(left, ceiling);
  }
}

// Head first supine, the observer at the feet: the patient's left hand is on the observer's right.
TEST(Frames, HeadFirstSupineLeftIsOnTheRight) {
  EXPECT_EQ(fixed_from_dicom(PatientPosition::kHfs, Vec3::Zero()) * Vec3(100, 0, 0), Vec3(100, 0, 0));
}

// REQ-FRAME-005
TEST(Frames, CouchTurnsCounterClockwiseSeenFromAbove) {
  const Vec3 to_the_gantry(0, 1, 0), right(1, 0, 0);
  EXPECT_EQ(fixed_from_couch(90) * right, to_the_gantry);  // exact at the quarters
  EXPECT_EQ(fixed_from_couch(90) * to_the_gantry, -right);
  EXPECT_EQ(fixed_from_couch(0).matrix(), Mat4::Identity());
  EXPECT_EQ(fixed_from_couch(360).matrix(), Mat4::Identity());
  EXPECT_EQ(fixed_from_couch(270).matrix(), fixed_from_couch(-90).matrix());
  EXPECT_EQ(fixed_from_couch(180) * right, -right);
  for (double deg = -720; deg <= 720; deg += 7.5) {
    EXPECT_LT((fixed_from_couch(deg).R - about_axis(deg, Vec3::UnitZ())).norm(), 1e-14) << deg;
  }
}

}  // namespace
}  // namespace sgrt
