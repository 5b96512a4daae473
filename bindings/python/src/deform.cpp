// Registration of a body that is not rigid: the rigid part apart from the change of shape.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

using DeformHandle = Owned<sgrt_deform, sgrt_deform_free>;

struct Deform {
  sgrt_deform_info info{};
  std::string verdict_text;
  std::vector<std::string> free_words;
  std::optional<py::array_t<uint8_t>> part;
  std::optional<Doubles> distance_mm, deformation_mm;
};

std::string text_of(const sgrt_deform* result, int32_t field, int32_t index = 0) {
  const char* text = sgrt_deform_text(result, field, index);
  return text ? text : "";
}

Deform unpack(DeformHandle handle) {
  const sgrt_deform* result = handle.get();
  const py::capsule base(handle.release(), [](void* raw) { sgrt_deform_free(static_cast<sgrt_deform*>(raw)); });
  Deform d;
  d.info.struct_size = sizeof d.info;
  run([&] { return sgrt_deform_summary(result, &d.info); });
  d.verdict_text = text_of(result, SGRT_DEFORM_VERDICT);
  for (int32_t i = 0; i < d.info.free_count; ++i) d.free_words.push_back(text_of(result, SGRT_DEFORM_WORDS, i));
  sgrt_view view{};
  run([&] { return sgrt_deform_array(result, SGRT_DEFORM_PART, &view); });
  d.part = lend<uint8_t>(view, base);
  run([&] { return sgrt_deform_array(result, SGRT_DEFORM_DISTANCE, &view); });
  d.distance_mm = lend<double>(view, base);
  run([&] { return sgrt_deform_array(result, SGRT_DEFORM_MAP, &view); });
  d.deformation_mm = lend<double>(view, base);
  return d;
}

int32_t mode_of(const std::string& name) {
  constexpr std::pair<const char*, int32_t> kModes[] = {
      {"rigid", SGRT_DEFORM_RIGID}, {"similarity", SGRT_DEFORM_SIMILARITY}, {"field", SGRT_DEFORM_FIELD}};
  for (const auto& [word, code] : kModes) {
    if (name == word) return code;
  }
  invalid("mode: '" + name + "' is unknown; expected rigid, similarity or field");
}

Deform align(const Surface& reference, const Surface& live, const ArrayLike& isocentre_mm, const Roi* roi,
             const MaybeArray& initial_reference_from_live, const std::string& mode, double min_rigid_share,
             double max_structure_mm, double max_rivalry, double stiffness, double max_distance_mm,
             double min_inlier_share, Context* context) {
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  std::optional<Mat4> initial;
  if (initial_reference_from_live) initial.emplace(*initial_reference_from_live, "initial_reference_from_live");
  auto options = defaults(sgrt_deform_options_init);
  options.mode = mode_of(mode);
  options.min_rigid_share = min_rigid_share;
  options.max_structure_mm = max_structure_mm;
  options.max_rivalry = max_rivalry;
  options.stiffness = stiffness;
  auto icp = defaults(sgrt_icp_options_init);
  icp.max_distance_mm = max_distance_mm;
  icp.min_inlier_share = min_inlier_share;
  DeformHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_deform_align(c, reference.handle.get(), live.handle.get(), isocentre.v,
                             roi ? roi->handle.get() : nullptr, initial ? initial->v : nullptr, &options, &icp,
                             out(handle));
  });
  if (outcome.status == SGRT_OK) return unpack(std::move(handle));
  raise(outcome.status, outcome.message, handle ? py::cast(unpack(std::move(handle))) : py::none());
}

constexpr const char* kAlignDoc =
    R"(Lays `live` on `reference` although the body changed its shape: a Deform, with the motion of what moved rigidly.

reference, live, isocentre_mm, roi, initial_reference_from_live, max_distance_mm, min_inlier_share: as icp_align.
mode: 'rigid': finds the region that moved rigidly and reports its motion alone; 'similarity': one scale for all, live first scaled
    about the isocentre; 'field': as 'rigid', and a smooth displacement field over that motion (deformation_mm).
min_rigid_share: of the region's seen area; below it nothing can be told. max_structure_mm: coherent change of shape that may be
left in what is taken for rigid. max_rivalry: above it another motion (runner_up_rivalry) makes the answer
ambiguous. stiffness: of the field, relative.

Raises NotFound: cannot tell, too little moved as one; no overlap. Degenerate: cannot tell, two motions explain the region nearly as
    well; a direction or the size is free. Otherwise as icp_align. These carry the diagnostics as error.result, its pose NaN.
C: sgrt_deform_align)";

template <class Get>
void number(py::class_<Deform>& cls, const char* name, Get get, const char* doc) {
  cls.def_property_readonly(
      name, [get](const Deform& d) { return get(d.info); }, doc);
}

}  // namespace

