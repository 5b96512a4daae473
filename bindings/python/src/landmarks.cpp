// Landmark models, and landmarks on a surface.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

struct Model {
  Owned<sgrt_landmark_model, sgrt_landmark_model_free> handle;
};

using Handle = Owned<sgrt_landmarks, sgrt_landmarks_free>;

struct Landmarks {
  sgrt_landmarks_info info{};
  std::string message;
  std::vector<std::string> names;
  Doubles positions_mm, covariance_mm2, repeat_covariance_mm2, scores;
};

std::string text_of(const Model& m, int32_t field, int32_t index = 0) {
  const char* text = sgrt_landmark_model_text(m.handle.get(), field, index);
  return text ? text : "";
}

std::vector<std::string> names_of(const Model& m) {
  std::vector<std::string> names;
  while (const char* name =
             sgrt_landmark_model_text(m.handle.get(), SGRT_LANDMARK_MODEL_NAME, static_cast<int32_t>(names.size())))
    names.emplace_back(name);
  return names;
}

Doubles array_of(const py::object& self, int32_t field) {
  sgrt_view view{};
  run([&] { return sgrt_landmark_model_array(self.cast<const Model&>().handle.get(), field, &view); });
  return *lend<double>(view, self);
}

Model from_json(const std::string& json) {
  Model model;
  run([&] { return sgrt_landmark_model_from_json(json.data(), json.size(), out(model.handle)); });
  return model;
}

Model head() {
  Model model;
  run([&] { return sgrt_landmark_model_head(out(model.handle)); });
  return model;
}

Model learn(const Surface& reference, const Model* named, int32_t count, double scale_mm, double patch_mm,
            Context* context) {
  auto options = defaults(sgrt_landmark_learn_options_init);
  options.count = count;
  options.scale_mm = scale_mm;
  options.patch_mm = patch_mm;
  Model model;
  run(context, [&](sgrt_context* c) {
    return sgrt_landmark_model_learn(c, reference.handle.get(), named ? named->handle.get() : nullptr, &options,
                                     out(model.handle));
  });
  return model;
}

Landmarks unpack(Handle handle) {
  const sgrt_landmarks* result = handle.get();
  const py::capsule base(handle.release(), [](void* raw) { sgrt_landmarks_free(static_cast<sgrt_landmarks*>(raw)); });
  Landmarks l;
  l.info.struct_size = sizeof l.info;
  run([&] { return sgrt_landmarks_summary(result, &l.info); });
  l.message = sgrt_landmarks_text(result, SGRT_LANDMARKS_MESSAGE, 0);
  for (int32_t i = 0; i < l.info.point_count; ++i)
    l.names.emplace_back(sgrt_landmarks_text(result, SGRT_LANDMARKS_NAME, i));
  const auto array = [&](int32_t field) {
    sgrt_view view{};
    run([&] { return sgrt_landmarks_array(result, field, &view); });
    return *lend<double>(view, base);
  };
  l.positions_mm = array(SGRT_LANDMARKS_POSITIONS);
  l.covariance_mm2 = array(SGRT_LANDMARKS_COVARIANCE);
  l.repeat_covariance_mm2 = array(SGRT_LANDMARKS_REPEAT_COVARIANCE);
  l.scores = array(SGRT_LANDMARKS_SCORES);
  return l;
}

Landmarks find(const Surface& surface, const Model* model, int32_t min_points, double min_score, double noise_mm,
               Context* context) {
  auto options = defaults(sgrt_landmarks_options_init);
  options.min_points = min_points;
  options.min_score = min_score;
  options.noise_mm = noise_mm;
  std::optional<Model> own;
  if (!model) own.emplace(head());
  const sgrt_landmark_model* used = model ? model->handle.get() : own->handle.get();
  Handle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_landmarks_find(c, surface.handle.get(), used, &options, out(handle));
  });
  if (outcome.status == SGRT_OK) return unpack(std::move(handle));
  raise(outcome.status, outcome.message, handle ? py::cast(unpack(std::move(handle))) : py::none());
}

}  // namespace

