// The six numbers of a registration and the frames of the room (IEC 61217, DICOM, couch).
#include "bindings.hpp"

#include <cmath>

namespace sgrt_py {
namespace {

// PatientDisplacement and CouchCorrection hold the same seven names but mean opposites: two types that do not convert.
template <class Shift>
struct Field {
  const char* name;
  double Shift::*member;
  const char* doc;
};

template <class Shift>
std::array<Field<Shift>, 7> fields() {
  return {{{"lat_mm", &Shift::lat_mm, "Along room X, mm."},
           {"lng_mm", &Shift::lng_mm, "Along room Y, mm."},
           {"vrt_mm", &Shift::vrt_mm, "Along room Z, mm."},
           {"pitch_deg", &Shift::pitch_deg, "About room X, degrees."},
           {"roll_deg", &Shift::roll_deg, "About room Y, degrees."},
           {"rtn_deg", &Shift::rtn_deg, "About room Z, degrees."},
           {"mag_mm", &Shift::mag_mm, "Length of the translation, mm; NaN where it was not computed."}}};
}

template <class Shift>
py::typing::Dict<py::str, double> as_dict(const Shift& shift) {
  py::typing::Dict<py::str, double> numbers;
  for (const auto& field : fields<Shift>()) numbers[field.name] = shift.*field.member;
  return numbers;
}

// NaN equals NaN here: two results without a pose are the same result.
template <class Shift>
bool equal(const Shift& a, const Shift& b) {
  for (const auto& field : fields<Shift>()) {
    const double x = a.*field.member, y = b.*field.member;
    if (!(x == y || (std::isnan(x) && std::isnan(y)))) return false;
  }
  return true;
}

template <class Shift>
void register_shift(py::module_& m, const char* name, const char* doc) {
  py::class_<Shift> cls(m, name, doc);
  cls.def(py::init([](double lat, double lng, double vrt, double pitch, double roll, double rtn, double mag) {
            return Shift{lat, lng, vrt, pitch, roll, rtn, mag};
          }),
          py::kw_only(), py::arg("lat_mm") = 0.0, py::arg("lng_mm") = 0.0, py::arg("vrt_mm") = 0.0,
          py::arg("pitch_deg") = 0.0, py::arg("roll_deg") = 0.0, py::arg("rtn_deg") = 0.0,
          py::arg_v("mag_mm", NAN, "float('nan')"));
  for (const auto& field : fields<Shift>()) cls.def_readonly(field.name, field.member, field.doc);
  cls.def("as_dict", &as_dict<Shift>, "The seven numbers by name, in the order of the result file.")
      .def("__eq__", &equal<Shift>, py::is_operator(), py::arg("other"))
      .def("__repr__",
           [name](const Shift& s) {
             return py::str(
                        "{}(lat_mm={:.4g}, lng_mm={:.4g}, vrt_mm={:.4g}, pitch_deg={:.4g}, roll_deg={:.4g}, "
                        "rtn_deg={:.4g}, mag_mm={:.4g})")
                 .format(name, s.lat_mm, s.lng_mm, s.vrt_mm, s.pitch_deg, s.roll_deg, s.rtn_deg, s.mag_mm);
           })
      .def(py::pickle(
          [](const Shift& s) {
            return py::make_tuple(s.lat_mm, s.lng_mm, s.vrt_mm, s.pitch_deg, s.roll_deg, s.rtn_deg, s.mag_mm);
          },
          [](const py::tuple& t) {
            const auto n = [&](int i) { return t[i].cast<double>(); };
            return Shift{n(0), n(1), n(2), n(3), n(4), n(5), n(6)};
          }));
}

std::pair<sgrt_patient_displacement, sgrt_couch_correction> shift_from_pose(const ArrayLike& reference_from_live,
                                                                            const ArrayLike& isocentre_mm) {
  const Mat4 pose(reference_from_live, "reference_from_live");
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  std::pair<sgrt_patient_displacement, sgrt_couch_correction> shift{};
  run([&] { return sgrt_frame_shift_from_pose(pose.v, isocentre.v, &shift.first, &shift.second); });
  return shift;
}

template <class Shift, sgrt_status (*convert)(const Shift*, const double*, double*)>
Doubles pose_from(const Shift& shift, const ArrayLike& isocentre_mm) {
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  double pose[16];
  run([&] { return convert(&shift, isocentre.v, pose); });
  return fixed_array(pose, {4, 4});
}

int32_t position_of(const std::string& name) {
  constexpr std::pair<const char*, int32_t> kPositions[] = {
      {"HFS", SGRT_HFS},   {"HFP", SGRT_HFP},   {"FFS", SGRT_FFS},   {"FFP", SGRT_FFP},
      {"HFDL", SGRT_HFDL}, {"HFDR", SGRT_HFDR}, {"FFDL", SGRT_FFDL}, {"FFDR", SGRT_FFDR}};
  for (const auto& [word, code] : kPositions) {
    if (name == word) return code;
  }
  invalid("patient_position: '" + name + "' is unknown; expected HFS, HFP, FFS, FFP, HFDL, HFDR, FFDL or FFDR");
}

Doubles fixed_from_dicom(const std::string& patient_position, const ArrayLike& isocentre_dicom_mm) {
  const int32_t position = position_of(patient_position);
  const Vec3 isocentre(isocentre_dicom_mm, "isocentre_dicom_mm");
  double pose[16];
  run([&] { return sgrt_frame_fixed_from_dicom(position, isocentre.v, pose); });
  return fixed_array(pose, {4, 4});
}

std::pair<sgrt_couch_correction, sgrt_patient_displacement> four_dof(const ArrayLike& reference_from_live,
                                                                     const ArrayLike& isocentre_mm) {
  const Mat4 pose(reference_from_live, "reference_from_live");
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  std::pair<sgrt_couch_correction, sgrt_patient_displacement> four{};
  run([&] { return sgrt_frame_four_dof(pose.v, isocentre.v, &four.first, &four.second); });
  return four;
}

Doubles fixed_from_gantry(double gantry_deg) {
  double pose[16];
  run([&] { return sgrt_frame_fixed_from_gantry(gantry_deg, pose); });
  return fixed_array(pose, {4, 4});
}

Doubles couch_turn(double couch_deg, const ArrayLike& isocentre_mm) {
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  double pose[16];
  run([&] { return sgrt_frame_couch_turn(couch_deg, isocentre.v, pose); });
  return fixed_array(pose, {4, 4});
}

Doubles fixed_from_couch(double couch_deg) {
  double pose[16];
  run([&] { return sgrt_frame_fixed_from_couch(couch_deg, pose); });
  return fixed_array(pose, {4, 4});
}

constexpr const char* kDisplacementDoc =
    R"(Where the patient is: D(x) = R (x - iso) + iso + t maps the reference (the plan) to the live patient.

R = Rz(rtn) Rx(pitch) Ry(roll), right-handed about room X, Y, Z; (lat, lng, vrt) = t. Its opposite is a CouchCorrection.
C: sgrt_patient_displacement)";

constexpr const char* kCorrectionDoc =
    R"(What the couch must do: the inverse of the displacement, decomposed in the same way about the isocentre.

R^T and -R^T t, which is not minus the six numbers of the PatientDisplacement.
C: sgrt_couch_correction)";

}  // namespace

