// Frames: the six numbers and the poses behind them.
#include "core/frames.hpp"

#include "capi/capi.hpp"

namespace sgrt {
namespace {

static_assert(
    static_cast<int>(PatientPosition::kHfs) == SGRT_HFS && static_cast<int>(PatientPosition::kHfp) == SGRT_HFP &&
    static_cast<int>(PatientPosition::kFfs) == SGRT_FFS && static_cast<int>(PatientPosition::kFfp) == SGRT_FFP &&
    static_cast<int>(PatientPosition::kHfdl) == SGRT_HFDL && static_cast<int>(PatientPosition::kHfdr) == SGRT_HFDR &&
    static_cast<int>(PatientPosition::kFfdl) == SGRT_FFDL && static_cast<int>(PatientPosition::kFfdr) == SGRT_FFDR);

// Shared by the two structs, which have the same members and must not be mixed up. mag_mm is not read.
template <class SixNumbers, class C>
SixNumbers from_c(const C& c, const char* name) {
  const double shifts[3] = {c.lat_mm, c.lng_mm, c.vrt_mm};
  const double turns[3] = {c.pitch_deg, c.roll_deg, c.rtn_deg};
  const char* const shift_names[3] = {".lat_mm", ".lng_mm", ".vrt_mm"};
  const char* const turn_names[3] = {".pitch_deg", ".roll_deg", ".rtn_deg"};
  for (int i = 0; i < 3; ++i) {
    check_range(shifts[i], -kMaxCoordinate, kMaxCoordinate, (std::string(name) + shift_names[i]).c_str());
    check_range(turns[i], -360, 360, (std::string(name) + turn_names[i]).c_str());
  }
  SixNumbers six;
  static_cast<SixDof&>(six) = {c.lat_mm, c.lng_mm, c.vrt_mm, c.pitch_deg, c.roll_deg, c.rtn_deg, 0};
  return six;
}

}  // namespace

sgrt_patient_displacement to_c(const PatientDisplacement& d) {
  return {d.lat_mm, d.lng_mm, d.vrt_mm, d.pitch_deg, d.roll_deg, d.rtn_deg, d.mag_mm};
}

sgrt_couch_correction to_c(const CouchCorrection& c) {
  return {c.lat_mm, c.lng_mm, c.vrt_mm, c.pitch_deg, c.roll_deg, c.rtn_deg, c.mag_mm};
}

}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_frame_shift_from_pose(const double reference_from_live[16], const double isocentre_mm[3],
                                       sgrt_patient_displacement* displacement, sgrt_couch_correction* correction) {
  return guard([&] {
    const Pose pose = rigid(reference_from_live, "reference_from_live");
    const Vec3 isocentre = place(isocentre_mm, "isocentre_mm");
    const sgrt_patient_displacement d = to_c(displacement_of(pose, isocentre));
    const sgrt_couch_correction c = to_c(correction_of(pose, isocentre));
    if (displacement) *displacement = d;
    if (correction) *correction = c;
  });
}

sgrt_status sgrt_frame_pose_from_displacement(const sgrt_patient_displacement* displacement,
                                              const double isocentre_mm[3], double reference_from_live[16]) {
  return guard([&] {
    need(displacement, "displacement");
    need(reference_from_live, "reference_from_live");
    const auto d = from_c<PatientDisplacement>(*displacement, "displacement");
    pose_to_rows(pose_of(d, place(isocentre_mm, "isocentre_mm")), reference_from_live);
  });
}

sgrt_status sgrt_frame_pose_from_correction(const sgrt_couch_correction* correction, const double isocentre_mm[3],
                                            double reference_from_live[16]) {
  return guard([&] {
    need(correction, "correction");
    need(reference_from_live, "reference_from_live");
    const auto c = from_c<CouchCorrection>(*correction, "correction");
    pose_to_rows(pose_of(c, place(isocentre_mm, "isocentre_mm")), reference_from_live);
  });
}

sgrt_status sgrt_frame_four_dof(const double reference_from_live[16], const double isocentre_mm[3],
                                sgrt_couch_correction* correction, sgrt_patient_displacement* remaining) {
  return guard([&] {
    const Pose pose = rigid(reference_from_live, "reference_from_live");
    const FourDof four = four_dof_of(pose, place(isocentre_mm, "isocentre_mm"));
    if (correction) *correction = to_c(four.correction);
    if (remaining) *remaining = to_c(four.remaining);
  });
}

sgrt_status sgrt_frame_fixed_from_dicom(int32_t patient_position, const double isocentre_dicom_mm[3],
                                        double fixed_from_dicom[16]) {
  return guard([&] {
    check_range(patient_position, SGRT_HFS, SGRT_FFDR, "patient_position");
    need(fixed_from_dicom, "fixed_from_dicom");
    const Vec3 isocentre = place(isocentre_dicom_mm, "isocentre_dicom_mm");
    pose_to_rows(sgrt::fixed_from_dicom(static_cast<PatientPosition>(patient_position), isocentre), fixed_from_dicom);
  });
}

sgrt_status sgrt_frame_fixed_from_couch(double couch_deg, double fixed_from_couch[16]) {
  return guard([&] {
    check_range(couch_deg, -360, 360, "couch_deg");
    need(fixed_from_couch, "fixed_from_couch");
    pose_to_rows(sgrt::fixed_from_couch(couch_deg), fixed_from_couch);
  });
}

sgrt_status sgrt_frame_fixed_from_gantry(double gantry_deg, double fixed_from_gantry[16]) {
  return guard([&] {
    check_range(gantry_deg, -360, 360, "gantry_deg");
    need(fixed_from_gantry, "fixed_from_gantry");
    pose_to_rows(sgrt::fixed_from_gantry(gantry_deg), fixed_from_gantry);
  });
}

sgrt_status sgrt_frame_couch_turn(double couch_deg, const double isocentre_mm[3], double pose[16]) {
  return guard([&] {
    check_range(couch_deg, -360, 360, "couch_deg");
    need(pose, "pose");
    pose_to_rows(couch_turn(couch_deg, place(isocentre_mm, "isocentre_mm")), pose);
  });
}