void register_landmarks(py::module_& m) {
  const auto none = py::none();
  const auto learning = defaults(sgrt_landmark_learn_options_init);
  const auto finding = defaults(sgrt_landmarks_options_init);
  py::class_<Model>(
      m, "LandmarkModel",
      R"(Named points of a body with their curvature and places: of any head, or of a patient's own reference.

C: sgrt_landmark_model)")
      .def_static("head", &head, "Any adult head, 11 points.\n\nC: sgrt_landmark_model_head")
      .def_static("from_json", &from_json, py::arg("json"),
                  "From text of schema \"sgrt-landmark-model/1\".\n\nRaises FormatError. C: "
                  "sgrt_landmark_model_from_json")
      .def_static("learn", &learn, py::arg("reference"), py::arg("named") = none, py::kw_only(),
                  py::arg("count") = learning.count, py::arg("scale_mm") = learning.scale_mm,
                  py::arg("patch_mm") = learning.patch_mm, py::arg("context") = none,
                  R"(A patient's own model from a reference Surface with normals.

named: a model whose points are looked for and kept under their names; None: the most distinctive points, p01, p02 ...
count: most points, where none are named. scale_mm: radius at which curvature is taken, 0: chosen. patch_mm: of the skin kept.

Raises NotFound: `named` is not there, or too little stands out. InvalidArgument.
C: sgrt_landmark_model_learn)")
      .def(
          "to_json", [](const Model& x) { return text_of(x, SGRT_LANDMARK_MODEL_JSON); },
          "All numbers to the last bit.\n\nC: sgrt_landmark_model_text")
      .def_property_readonly(
          "id", [](const Model& x) { return text_of(x, SGRT_LANDMARK_MODEL_ID); }, "What it is a model of.")
      .def_property_readonly("names", &names_of, "Of its N points.")
      .def_property_readonly(
          "positions_mm", [](const py::object& x) { return array_of(x, SGRT_LANDMARK_MODEL_POSITIONS); },
          "N x 3, mm, model frame.\n\nC: sgrt_landmark_model_array")
      .def_property_readonly(
          "normals", [](const py::object& x) { return array_of(x, SGRT_LANDMARK_MODEL_NORMALS); }, "N x 3, outward.")
      .def_property_readonly(
          "curvature", [](const py::object& x) { return array_of(x, SGRT_LANDMARK_MODEL_CURVATURE); },
          "N x 2: k1 and k2, 1/mm.")
      .def_property_readonly(
          "sigma_mm", [](const py::object& x) { return array_of(x, SGRT_LANDMARK_MODEL_SIGMA); },
          "N: how far a place may differ from the model's.")
      .def("__repr__",
           [](const Model& x) {
             return py::str("<sgrt.LandmarkModel {!r}, {} points>")
                 .format(text_of(x, SGRT_LANDMARK_MODEL_ID), names_of(x).size());
           })
      .def(py::pickle([](const Model& x) { return text_of(x, SGRT_LANDMARK_MODEL_JSON); }, &from_json));

  py::class_<Landmarks>(m, "Landmarks",
                        R"(Result of landmarks_find. Numbers are NaN where a place is not in view, or nothing was found.

C: sgrt_landmarks_summary, sgrt_landmarks_array, sgrt_landmarks_text)")
      .def_property_readonly(
          "status", [](const Landmarks& l) { return std::string(sgrt_status_word(l.info.status)); },
          "The word of its status: 'ok' or 'not_found'.")
      .def_readonly("message", &Landmarks::message, "Why it was not found; empty where it is.")
      .def_readonly("names", &Landmarks::names, "Of the model's N points.")
      .def_readonly("positions_mm", &Landmarks::positions_mm, "N x 3, mm; NaN where not in view.")
      .def_readonly("covariance_mm2", &Landmarks::covariance_mm2, "N x 3 x 3, mm2, of the anatomical place.")
      .def_readonly("repeat_covariance_mm2", &Landmarks::repeat_covariance_mm2,
                    "The same against the model's own place: what a registration wants.")
      .def_readonly("scores", &Landmarks::scores,
                    "N, 0 to 1: how well what is there fits; near 0 the point lies where the others let expect it.")
      .def_property_readonly(
          "score", [](const Landmarks& l) { return l.info.score; }, "0 to 1, of the whole match.")
      .def_property_readonly(
          "runner_up_score", [](const Landmarks& l) { return l.info.runner_up_score; },
          "Of the best match at another pose.")
      .def_property_readonly(
          "found_count", [](const Landmarks& l) { return l.info.found_count; }, "Points with a position.")
      .def_property_readonly(
          "matched_count", [](const Landmarks& l) { return l.info.matched_count; },
          "Points that match a place that stands out.")
      .def_property_readonly(
          "seen_count", [](const Landmarks& l) { return l.info.seen_count; }, "Points whose place is in view.")
      .def_property_readonly(
          "candidate_count", [](const Landmarks& l) { return l.info.candidate_count; },
          "Places of the surface that stand out.")
      .def_property_readonly(
          "live_from_model",
          [](const Landmarks& l) {
            return fixed_array(l.info.live_from_model, {4, 4});
          },
          "4 x 4, of the model first scaled by size; NaN where not found.")
      .def_property_readonly(
          "size", [](const Landmarks& l) { return l.info.size; }, "Of the body over the model's.")
      .def_property_readonly(
          "scale_mm", [](const Landmarks& l) { return l.info.scale_mm; }, "Radius at which curvature was taken.")
      .def_property_readonly(
          "noise_mm", [](const Landmarks& l) { return l.info.noise_mm; }, "One sigma along the normal.")
      .def("__repr__", [](const Landmarks& l) {
        return py::str("<sgrt.Landmarks {}, {} of {} points, score {:.2f}>")
            .format(sgrt_status_word(l.info.status), l.info.found_count, l.info.point_count, l.info.score);
      });

  m.def("landmarks_find", &find, py::arg("surface"), py::arg("model") = none, py::kw_only(),
        py::arg("min_points") = finding.min_points, py::arg("min_score") = finding.min_score,
        py::arg("noise_mm") = finding.noise_mm, py::arg("context") = none,
        R"(Finds a model's landmarks on a Surface with normals: a Landmarks. Any pose, part of the body, no first guess.

model: a LandmarkModel; None: that of any head. min_points: that must match a place that stands out. min_score: of the whole
match. noise_mm: one sigma along the normal; 0: the surface's own, or measured.

Raises NotFound: nothing there is like the model, or it fits in two ways; error.result has the diagnostics, its positions NaN.
    InvalidArgument: no normals. InsufficientData: too few points. Cancelled.
C: sgrt_landmarks_find)");
}

}  // namespace sgrt_py
