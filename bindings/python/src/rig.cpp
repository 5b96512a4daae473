// Rig: the calibrated cameras of a room, as text in and out, and the projection through each camera.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

struct Camera {
  std::string id;
  int32_t width, height;
  Doubles intrinsics, distortion, camera_from_room;
};
struct Pair {
  std::string id, left, right;
};

struct TofUnit {
  std::string id, camera, pixel_offset_file;
  std::vector<double> modulation_hz, tap_phase_rad;
  bool differential;
  double electrons_per_count, read_noise_e, refractive_index;
};

Rig from_json(const std::string& json) {
  Rig rig;
  run([&] { return sgrt_rig_from_json(json.data(), json.size(), out(rig.handle)); });
  return rig;
}

sgrt_rig_info info_of(const Rig& rig) {
  sgrt_rig_info info{};
  info.struct_size = sizeof info;
  run([&] { return sgrt_rig_summary(rig.handle.get(), &info); });
  return info;
}

std::string text_of(const Rig& rig, int32_t field, int32_t index = 0) {
  const char* text = sgrt_rig_text(rig.handle.get(), field, index);
  return text ? text : "";
}

py::typing::Tuple<Camera, py::ellipsis> cameras(const Rig& rig) {
  const int32_t count = info_of(rig).camera_count;
  py::tuple all(count);
  for (int32_t i = 0; i < count; ++i) {
    sgrt_rig_camera c{};
    c.struct_size = sizeof c;
    run([&] { return sgrt_rig_camera_get(rig.handle.get(), i, &c); });
    all[i] = Camera{text_of(rig, SGRT_RIG_CAMERA_ID, i),
                    c.width,
                    c.height,
                    fixed_array(c.intrinsics, {4}),
                    fixed_array(c.distortion, {c.distortion_count}),
                    fixed_array(c.camera_from_room, {4, 4})};
  }
  return all;
}

py::typing::Tuple<Pair, py::ellipsis> pairs(const Rig& rig) {
  const int32_t count = info_of(rig).pair_count;
  py::tuple all(count);
  for (int32_t i = 0; i < count; ++i) {
    all[i] = Pair{text_of(rig, SGRT_RIG_PAIR_ID, i), text_of(rig, SGRT_RIG_PAIR_LEFT, i),
                  text_of(rig, SGRT_RIG_PAIR_RIGHT, i)};
  }
  return all;
}

py::typing::Tuple<TofUnit, py::ellipsis> tofs(const Rig& rig) {
  const int32_t count = info_of(rig).tof_count;
  py::tuple all(count);
  for (int32_t i = 0; i < count; ++i) {
    sgrt_rig_tof t{};
    t.struct_size = sizeof t;
    run([&] { return sgrt_rig_tof_get(rig.handle.get(), i, &t); });
    all[i] = TofUnit{text_of(rig, SGRT_RIG_TOF_ID, i),
                     text_of(rig, SGRT_RIG_TOF_CAMERA, i),
                     text_of(rig, SGRT_RIG_TOF_PIXEL_OFFSET, i),
                     {t.modulation_hz, t.modulation_hz + t.frequency_count},
                     {t.tap_phase_rad, t.tap_phase_rad + t.tap_count},
                     t.differential != 0,
                     t.electrons_per_count,
                     t.read_noise_e,
                     t.refractive_index};
  }
  return all;
}

py::ssize_t rows(const InView& array) {
  return array.view.shape[0];
}

Doubles project(const Rig& rig, const std::string& camera_id, const ArrayLike& x_in_room,
                const std::optional<py::array>& given, Context* context) {
  const InView x(x_in_room, "x_in_room", Accept::kFloats);
  const char* id = c_text(camera_id, "camera_id");
  py::array pixels = out_array(given, SGRT_F64, {rows(x), 2});
  const sgrt_mut_view view = out_view(pixels, "out", SGRT_F64);
  run(context, [&](sgrt_context* c) { return sgrt_rig_project(c, rig.handle.get(), id, &x.view, &view, nullptr); });
  return py::reinterpret_borrow<Doubles>(pixels);
}