void register_frame(py::module_& m) {
  register_shift<sgrt_patient_displacement>(m, "PatientDisplacement", kDisplacementDoc);
  register_shift<sgrt_couch_correction>(m, "CouchCorrection", kCorrectionDoc);

  m.def("frame_shift_from_pose", &shift_from_pose, py::arg("reference_from_live"), py::arg("isocentre_mm"),
        R"((PatientDisplacement, CouchCorrection) of a registration.

reference_from_live: 4 x 4, room frame, the inverse of the displacement D. isocentre_mm: 3 numbers. At pitch = +-90 deg roll is 0.

Raises InvalidArgument: not a rigid motion within 1e-6, non-finite.
C: sgrt_frame_shift_from_pose)");
  m.def("frame_pose_from_displacement", &pose_from<sgrt_patient_displacement, sgrt_frame_pose_from_displacement>,
        py::arg("displacement"), py::arg("isocentre_mm"),
        R"(reference_from_live, 4 x 4, of a PatientDisplacement about isocentre_mm (3 numbers); mag_mm is ignored.

Raises InvalidArgument: non-finite.
C: sgrt_frame_pose_from_displacement)");
  m.def("frame_pose_from_correction", &pose_from<sgrt_couch_correction, sgrt_frame_pose_from_correction>,
        py::arg("correction"), py::arg("isocentre_mm"),
        R"(reference_from_live, 4 x 4, of a CouchCorrection about isocentre_mm (3 numbers); mag_mm is ignored.

Raises InvalidArgument: non-finite.
C: sgrt_frame_pose_from_correction)");
  m.def("frame_fixed_from_dicom", &fixed_from_dicom, py::arg("patient_position"), py::arg("isocentre_dicom_mm"),
        R"(IEC 61217 fixed (couch at 0, the plan's isocentre at the origin) from DICOM patient coordinates (LPS), 4 x 4.

patient_position: 'HFS', 'HFP', 'FFS', 'FFP', 'HFDL', 'HFDR', 'FFDL' or 'FFDR'. isocentre_dicom_mm: 3 numbers, the plan's (300A,012C).

Raises InvalidArgument: an unknown position, non-finite.
C: sgrt_frame_fixed_from_dicom)");
  m.def("frame_fixed_from_couch", &fixed_from_couch, py::arg("couch_deg"),
        R"(IEC 61217 fixed from the couch turned by couch_deg, counter-clockwise seen from above: Rz, 4 x 4.

Raises InvalidArgument: non-finite.
C: sgrt_frame_fixed_from_couch)");
  m.def("frame_fixed_from_gantry", &fixed_from_gantry, py::arg("gantry_deg"),
        R"(IEC 61217 fixed from the gantry turned by gantry_deg, clockwise seen by who faces it: Ry, 4 x 4.

Raises InvalidArgument: non-finite.
C: sgrt_frame_fixed_from_gantry)");
  m.def("frame_couch_turn", &couch_turn, py::arg("couch_deg"), py::arg("isocentre_mm"),
        R"(How what lies on the couch moves in the room when the couch turns from 0 to couch_deg, 4 x 4.

About the vertical through isocentre_mm (3 numbers), counter-clockwise seen from above; for Surface.moved and Roi.moved.

Raises InvalidArgument: non-finite.
C: sgrt_frame_couch_turn)");
  m.def("frame_four_dof", &four_dof, py::arg("reference_from_live"), py::arg("isocentre_mm"),
        R"((CouchCorrection, PatientDisplacement): what a couch without pitch and roll can do, and what then remains.

The correction by lat, lng, vrt and rtn brings the isocentre back exactly and takes away the turn about the vertical; the
patient's pitch and roll remain. reference_from_live: 4 x 4. isocentre_mm: 3 numbers.

Raises InvalidArgument: not a rigid motion within 1e-6, non-finite.
C: sgrt_frame_four_dof)");
}

}  // namespace sgrt_py
