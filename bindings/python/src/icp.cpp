// Fine registration: the rigid motion that lays live on the reference, with its covariance and observability.
#include <algorithm>

#include "bindings.hpp"

namespace sgrt_py {
namespace {

using IcpHandle = Owned<sgrt_icp, sgrt_icp_free>;

struct Icp {
  sgrt_icp_info info{};
  std::string verdict_text;
  std::vector<std::string> free_words, direction_words;
  std::optional<Doubles> distance_mm;
  std::optional<py::array_t<uint8_t>> inlier;
};

std::string text_of(const sgrt_icp* result, int32_t field, int32_t index = 0) {
  const char* text = sgrt_icp_text(result, field, index);
  return text ? text : "";
}

Icp unpack(IcpHandle handle) {
  const sgrt_icp* result = handle.get();
  const py::capsule base(handle.release(), [](void* raw) { sgrt_icp_free(static_cast<sgrt_icp*>(raw)); });
  Icp icp;
  icp.info.struct_size = sizeof icp.info;
  run([&] { return sgrt_icp_summary(result, &icp.info); });
  icp.verdict_text = text_of(result, SGRT_ICP_VERDICT);
  for (int32_t i = 0; i < icp.info.free_count; ++i) icp.free_words.push_back(text_of(result, SGRT_ICP_WORDS, i));
  for (int32_t i = 0; i < icp.info.direction_count; ++i)
    icp.direction_words.push_back(text_of(result, SGRT_ICP_DIRECTION, i));
  sgrt_view view{};
  run([&] { return sgrt_icp_array(result, SGRT_ICP_DISTANCE, &view); });
  icp.distance_mm = lend<double>(view, base);
  run([&] { return sgrt_icp_array(result, SGRT_ICP_INLIER, &view); });
  icp.inlier = lend<uint8_t>(view, base);
  return icp;
}

struct Reference {
  Owned<sgrt_reference, sgrt_reference_free> handle;
  py::object surface, roi;  // what it was made from, so that it pickles
};

Reference prepare(const py::object& surface, const py::object& roi, Context* context) {
  const auto& s = surface.cast<const Surface&>();
  const Roi* region = roi.is_none() ? nullptr : &roi.cast<const Roi&>();
  Reference reference;
  run(context, [&](sgrt_context* c) {
    return sgrt_reference_create(c, s.handle.get(), region ? region->handle.get() : nullptr, out(reference.handle));
  });
  reference.surface = surface;
  reference.roi = roi;
  return reference;
}

int32_t number_of(const std::string& word, const char* name, std::initializer_list<const char*> words) {
  std::string all;
  for (const char* known : words) {
    if (word == known) return static_cast<int32_t>(std::find(words.begin(), words.end(), known) - words.begin());
    all += (all.empty() ? "" : ", ") + std::string(known);
  }
  invalid(std::string(name) + ": '" + word + "' is unknown; expected one of " + all);
}

struct Options {
  int32_t max_iterations;
  double max_distance_mm, max_angle_deg, min_inlier_share, step_tolerance_mm, weak_sigma_mm, degenerate_sigma_mm;
  bool anywhere;
  const std::string &residual, &kernel;
  double keep_share;

  sgrt_icp_options to_c() const {
    auto options = defaults(sgrt_icp_options_init);
    options.max_iterations = max_iterations;
    options.max_distance_mm = max_distance_mm;
    options.max_angle_deg = max_angle_deg;
    options.min_inlier_share = min_inlier_share;
    options.step_tolerance_mm = step_tolerance_mm;
    options.weak_sigma_mm = weak_sigma_mm;
    options.degenerate_sigma_mm = degenerate_sigma_mm;
    options.anywhere = anywhere ? 1 : 0;
    options.residual = number_of(residual, "residual", {"plane", "point_svd", "point_quaternion", "symmetric"});
    options.kernel = number_of(kernel, "kernel", {"auto", "none", "tukey", "welsch"});
    options.keep_share = keep_share;
    return options;
  }
};

// call(context, isocentre, initial, options, result).
template <class Call>
Icp align_with(const ArrayLike& isocentre_mm, const MaybeArray& initial_reference_from_live, const Options& given,
               Context* context, Call&& call) {
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  std::optional<Mat4> initial;
  if (initial_reference_from_live) initial.emplace(*initial_reference_from_live, "initial_reference_from_live");
  const sgrt_icp_options options = given.to_c();
  IcpHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return call(c, isocentre.v, initial ? initial->v : nullptr, &options, out(handle));
  });
  if (outcome.status == SGRT_OK) return unpack(std::move(handle));
  raise(outcome.status, outcome.message, handle ? py::cast(unpack(std::move(handle))) : py::none());
}