std::pair<Doubles, Doubles> project_jacobian(const Rig& rig, const std::string& camera_id, const ArrayLike& x_in_room,
                                             Context* context) {
  const InView x(x_in_room, "x_in_room", Accept::kFloats);
  const char* id = c_text(camera_id, "camera_id");
  Doubles pixels({rows(x), py::ssize_t(2)}), jacobian({rows(x), py::ssize_t(2), py::ssize_t(3)});
  const sgrt_mut_view p = out_view(pixels, "pixels", SGRT_F64), j = out_view(jacobian, "jacobian", SGRT_F64);
  run(context, [&](sgrt_context* c) { return sgrt_rig_project(c, rig.handle.get(), id, &x.view, &p, &j); });
  return {pixels, jacobian};
}

std::pair<Doubles, Doubles> unproject(const Rig& rig, const std::string& camera_id, const ArrayLike& pixels,
                                      const std::optional<py::array>& given, Context* context) {
  const InView p(pixels, "pixels", Accept::kFloats);
  const char* id = c_text(camera_id, "camera_id");
  py::array directions = out_array(given, SGRT_F64, {rows(p), 3});
  const sgrt_mut_view view = out_view(directions, "out", SGRT_F64);
  double centre[3];
  run(context,
      [&](sgrt_context* c) { return sgrt_rig_unproject(c, rig.handle.get(), id, &p.view, &view, nullptr, centre); });
  return {py::reinterpret_borrow<Doubles>(directions), fixed_array(centre, {3})};
}

std::pair<Doubles, Doubles> unproject_jacobian(const Rig& rig, const std::string& camera_id, const ArrayLike& pixels,
                                               Context* context) {
  const InView p(pixels, "pixels", Accept::kFloats);
  const char* id = c_text(camera_id, "camera_id");
  Doubles directions({rows(p), py::ssize_t(3)}), jacobian({rows(p), py::ssize_t(3), py::ssize_t(2)});
  const sgrt_mut_view d = out_view(directions, "directions", SGRT_F64), j = out_view(jacobian, "jacobian", SGRT_F64);
  run(context, [&](sgrt_context* c) { return sgrt_rig_unproject(c, rig.handle.get(), id, &p.view, &d, &j, nullptr); });
  return {directions, jacobian};
}

constexpr const char* kRigDoc =
    R"(The calibrated cameras of a room, from the text of a rig.json (schema "sgrt-rig/1"). Immutable; pickles.

Raises FormatError: not JSON, unknown schema or model, a missing or wrong field (named), a pose that is not a rotation
    within 1e-6, a duplicated or unknown camera id, a distortion that folds inside the image. LimitError: above 16 MiB, 16
    levels, 64 cameras or an image side of 32,768.
C: sgrt_rig_from_json)";

constexpr const char* kProjectDoc = R"(Pixels (float64, N x 2) of room points in a camera.

camera_id: must be in the rig. x_in_room: N x 3, mm. out: such an array to write into; it is returned. NaN behind the camera or where the
distortion folds; a pixel outside the image is still given. (0, 0) is the centre of the top-left pixel.

Raises InvalidArgument: unknown camera, shape, dtype, non-finite. Cancelled.
C: sgrt_rig_project)";

constexpr const char* kUnprojectDoc = R"((directions, centre_mm): the rays of pixels and the camera's centre, room axes.

pixels: N x 2, px. directions: float64, N x 3, unit; NaN where no ray has this pixel. out: such an array to write into. centre_mm: 3 numbers.

Raises InvalidArgument: unknown camera, shape, dtype, non-finite. Cancelled.
C: sgrt_rig_unproject)";

}  // namespace