void register_deform(py::module_& m) {
  const auto d = defaults(sgrt_deform_options_init);
  const auto icp = defaults(sgrt_icp_options_init);
  const auto none = py::none();
  py::class_<Deform> cls(m, "Deform",
                         R"(Result of deform_align. All numbers are NaN where they were not found.

C: sgrt_deform_summary, sgrt_deform_array, sgrt_deform_text)");
  cls.def_property_readonly(
         "status", [](const Deform& r) { return std::string(sgrt_status_word(r.info.status)); },
         "The word of its status: 'ok', 'not_found', ...")
      .def_property_readonly(
          "verdict",
          [](const Deform& r) {
            return r.info.verdict == SGRT_VERDICT_OK ? "ok" : r.info.verdict == SGRT_VERDICT_WEAK ? "weak" : "none";
          },
          "'ok', 'weak', or 'none' without a pose.")
      .def_readonly("verdict_text", &Deform::verdict_text, "'ok', 'weak: ...', or why it cannot tell.")
      .def_readonly("free_words", &Deform::free_words, "The directions that the data leave free, in words.")
      .def_property_readonly(
          "reference_from_live",
          [](const Deform& r) {
            return fixed_array(r.info.reference_from_live, {4, 4});
          },
          "4 x 4, room frame, mm: of the rigid part.")
      .def_property_readonly(
          "isocentre_mm", [](const Deform& r) { return fixed_array(r.info.isocentre_mm, {3}); },
          "3 numbers: where the motion is reported.")
      .def_property_readonly(
          "displacement", [](const Deform& r) { return r.info.displacement; }, "Where the patient is.")
      .def_property_readonly(
          "correction", [](const Deform& r) { return r.info.correction; }, "What the couch must do.")
      .def_property_readonly(
          "covariance",
          [](const Deform& r) {
            return fixed_array(r.info.covariance, {6, 6});
          },
          "6 x 6, as Icp.covariance, with what the change of shape may do to it.")
      .def_property_readonly(
          "sigma_mm", [](const Deform& r) { return fixed_array(r.info.sigma_mm, {3}); }, "One sigma of lat, lng, vrt.")
      .def_property_readonly(
          "sigma_deg", [](const Deform& r) { return fixed_array(r.info.sigma_deg, {3}); },
          "One sigma about room X, Y, Z.");
  number(
      cls, "rms_mm", [](const sgrt_deform_info& i) { return i.rms_mm; }, "Of the rigid part.");
  number(
      cls, "inlier_share", [](const sgrt_deform_info& i) { return i.inlier_share; }, "Of the rigid part's points.");
  number(
      cls, "rigid_share", [](const sgrt_deform_info& i) { return i.rigid_share; },
      "Of the region's seen area: what moved as one.");
  number(
      cls, "structure_mm", [](const sgrt_deform_info& i) { return i.structure_mm; },
      "Coherent change of shape found within it, rms.");
  number(
      cls, "runner_up_share", [](const sgrt_deform_info& i) { return i.runner_up_share; },
      "Explained by the best motion that differs from the answer; 0: there is none.");
  number(
      cls, "runner_up_distance_mm", [](const sgrt_deform_info& i) { return i.runner_up_distance_mm; },
      "By which it differs at the isocentre, turns at 100 mm.");
  number(
      cls, "runner_up_rivalry", [](const sgrt_deform_info& i) { return i.runner_up_rivalry; },
      "Area that it alone explains over area that the answer alone explains.");
  number(
      cls, "scale", [](const sgrt_deform_info& i) { return i.scale; }, "Live to reference; 1 but for 'similarity'.");
  number(
      cls, "scale_sigma", [](const sgrt_deform_info& i) { return i.scale_sigma; }, "One sigma of it.");
  number(
      cls, "deformation_rms_mm", [](const sgrt_deform_info& i) { return i.deformation_rms_mm; }, "Of the map.");
  number(
      cls, "deformation_max_mm", [](const sgrt_deform_info& i) { return i.deformation_max_mm; }, "Of the map.");
  cls.def_readonly("part", &Deform::part,
                   "uint8, N or H x W as live: 1 moved rigidly, 0 changed its shape, 255 not known.")
      .def_readonly("distance_mm", &Deform::distance_mm, "Like it: signed distance map at the rigid part's pose, mm.")
      .def_readonly(
          "deformation_mm", &Deform::deformation_mm,
          "N x 3 or H x W x 3: the change of shape of each live point, mm, reference axes; None but for 'field'.")
      .def("__repr__", [](const Deform& r) {
        return py::str("<sgrt.Deform {}, {:.0f} % rigid, {!r}>")
            .format(sgrt_status_word(r.info.status), 100 * r.info.rigid_share, py::cast(r.info.displacement));
      });

  m.def("deform_align", &align, py::arg("reference"), py::arg("live"), py::kw_only(), py::arg("isocentre_mm"),
        py::arg("roi") = none, py::arg("initial_reference_from_live") = none, py::arg("mode") = "rigid",
        py::arg("min_rigid_share") = d.min_rigid_share, py::arg("max_structure_mm") = d.max_structure_mm,
        py::arg("max_rivalry") = d.max_rivalry, py::arg("stiffness") = d.stiffness,
        py::arg("max_distance_mm") = icp.max_distance_mm, py::arg("min_inlier_share") = icp.min_inlier_share,
        py::arg("context") = none, kAlignDoc);
}

}  // namespace sgrt_py