Icp align(const Surface& reference, const Surface& live, const ArrayLike& isocentre_mm, const Roi* roi,
          const MaybeArray& initial_reference_from_live, bool anywhere, int32_t max_iterations, double max_distance_mm,
          double max_angle_deg, double min_inlier_share, double step_tolerance_mm, double weak_sigma_mm,
          double degenerate_sigma_mm, const std::string& residual, const std::string& kernel, double keep_share,
          Context* context) {
  const Options options{max_iterations,    max_distance_mm, max_angle_deg,       min_inlier_share,
                        step_tolerance_mm, weak_sigma_mm,   degenerate_sigma_mm, anywhere,
                        residual,          kernel,          keep_share};
  return align_with(
      isocentre_mm, initial_reference_from_live, options, context,
      [&](sgrt_context* c, const double* iso, const double* initial, const sgrt_icp_options* o, sgrt_icp** result) {
        return sgrt_icp_align(c, reference.handle.get(), live.handle.get(), iso, roi ? roi->handle.get() : nullptr,
                              initial, o, result);
      });
}

Icp align_prepared(const Reference& reference, const Surface& live, const ArrayLike& isocentre_mm,
                   const MaybeArray& initial_reference_from_live, bool anywhere, int32_t max_iterations,
                   double max_distance_mm, double max_angle_deg, double min_inlier_share, double step_tolerance_mm,
                   double weak_sigma_mm, double degenerate_sigma_mm, const std::string& residual,
                   const std::string& kernel, double keep_share, Context* context) {
  const Options options{max_iterations,    max_distance_mm, max_angle_deg,       min_inlier_share,
                        step_tolerance_mm, weak_sigma_mm,   degenerate_sigma_mm, anywhere,
                        residual,          kernel,          keep_share};
  return align_with(
      isocentre_mm, initial_reference_from_live, options, context,
      [&](sgrt_context* c, const double* iso, const double* initial, const sgrt_icp_options* o, sgrt_icp** result) {
        return sgrt_reference_align(c, reference.handle.get(), live.handle.get(), iso, initial, o, result);
      });
}

Icp predict(const Reference& reference, const ArrayLike& isocentre_mm, double live_sigma_mm, Context* context) {
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  IcpHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_reference_predict(c, reference.handle.get(), isocentre.v, live_sigma_mm, out(handle));
  });
  if (outcome.status == SGRT_OK) return unpack(std::move(handle));
  raise(outcome.status, outcome.message, handle ? py::cast(unpack(std::move(handle))) : py::none());
}

const char* verdict_word(const Icp& icp) {
  switch (icp.info.verdict) {
    case SGRT_VERDICT_OK:
      return "ok";
    case SGRT_VERDICT_WEAK:
      return "weak";
    default:
      return "none";
  }
}

constexpr const char* kAlignDoc =
    R"(The rigid motion that lays `live` on `reference`: an Icp, with displacement, correction and covariance.

Point-to-plane ICP with robust weights, refined on the points' own covariances. reference, live: one room frame, mm; missing normals
are estimated. isocentre_mm: 3 numbers, where the motion is reported. roi: the part of the reference that counts; None: all.
initial_reference_from_live: 4 x 4 first guess; None: identity. anywhere: True assumes nothing about the start; the guess is not used.
max_iterations: of closest points and step. max_distance_mm, max_angle_deg: pairs beyond never count. min_inlier_share: below it the
    surfaces do not overlap. step_tolerance_mm: converged when a step moves no inlier by more. weak_sigma_mm: verdict 'weak' when one sigma
    of a motion exceeds it (rotations at 100 mm). degenerate_sigma_mm: Degenerate beyond it.
residual: 'plane', 'point_svd', 'point_quaternion' or 'symmetric'; kernel: 'auto', 'none', 'tukey' or 'welsch'; keep_share: of the pairs,
    the nearest. The defaults are the fast search, any other choice is textbook ICP; to closest points it takes many more iterations.

