// Coarse registration of landmarks: a start for the fine one, with its covariance.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

using CoarseHandle = Owned<sgrt_coarse, sgrt_coarse_free>;

struct Coarse {
  sgrt_coarse_info info{};
  std::string verdict_text;
  std::optional<Doubles> distance_mm;
  std::optional<py::array_t<uint8_t>> inlier;
};

Coarse unpack(CoarseHandle handle) {
  const sgrt_coarse* result = handle.get();
  const py::capsule base(handle.release(), [](void* raw) { sgrt_coarse_free(static_cast<sgrt_coarse*>(raw)); });
  Coarse c;
  c.info.struct_size = sizeof c.info;
  run([&] { return sgrt_coarse_summary(result, &c.info); });
  c.verdict_text = sgrt_coarse_text(result, SGRT_COARSE_VERDICT);
  sgrt_view view{};
  run([&] { return sgrt_coarse_array(result, SGRT_COARSE_DISTANCE, &view); });
  c.distance_mm = lend<double>(view, base);
  run([&] { return sgrt_coarse_array(result, SGRT_COARSE_INLIER, &view); });
  c.inlier = lend<uint8_t>(view, base);
  return c;
}

Coarse align(const ArrayLike& reference_mm, const ArrayLike& reference_ids, const ArrayLike& live_mm,
             const ArrayLike& live_ids, const ArrayLike& isocentre_mm, const MaybeArray& reference_covariance_mm2,
             const MaybeArray& live_covariance_mm2, double sigma_mm, double min_share, double weak_sigma_mm,
             double degenerate_sigma_mm, Context* context) {
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  const InView a(reference_mm, "reference_mm", Accept::kFloats), b(live_mm, "live_mm", Accept::kFloats);
  const InView a_ids(reference_ids, "reference_ids", Accept::kIndices), b_ids(live_ids, "live_ids", Accept::kIndices);
  const InView a_noise(reference_covariance_mm2, "reference_covariance_mm2", Accept::kFloats);
  const InView b_noise(live_covariance_mm2, "live_covariance_mm2", Accept::kFloats);
  auto options = defaults(sgrt_coarse_options_init);
  options.sigma_mm = sigma_mm;
  options.min_share = min_share;
  options.weak_sigma_mm = weak_sigma_mm;
  options.degenerate_sigma_mm = degenerate_sigma_mm;
  CoarseHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_coarse_align(c, &a.view, &a_ids.view, &a_noise.view, &b.view, &b_ids.view, &b_noise.view, isocentre.v,
                             &options, out(handle));
  });
  if (outcome.status == SGRT_OK) return unpack(std::move(handle));
  raise(outcome.status, outcome.message, handle ? py::cast(unpack(std::move(handle))) : py::none());
}

const char* verdict_word(const Coarse& c) {
  return c.info.verdict == SGRT_VERDICT_OK ? "ok" : c.info.verdict == SGRT_VERDICT_WEAK ? "weak" : "none";
}

constexpr const char* kAlignDoc =
    R"(The rigid motion that lays landmarks of the live body on those of one id on the reference: a Coarse.

reference_mm: N x 3, live_mm: M x 3, mm, one room frame. reference_ids, live_ids: N and M integers; an id that occurs twice stands for
candidates, of which at most one is right. ..._covariance_mm2: N x 3 x 3, M x 3 x 3; None: sigma_mm of each coordinate. min_share: of the
ids on both sides that must agree. weak_sigma_mm, degenerate_sigma_mm: verdict 'weak' and Degenerate beyond, turns at 100 mm.

Raises InsufficientData: fewer than 3 common ids. NotFound: no three agree, or too few. Degenerate: the landmarks lie on a line, or another
    motion explains as many. These carry the diagnostics as error.result. InvalidArgument. LimitError: more than 64 pairs. Cancelled.
C: sgrt_coarse_align)";

}  // namespace