void register_rig(py::module_& m) {
  py::class_<Camera>(m, "Camera", "A camera of a rig.\n\nC: sgrt_rig_camera_get, sgrt_rig_text")
      .def_readonly("id", &Camera::id, "Its name in the rig.")
      .def_readonly("width", &Camera::width, "px")
      .def_readonly("height", &Camera::height, "px")
      .def_readonly("intrinsics", &Camera::intrinsics, "fx fy cx cy, px.")
      .def_readonly("distortion", &Camera::distortion, "Empty, or k1 k2 p1 p2 k3, or with k4 k5 k6.")
      .def_readonly("camera_from_room", &Camera::camera_from_room, "4 x 4, mm; camera: x right, y down, z forward.")
      .def("__repr__",
           [](const Camera& c) { return py::str("<sgrt.Camera {!r} {} x {}>").format(c.id, c.width, c.height); });
  py::class_<Pair>(m, "Pair", "Two cameras of a rig that see the same skin.\n\nC: sgrt_rig_text")
      .def_readonly("id", &Pair::id, "Its name in the rig.")
      .def_readonly("left", &Pair::left, "Id of the left camera.")
      .def_readonly("right", &Pair::right, "Id of the right camera.")
      .def("__repr__",
           [](const Pair& p) { return py::str("<sgrt.Pair {!r}: {!r}, {!r}>").format(p.id, p.left, p.right); });

  py::class_<TofUnit>(m, "TofUnit", "A time-of-flight camera of a rig.\n\nC: sgrt_rig_tof_get, sgrt_rig_text")
      .def_readonly("id", &TofUnit::id, "Its name in the rig.")
      .def_readonly("camera", &TofUnit::camera, "Id of its camera.")
      .def_readonly("modulation_hz", &TofUnit::modulation_hz, "One or more.")
      .def_readonly("tap_phase_rad", &TofUnit::tap_phase_rad, "tap = offset + amplitude cos(phase - tap_phase_rad).")
      .def_readonly("differential", &TofUnit::differential, "Signed taps, which tell nothing of their shot noise.")
      .def_readonly("electrons_per_count", &TofUnit::electrons_per_count, "Of a tap.")
      .def_readonly("read_noise_e", &TofUnit::read_noise_e, "One sigma, electrons.")
      .def_readonly("refractive_index", &TofUnit::refractive_index, "Of the air.")
      .def_readonly("pixel_offset_file", &TofUnit::pixel_offset_file,
                    "The .npy beside the rig with its pixels' offsets; empty: none.")
      .def("__repr__", [](const TofUnit& t) { return py::str("<sgrt.TofUnit {!r} on {!r}>").format(t.id, t.camera); });

  const auto none = py::none();
  py::class_<Rig>(m, "Rig", kRigDoc)
      .def(py::init(&from_json), py::arg("json"))
      .def(
          "to_json", [](const Rig& rig) { return text_of(rig, SGRT_RIG_JSON); },
          "The rig as JSON: all numbers to the last bit, unknown keys kept.\n\nC: sgrt_rig_text")
      .def_property_readonly(
          "id", [](const Rig& rig) { return text_of(rig, SGRT_RIG_ID); }, "Rigs of equal id share their error modes.")
      .def_property_readonly(
          "room", [](const Rig& rig) { return text_of(rig, SGRT_RIG_ROOM); }, "The frame that 'room' stands for.")
      .def_property_readonly("cameras", &cameras, "A tuple of Camera.")
      .def_property_readonly("pairs", &pairs, "A tuple of Pair.")
      .def_property_readonly("tofs", &tofs, "A tuple of TofUnit.")
      .def("project", &project, py::arg("camera_id"), py::arg("x_in_room"), py::kw_only(), py::arg("out") = none,
           py::arg("context") = none, kProjectDoc)
      .def("project_jacobian", &project_jacobian, py::arg("camera_id"), py::arg("x_in_room"), py::kw_only(),
           py::arg("context") = none,
           "(pixels, jacobian): as project, and d pixel / d x_in_room, N x 2 x 3, px/mm.\n\nC: sgrt_rig_project")
      .def("unproject", &unproject, py::arg("camera_id"), py::arg("pixels"), py::kw_only(), py::arg("out") = none,
           py::arg("context") = none, kUnprojectDoc)
      .def("unproject_jacobian", &unproject_jacobian, py::arg("camera_id"), py::arg("pixels"), py::kw_only(),
           py::arg("context") = none,
           "(directions, jacobian): as unproject, and d direction / d pixel, N x 3 x 2.\n\nC: sgrt_rig_unproject")
      .def("__repr__",
           [](const Rig& rig) {
             const auto info = info_of(rig);
             return py::str("<sgrt.Rig {!r} {} cameras, {} pairs>")
                 .format(text_of(rig, SGRT_RIG_ID), info.camera_count, info.pair_count);
           })
      .def(py::pickle([](const Rig& rig) { return text_of(rig, SGRT_RIG_JSON); }, &from_json));
}

}  // namespace sgrt_py
