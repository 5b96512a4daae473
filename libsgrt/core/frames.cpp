// Frames of the treatment room and the six numbers, see core/frames.hpp. docs/theory/frames.md has every matrix
// derived.
#include "core/frames.hpp"

#include <cmath>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;

struct SinCos {
  double sin, cos;
};

// Exact at multiples of 90 deg.
SinCos sin_cos_deg(double angle) {
  const double a = std::remainder(angle, 360), quarter = std::nearbyint(a / 90);
  const double r = (a - 90 * quarter) * kDegree, s = std::sin(r), c = std::cos(r);
  switch (static_cast<int>(quarter) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

// R = Rz(rtn) Rx(pitch) Ry(roll), written out:
//   .                .                 .
//   .  at (0,1), (1,1): -sin(rtn) cos(pitch), cos(rtn) cos(pitch)
//   row 2: -cos(pitch) sin(roll), sin(pitch), cos(pitch) cos(roll)
void set_turns(const Mat3& R, SixDof& s) {
  constexpr double kGimbal = 1e-8;  // cos(pitch) below which roll and rtn are one turn; sqrt of the last bit
  const double cos_pitch = std::hypot(R(0, 1), R(1, 1));
  const bool gimbal = cos_pitch < kGimbal;
  s.pitch_deg = std::atan2(R(2, 1), cos_pitch) / kDegree;
  s.roll_deg = gimbal ? 0 : std::atan2(-R(2, 0), R(2, 2)) / kDegree;
  s.rtn_deg = (gimbal ? std::atan2(R(1, 0), R(0, 0)) : std::atan2(-R(0, 1), R(1, 1))) / kDegree;
}

template <class Shift>
Shift shift_of(const Pose& motion_about_isocentre) {
  Shift s;
  const Vec3& t = motion_about_isocentre.t;
  s.lat_mm = t.x();
  s.lng_mm = t.y();
  s.vrt_mm = t.z();
  s.mag_mm = t.norm();
  set_turns(motion_about_isocentre.R, s);
  return s;
}

Mat3 turns(const SixDof& s) {
  const SinCos z = sin_cos_deg(s.rtn_deg), x = sin_cos_deg(s.pitch_deg), y = sin_cos_deg(s.roll_deg);
  Mat3 Rz, Rx, Ry;
  Rz << z.cos, -z.sin, 0, z.sin, z.cos, 0, 0, 0, 1;
  Rx << 1, 0, 0, 0, x.cos, -x.sin, 0, x.sin, x.cos;
  Ry << y.cos, 0, y.sin, 0, 1, 0, -y.sin, 0, y.cos;
  return Rz * Rx * Ry;
}

Pose motion_of(const SixDof& s, const Vec3& isocentre) {
  require(isocentre.allFinite(), "isocentre_mm: expected 3 finite numbers");
  const double numbers[] = {s.lat_mm, s.lng_mm, s.vrt_mm, s.pitch_deg, s.roll_deg, s.rtn_deg};
  const char* names[] = {"lat_mm", "lng_mm", "vrt_mm", "pitch_deg", "roll_deg", "rtn_deg"};
  for (int i = 0; i < 6; ++i) {
    require(std::isfinite(numbers[i]),
            (std::string(names[i]) + ": expected a finite number, got " + text_of(numbers[i])).c_str());
  }
  return about({turns(s), Vec3(s.lat_mm, s.lng_mm, s.vrt_mm)}, -isocentre);
}

}  // namespace

PatientDisplacement displacement_of(const Pose& reference_from_live, const Vec3& isocentre) {
  return shift_of<PatientDisplacement>(about(reference_from_live, isocentre).inverse());
}

// The correction undoes D, so it is reference_from_live itself.
CouchCorrection correction_of(const Pose& reference_from_live, const Vec3& isocentre) {
  return shift_of<CouchCorrection>(about(reference_from_live, isocentre));
}

Pose pose_of(const PatientDisplacement& displacement, const Vec3& isocentre) {
  return motion_of(displacement, isocentre).inverse();
}

Pose pose_of(const CouchCorrection& correction, const Vec3& isocentre) {
  return motion_of(correction, isocentre);
}

// R_D = Rz(rtn) Rx(pitch) Ry(roll): the turn Rz(-rtn), outermost, leaves Rx(pitch) Ry(roll); -Rz(-rtn) t brings the
// isocentre back.
FourDof four_dof_of(const Pose& reference_from_live, const Vec3& isocentre) {
  const PatientDisplacement d = displacement_of(reference_from_live, isocentre);
  const SinCos z = sin_cos_deg(-d.rtn_deg);
  FourDof out;
  static_cast<SixDof&>(out.correction) = {-(z.cos * d.lat_mm - z.sin * d.lng_mm),
                                          -(z.sin * d.lat_mm + z.cos * d.lng_mm),
                                          -d.vrt_mm,
                                          0,
                                          0,
                                          -d.rtn_deg,
                                          d.mag_mm};
  static_cast<SixDof&>(out.remaining) = {0, 0, 0, d.pitch_deg, d.roll_deg, 0, 0};
  return out;
}

Pose fixed_from_dicom(PatientPosition position, const Vec3& isocentre_dicom) {
  require(isocentre_dicom.allFinite(), "isocentre_dicom_mm: expected 3 finite numbers");
  Mat3 patient_from_dicom, fixed_from_patient, half_turn;
  patient_from_dicom << 1, 0, 0, 0, 0, 1, 0, -1, 0;  // x left, y to the head, z anterior; DICOM: left, posterior, head
  half_turn = Vec3(-1, -1, 1).asDiagonal();          // Rz(180): feet first
  switch (position) {
    case PatientPosition::kHfs:
    case PatientPosition::kFfs:
      fixed_from_patient.setIdentity();
      break;
    case PatientPosition::kHfp:
    case PatientPosition::kFfp:
      fixed_from_patient = Vec3(-1, 1, -1).asDiagonal();
      break;  // Ry(180): prone
    case PatientPosition::kHfdl:
    case PatientPosition::kFfdl:
      fixed_from_patient << 0, 0, 1, 0, 1, 0, -1, 0, 0;
      break;  // Ry(90): left side down
    case PatientPosition::kHfdr:
    case PatientPosition::kFfdr:
      fixed_from_patient << 0, 0, -1, 0, 1, 0, 1, 0, 0;
      break;  // Ry(-90): right side down
    default:
      fail(Status::kInvalidArgument,
           "patient_position: expected 0 to 7, got " + std::to_string(static_cast<int>(position)));
  }
  const bool feet_first = position == PatientPosition::kFfs || position == PatientPosition::kFfp ||
                          position == PatientPosition::kFfdl || position == PatientPosition::kFfdr;
  if (feet_first) fixed_from_patient = (half_turn * fixed_from_patient).eval();
  const Mat3 R = fixed_from_patient * patient_from_dicom;
  return {R, -(R * isocentre_dicom)};
}

Pose fixed_from_couch(double couch_deg) {
  require(std::isfinite(couch_deg), ("couch_deg: expected a finite number, got " + text_of(couch_deg)).c_str());
  const SinCos z = sin_cos_deg(couch_deg);
  Pose pose;
  pose.R << z.cos, -z.sin, 0, z.sin, z.cos, 0, 0, 0, 1;
  return pose;
}

Pose fixed_from_gantry(double gantry_deg) {
  require(std::isfinite(gantry_deg), ("gantry_deg: expected a finite number, got " + text_of(gantry_deg)).c_str());
  const SinCos y = sin_cos_deg(gantry_deg);
  Pose pose;
  pose.R << y.cos, 0, y.sin, 0, 1, 0, -y.sin, 0, y.cos;
  return pose;
}

Pose couch_turn(double couch_deg, const Vec3& isocentre) {
  require(isocentre.allFinite(), "isocentre_mm: expected 3 finite numbers");
  return about(fixed_from_couch(couch_deg), -isocentre);
}

}  // namespace sgrt