void register_coarse(py::module_& m) {
  const auto d = defaults(sgrt_coarse_options_init);
  const auto none = py::none();
  const auto info = [](auto member) { return [member](const Coarse& c) { return c.info.*member; }; };
  py::class_<Coarse>(
      m, "Coarse",
      R"(Result of a registration of landmarks. All numbers are NaN where no pose was found, but for the counts.

C: sgrt_coarse_summary, sgrt_coarse_array, sgrt_coarse_text)")
      .def_property_readonly(
          "status", [](const Coarse& c) { return std::string(sgrt_status_word(c.info.status)); },
          "The word of its status: 'ok', 'degenerate', ...")
      .def_property_readonly("verdict", &verdict_word, "'ok', 'weak', or 'none' without a pose.")
      .def_readonly("verdict_text", &Coarse::verdict_text, "'ok', 'weak: ...', or why there is no pose.")
      .def_property_readonly(
          "reference_from_live",
          [](const Coarse& c) {
            return fixed_array(c.info.reference_from_live, {4, 4});
          },
          "4 x 4, room frame, mm; the inverse of the displacement.")
      .def_property_readonly(
          "isocentre_mm", [](const Coarse& c) { return fixed_array(c.info.isocentre_mm, {3}); }, "3 numbers.")
      .def_property_readonly("displacement", info(&sgrt_coarse_info::displacement), "Where the patient is.")
      .def_property_readonly("correction", info(&sgrt_coarse_info::correction), "What the couch must do.")
      .def_property_readonly(
          "covariance",
          [](const Coarse& c) {
            return fixed_array(c.info.covariance, {6, 6});
          },
          "6 x 6, of (rotation rad, translation mm) of the displacement at the isocentre, room axes.")
      .def_property_readonly(
          "sigma_mm", [](const Coarse& c) { return fixed_array(c.info.sigma_mm, {3}); }, "One sigma of lat, lng, vrt.")
      .def_property_readonly(
          "sigma_deg", [](const Coarse& c) { return fixed_array(c.info.sigma_deg, {3}); },
          "One sigma about room X, Y, Z.")
      .def_property_readonly("common_count", info(&sgrt_coarse_info::common_count), "Ids on both sides.")
      .def_property_readonly("used_count", info(&sgrt_coarse_info::used_count), "That agree on the motion.")
      .def_property_readonly("runner_up_count", info(&sgrt_coarse_info::runner_up_count),
                             "That agree on the best motion that differs from it.")
      .def_property_readonly("rms_mm", info(&sgrt_coarse_info::rms_mm), "Distance of the landmarks that agree.")
      .def_property_readonly("chi2", info(&sgrt_coarse_info::chi2),
                             "Reduced: 1 where they lie as far apart as their covariances predict.")
      .def_readonly("distance_mm", &Coarse::distance_mm,
                    "M: of each live landmark from its partner at the pose; NaN without one.")
      .def_readonly("inlier", &Coarse::inlier, "uint8, M: 1 where it agrees.")
      .def("__repr__", [](const Coarse& c) {
        return py::str("<sgrt.Coarse {}, verdict {}, {!r}>")
            .format(sgrt_status_word(c.info.status), verdict_word(c), py::cast(c.info.displacement));
      });
  m.def("coarse_align", &align, py::arg("reference_mm"), py::arg("reference_ids"), py::arg("live_mm"),
        py::arg("live_ids"), py::kw_only(), py::arg("isocentre_mm"), py::arg("reference_covariance_mm2") = none,
        py::arg("live_covariance_mm2") = none, py::arg("sigma_mm") = d.sigma_mm, py::arg("min_share") = d.min_share,
        py::arg("weak_sigma_mm") = d.weak_sigma_mm, py::arg("degenerate_sigma_mm") = d.degenerate_sigma_mm,
        py::arg("context") = none, kAlignDoc);
}

}  // namespace sgrt_py