Raises InsufficientData: fewer than 6 points or pairs. NotFound: no overlap. Degenerate: a direction is free. NotConverged: max_iterations
    came first. These four carry the diagnostics as error.result, its pose NaN. InvalidArgument. Cancelled.
C: sgrt_icp_align)";

constexpr const char* kAlignPreparedDoc = R"(As icp_align, on this reference and its roi.

C: sgrt_reference_align)";

constexpr const char* kReferenceDoc =
    R"(A reference made ready: closest points in constant time, so that a live surface costs only its own points. Immutable.

surface: mm, room frame. roi: the part that counts; None: all.

Raises InsufficientData: fewer than 6 points that count. Cancelled.
C: sgrt_reference_create)";

constexpr const char* kPredictDoc =
    R"(What the reference promises before anything is seen: an Icp without a pose, with covariance and directions.

Of live points as dense as its own, live_sigma_mm along the normal. To choose among regions, prepare each and compare.

Raises Degenerate: motions that the shape leaves free, in error.result. InvalidArgument.
C: sgrt_reference_predict)";

}  // namespace

void register_icp(py::module_& m) {
  const auto d = defaults(sgrt_icp_options_init);
  const auto none = py::none();

  py::class_<Icp>(
      m, "Icp",
      R"(Result of a fine registration. All numbers are NaN where no pose was found, but for counts and observability.

C: sgrt_icp_summary, sgrt_icp_array, sgrt_icp_text)")
      .def_property_readonly(
          "status", [](const Icp& r) { return std::string(sgrt_status_word(r.info.status)); },
          "The word of its status: 'ok', 'degenerate', ...")
      .def_property_readonly("verdict", &verdict_word, "'ok', 'weak', or 'none' without a pose.")
      .def_readonly("verdict_text", &Icp::verdict_text, "'ok', 'weak: ...', or why there is no pose.")
      .def_property_readonly(
          "reference_from_live",
          [](const Icp& r) {
            return fixed_array(r.info.reference_from_live, {4, 4});
          },
          "4 x 4, room frame, mm; the inverse of the displacement.")
      .def_property_readonly(
          "isocentre_mm", [](const Icp& r) { return fixed_array(r.info.isocentre_mm, {3}); },
          "3 numbers: where the motion is reported.")
      .def_property_readonly(
          "displacement", [](const Icp& r) { return r.info.displacement; }, "Where the patient is.")
      .def_property_readonly(
          "correction", [](const Icp& r) { return r.info.correction; }, "What the couch must do.")
      .def_property_readonly(
          "covariance",
          [](const Icp& r) {
            return fixed_array(r.info.covariance, {6, 6});
          },
          "6 x 6, of (rotation rad, translation mm) of the displacement at the isocentre, room axes: "
          "D_true = D exp(delta).")
      .def_property_readonly(
          "sigma_mm", [](const Icp& r) { return fixed_array(r.info.sigma_mm, {3}); }, "One sigma of lat, lng, vrt.")
      .def_property_readonly(
          "sigma_deg", [](const Icp& r) { return fixed_array(r.info.sigma_deg, {3}); }, "One sigma about room X, Y, Z.")
      .def_property_readonly(
          "covariance_random",
          [](const Icp& r) {
            return fixed_array(r.info.covariance_random, {6, 6});
          },
          "6 x 6: the part of the live noise, new in every frame.")
      .def_property_readonly(
          "covariance_shared",
          [](const Icp& r) {
            return fixed_array(r.info.covariance_shared, {6, 6});
          },
          "6 x 6: the part that all frames on this reference share: its noise, the error modes of both surfaces.")
      .def_property_readonly(
          "directions",
          [](const Icp& r) {
            return fixed_array(r.info.direction_motion, {r.info.direction_count, 6});
          },
          "K x 6: eigenvectors of the covariance, the least certain first; unit length with rotations at 100 mm.")
      .def_readonly("direction_words", &Icp::direction_words, "The same in words.")
      .def_property_readonly(
          "direction_sigma_mm",
          [](const Icp& r) { return fixed_array(r.info.direction_sigma_mm, {r.info.direction_count}); },
          "One sigma along each.")
      .def_property_readonly(
          "detectable_mm",
          [](const Icp& r) { return fixed_array(r.info.direction_detectable_mm, {r.info.direction_count}); },
          "The smallest shift along each that is found 95 times in 100 at a false alarm in 20.")
      .def_property_readonly(
          "chi2", [](const Icp& r) { return r.info.chi2; }, "Reduced: 1 where the residuals are as the noise predicts.")
      .def_property_readonly(
          "coarse_score", [](const Icp& r) { return r.info.coarse_score; },
          "Of the search without a start, 0 to 1; NaN where there was none.")
      .def_property_readonly(
          "coarse_runner_up", [](const Icp& r) { return r.info.coarse_runner_up; }, "Score of the best pose elsewhere.")
      .def_property_readonly(
          "free_motions",
          [](const Icp& r) {
            return fixed_array(r.info.free_motion, {r.info.free_count, 6});
          },
          "K x 6: the directions that the data leave free, (rotation rad, translation mm) at the isocentre.")
      .def_readonly("free_words", &Icp::free_words, "The same in words: 'slides along LNG'.")
      .def_property_readonly(
          "rms_mm", [](const Icp& r) { return r.info.rms_mm; },
          "Weighted RMS of the inliers' distances along the normal.")
      .def_property_readonly(
          "inlier_share", [](const Icp& r) { return r.info.inlier_share; },
          "Of the live points whose match lies in the ROI.")
      .def_property_readonly(
          "iterations", [](const Icp& r) { return r.info.iterations; }, "Iterations done.")
      .def_property_readonly(
          "pair_count", [](const Icp& r) { return r.info.pair_count; }, "Inlier pairs of the last iteration.")
      .def_readonly("distance_mm", &Icp::distance_mm,
                    "N or H x W as live: signed distance map at the pose found, mm; NaN without correspondence.")
      .def_readonly("inlier", &Icp::inlier, "uint8, like it: 1 where the point took part.")
      .def("__repr__", [](const Icp& r) {
        return py::str("<sgrt.Icp {}, verdict {}, {!r}>")
            .format(sgrt_status_word(r.info.status), verdict_word(r), py::cast(r.info.displacement));
      });

  py::class_<Reference>(m, "Reference", kReferenceDoc)
      .def(py::init(&prepare), py::arg("surface"), py::kw_only(), py::arg("roi") = none, py::arg("context") = none)
      .def("align", &align_prepared, py::arg("live"), py::kw_only(), py::arg("isocentre_mm"),
           py::arg("initial_reference_from_live") = none, py::arg("anywhere") = false,
           py::arg("max_iterations") = d.max_iterations, py::arg("max_distance_mm") = d.max_distance_mm,
           py::arg("max_angle_deg") = d.max_angle_deg, py::arg("min_inlier_share") = d.min_inlier_share,
           py::arg("step_tolerance_mm") = d.step_tolerance_mm, py::arg("weak_sigma_mm") = d.weak_sigma_mm,
           py::arg("degenerate_sigma_mm") = d.degenerate_sigma_mm, py::arg("residual") = "plane",
           py::arg("kernel") = "auto", py::arg("keep_share") = d.keep_share, py::arg("context") = none,
           kAlignPreparedDoc)
      .def("predict", &predict, py::kw_only(), py::arg("isocentre_mm"), py::arg("live_sigma_mm"),
           py::arg("context") = none, kPredictDoc)
      .def("__repr__", [](const Reference& r) { return py::str("<sgrt.Reference of {!r}>").format(r.surface); })
      .def(py::pickle([](const Reference& r) { return py::make_tuple(r.surface, r.roi); },
                      [](const py::tuple& state) { return prepare(state[0], state[1], nullptr); }));

  m.def("icp_align", &align, py::arg("reference"), py::arg("live"), py::kw_only(), py::arg("isocentre_mm"),
        py::arg("roi") = none, py::arg("initial_reference_from_live") = none, py::arg("anywhere") = false,
        py::arg("max_iterations") = d.max_iterations, py::arg("max_distance_mm") = d.max_distance_mm,
        py::arg("max_angle_deg") = d.max_angle_deg, py::arg("min_inlier_share") = d.min_inlier_share,
        py::arg("step_tolerance_mm") = d.step_tolerance_mm, py::arg("weak_sigma_mm") = d.weak_sigma_mm,
        py::arg("degenerate_sigma_mm") = d.degenerate_sigma_mm, py::arg("residual") = "plane",
        py::arg("kernel") = "auto", py::arg("keep_share") = d.keep_share, py::arg("context") = none, kAlignDoc);
}

}  // namespace sgrt_py
