// Calibration: boards and their detection, the solve, the check of a rig, the room.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

using CalibrationHandle = Owned<sgrt_calibration, sgrt_calibration_free>;

struct Calibration {
  sgrt_calibration_info info{};
  std::string report;
  std::vector<std::string> warnings, parameters;
  std::optional<Doubles> corners, covariance;
  std::optional<py::array_t<float>> pixel_offset;
  std::optional<Rig> rig;
};

struct Detection {
  Doubles pixels, sigma_px;
  sgrt_board_info info{};
};

int32_t kind_of(const std::string& kind) {
  if (kind == "chessboard") return SGRT_BOARD_CHESSBOARD;
  if (kind == "circles") return SGRT_BOARD_CIRCLES;
  invalid("kind: '" + kind + "', expected 'chessboard' or 'circles'");
}

sgrt_board make_board(const std::string& kind, int32_t columns, int32_t rows, double spacing_mm) {
  auto board = defaults(sgrt_board_init);
  board.kind = kind_of(kind);
  board.columns = columns;
  board.rows = rows;
  board.spacing_mm = spacing_mm;
  return board;
}

Doubles board_points(const std::string& kind, int32_t columns, int32_t rows, double spacing_mm) {
  const sgrt_board board = make_board(kind, columns, rows, spacing_mm);
  const bool sound = columns > 0 && rows > 0 && columns <= 100 && rows <= 100;  // else the library says what is wrong
  Doubles points({sound ? py::ssize_t(columns) * rows : py::ssize_t(1), py::ssize_t(3)});
  const sgrt_mut_view view = out_view(points, "points", SGRT_F64);
  run([&] { return sgrt_board_points(&board, &view); });
  return points;
}

Detection detect(const std::string& kind, int32_t columns, int32_t rows, double spacing_mm, const ArrayLike& image,
                 Context* context) {
  const sgrt_board board = make_board(kind, columns, rows, spacing_mm);
  const InView view(image, "image", Accept::kImages);
  const bool sound = columns > 0 && rows > 0 && columns <= 100 && rows <= 100;
  const py::ssize_t n = sound ? py::ssize_t(columns) * rows : 1;
  Detection d{Doubles({n, py::ssize_t(2)}), Doubles(n), {}};
  d.info.struct_size = sizeof d.info;
  const sgrt_mut_view p = out_view(d.pixels, "pixels", SGRT_F64), s = out_view(d.sigma_px, "sigma_px", SGRT_F64);
  const Outcome outcome =
      attempt(context, [&](sgrt_context* c) { return sgrt_board_detect(c, &board, &view.view, &p, &s, &d.info); });
  if (outcome.status == SGRT_OK) return d;
  raise(outcome.status, outcome.message, outcome.status >= 10 && outcome.status < 20 ? py::cast(d) : py::none());
}

Calibration unpack(CalibrationHandle handle) {
  const sgrt_calibration* result = handle.get();
  const py::capsule base(handle.release(),
                         [](void* raw) { sgrt_calibration_free(static_cast<sgrt_calibration*>(raw)); });
  Calibration c;
  c.info.struct_size = sizeof c.info;
  run([&] { return sgrt_calibration_summary(result, &c.info); });
  const auto text = [&](int32_t field, int32_t index) { return sgrt_calibration_text(result, field, index); };
  c.report = text(SGRT_CALIBRATION_REPORT, 0);
  for (int32_t i = 0; const char* line = text(SGRT_CALIBRATION_WARNING, i); ++i) c.warnings.emplace_back(line);
  for (int32_t i = 0; const char* name = text(SGRT_CALIBRATION_PARAMETER, i); ++i) c.parameters.emplace_back(name);
  sgrt_view view{};
  run([&] { return sgrt_calibration_array(result, SGRT_CALIBRATION_CORNERS, &view); });
  c.corners = lend<double>(view, base);
  run([&] { return sgrt_calibration_array(result, SGRT_CALIBRATION_COVARIANCE, &view); });
  c.covariance = lend<double>(view, base);
  run([&] { return sgrt_calibration_array(result, SGRT_CALIBRATION_PIXEL_OFFSET, &view); });
  c.pixel_offset = lend<float>(view, base);
  Rig rig;
  sgrt_status status;
  {
    py::gil_scoped_release nogil;
    status = sgrt_calibration_rig(result, out(rig.handle));
  }
  if (status == SGRT_OK) c.rig = std::move(rig);
  return c;
}

// The C struct and all that it points to.
struct Data {
  sgrt_calibration_data c{};
  std::vector<std::string> ids, placements, pair_ids;
  std::vector<const char*> id_texts, placement_texts, pair_texts;
  std::vector<int32_t> sizes, sides;
  InView points, index, pixels, sigma;
};

using Cameras = std::vector<std::pair<std::string, std::pair<int32_t, int32_t>>>;
using Pairs = std::vector<std::tuple<std::string, std::string, std::string>>;

void texts(const std::vector<std::string>& from, std::vector<const char*>& to, const char* name) {
  for (const std::string& text : from) to.push_back(c_text(text, name));
}

int32_t place_of(const std::vector<std::string>& ids, const std::string& id) {
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] == id) return static_cast<int32_t>(i);
  }
  invalid("pairs: '" + id + "' is not among the cameras");
}

void fill(Data& d, const Cameras& cameras, const ArrayLike& points, const ArrayLike& index, const ArrayLike& pixels,
          const MaybeArray& sigma, const std::vector<std::string>& placements, const Pairs& pairs,
          bool half_turn_ambiguous) {
  d.c = defaults(sgrt_calibration_data_init);
  for (const auto& [id, size] : cameras) {
    d.ids.push_back(id);
    d.sizes.push_back(size.first);
    d.sizes.push_back(size.second);
  }
  for (const auto& [id, left, right] : pairs) {
    d.pair_ids.push_back(id);
    d.sides.push_back(place_of(d.ids, left));
    d.sides.push_back(place_of(d.ids, right));
  }
  d.placements = placements;
  texts(d.ids, d.id_texts, "cameras");
  texts(d.placements, d.placement_texts, "placements");
  texts(d.pair_ids, d.pair_texts, "pairs");
  d.points = InView(points, "points", Accept::kFloats);
  d.index = InView(index, "index", Accept::kIndices);
  d.pixels = InView(pixels, "pixels", Accept::kFloats);
  d.sigma = InView(sigma, "sigma", Accept::kFloats);
  d.c.camera_count = static_cast<int32_t>(d.ids.size());
  d.c.placement_count = static_cast<int32_t>(d.placements.size());
  d.c.pair_count = static_cast<int32_t>(d.pair_ids.size());
  d.c.half_turn_ambiguous = half_turn_ambiguous ? 1 : 0;
  d.c.camera_ids = d.id_texts.data();
  d.c.placements = d.placement_texts.data();
  d.c.pair_ids = d.pair_texts.data();
  d.c.image_sizes = sgrt_view_of(d.sizes.data(), SGRT_I32, d.c.camera_count, 2, 0);
  if (!d.sides.empty()) d.c.pair_cameras = sgrt_view_of(d.sides.data(), SGRT_I32, d.c.pair_count, 2, 0);
  d.c.points = d.points.view;
  d.c.index = d.index.view;
  d.c.pixels = d.pixels.view;
  d.c.sigma = d.sigma.view;
}

[[noreturn]] void fail_with(const Outcome& outcome, CalibrationHandle handle) {
  raise(outcome.status, outcome.message, handle ? py::cast(unpack(std::move(handle))) : py::none());
}

Calibration solve(const Cameras& cameras, const ArrayLike& points, const ArrayLike& index, const ArrayLike& pixels,
                  const MaybeArray& sigma, const std::vector<std::string>& placements, const Pairs& pairs,
                  bool half_turn_ambiguous, const std::string& rig_id, int32_t distortion_count, int32_t max_iterations,
                  int32_t min_views, bool split_half, double outlier_sigma, double warp_sigma_mm, Context* context) {
  Data data;
  fill(data, cameras, points, index, pixels, sigma, placements, pairs, half_turn_ambiguous);
  auto options = defaults(sgrt_calibration_options_init);
  options.distortion_count = distortion_count;
  options.max_iterations = max_iterations;
  options.min_views = min_views;
  options.split_half = split_half ? 1 : 0;
  options.outlier_sigma = outlier_sigma;
  options.warp_sigma_mm = warp_sigma_mm;
  options.rig_id = c_text(rig_id, "rig_id");
  CalibrationHandle handle;
  const Outcome outcome =
      attempt(context, [&](sgrt_context* c) { return sgrt_calibration_solve(c, &data.c, &options, out(handle)); });
  if (outcome.status != SGRT_OK) fail_with(outcome, std::move(handle));
  return unpack(std::move(handle));
}

Calibration check(const Rig& rig, const Cameras& cameras, const ArrayLike& points, const ArrayLike& index,
                  const ArrayLike& pixels, const std::vector<std::string>& placements, bool half_turn_ambiguous,
                  double warp_sigma_mm, Context* context) {
  Data data;
  fill(data, cameras, points, index, pixels, std::nullopt, placements, {}, half_turn_ambiguous);
  auto options = defaults(sgrt_calibration_options_init);
  options.warp_sigma_mm = warp_sigma_mm;
  CalibrationHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_calibration_check(c, rig.handle.get(), &data.c, &options, out(handle));
  });
  if (outcome.status != SGRT_OK) fail_with(outcome, std::move(handle));
  return unpack(std::move(handle));
}

Calibration room(const std::vector<const Rig*>& rigs, const Cameras& cameras, const ArrayLike& points,
                 const ArrayLike& index, const ArrayLike& pixels, const std::optional<std::string>& rig_id,
                 double outlier_sigma, double point_sigma_mm, double noise_px, Context* context) {
  Data data;
  fill(data, cameras, points, index, pixels, std::nullopt, {"phantom"}, {}, false);
  auto options = defaults(sgrt_calibration_options_init);
  options.outlier_sigma = outlier_sigma;
  options.point_sigma_mm = point_sigma_mm;
  options.noise_px = noise_px;
  options.rig_id = rig_id ? c_text(*rig_id, "rig_id") : nullptr;
  std::vector<const sgrt_rig*> handles;
  for (const Rig* rig : rigs) handles.push_back(rig ? rig->handle.get() : nullptr);
  CalibrationHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_calibration_room(c, handles.data(), static_cast<int32_t>(handles.size()), &data.c, &options,
                                 out(handle));
  });
  if (outcome.status != SGRT_OK) fail_with(outcome, std::move(handle));
  return unpack(std::move(handle));
}

Calibration laser(const Rig& rig, const std::string& laser_id, const Cameras& cameras, const ArrayLike& points,
                  const ArrayLike& index, const ArrayLike& pixels, const std::vector<std::string>& placements,
                  const ArrayLike& stripe_placement, const ArrayLike& stripe_angle_rad, const ArrayLike& stripe_px,
                  const ArrayLike& stripe_sigma_px, bool half_turn_ambiguous, bool fixed, int32_t max_iterations,
                  double outlier_sigma, double noise_px, Context* context) {
  Data data;
  fill(data, cameras, points, index, pixels, std::nullopt, placements, {}, half_turn_ambiguous);
  auto options = defaults(sgrt_calibration_options_init);
  options.max_iterations = max_iterations;
  options.outlier_sigma = outlier_sigma;
  options.noise_px = noise_px;
  const InView placement(stripe_placement, "stripe_placement", Accept::kIndices);
  const InView angle(stripe_angle_rad, "stripe_angle_rad", Accept::kFloats);
  const InView at(stripe_px, "stripe_px", Accept::kFloats), sigma(stripe_sigma_px, "stripe_sigma_px", Accept::kFloats);
  auto stripes = defaults(sgrt_laser_stripes_init);
  stripes.fixed = fixed ? 1 : 0;
  stripes.placement = placement.view;
  stripes.angle_rad = angle.view;
  stripes.pixels = at.view;
  stripes.sigma_px = sigma.view;
  const char* id = c_text(laser_id, "laser_id");
  CalibrationHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_calibration_laser(c, rig.handle.get(), id, &data.c, &stripes, &options, out(handle));
  });
  if (outcome.status != SGRT_OK) fail_with(outcome, std::move(handle));
  return unpack(std::move(handle));
}

Calibration tof(const Rig& rig, const std::string& tof_id, const std::vector<ArrayLike>& taps,
                const ArrayLike& board_mm, const MaybeArray& room_from_board, const std::optional<Cameras>& cameras,
                const MaybeArray& points, const MaybeArray& index, const MaybeArray& pixels,
                const std::vector<std::string>& placements, bool half_turn_ambiguous, double range_min_mm,
                double range_max_mm, double saturation, int32_t amplitude_knots, double knot_spacing_mm,
                double pixel_sigma_mm, Context* context) {
  const char* id = c_text(tof_id, "tof_id");
  auto options = defaults(sgrt_calibration_tof_options_init);
  read_numbers(board_mm, "board_mm", {4}, options.board_mm);
  options.amplitude_knots = amplitude_knots;
  options.knot_spacing_mm = knot_spacing_mm;
  options.pixel_sigma_mm = pixel_sigma_mm;
  auto sensor = defaults(sgrt_tof_options_init);
  sensor.range_min_mm = range_min_mm;
  sensor.range_max_mm = range_max_mm;
  sensor.saturation = saturation;
  options.sensor = &sensor;
  std::vector<InView> keep;
  std::vector<sgrt_view> views;
  keep.reserve(taps.size());
  for (const ArrayLike& frames : taps) {
    keep.emplace_back(frames, "taps", Accept::kTaps);
    views.push_back(keep.back().view);
  }
  const InView poses(room_from_board, "room_from_board", Accept::kFloats);
  Data data;
  const bool seen = cameras && points && index && pixels;
  if (seen) fill(data, *cameras, *points, *index, *pixels, std::nullopt, placements, {}, half_turn_ambiguous);
  CalibrationHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_calibration_tof(c, rig.handle.get(), id, views.data(), static_cast<int32_t>(views.size()), &poses.view,
                                seen ? &data.c : nullptr, &options, out(handle));
  });
  if (outcome.status != SGRT_OK) fail_with(outcome, std::move(handle));
  return unpack(std::move(handle));
}

Doubles pixel_covariance(const Rig& rig, const std::string& camera_id, const ArrayLike& x_in_room, Context* context) {
  const InView x(x_in_room, "x_in_room", Accept::kFloats);
  const char* id = c_text(camera_id, "camera_id");
  Doubles covariance({py::ssize_t(x.view.shape[0]), py::ssize_t(3)});
  const sgrt_mut_view view = out_view(covariance, "covariance", SGRT_F64);
  run(context, [&](sgrt_context* c) { return sgrt_rig_pixel_covariance(c, rig.handle.get(), id, &x.view, &view); });
  return covariance;
}

Doubles point_covariance(const Rig& rig, const std::string& pair_id, const ArrayLike& x_in_room, double noise_px,
                         Context* context) {
  const InView x(x_in_room, "x_in_room", Accept::kFloats);
  const char* id = c_text(pair_id, "pair_id");
  Doubles covariance({py::ssize_t(x.view.shape[0]), py::ssize_t(6)});
  const sgrt_mut_view view = out_view(covariance, "covariance", SGRT_F64);
  run(context,
      [&](sgrt_context* c) { return sgrt_rig_point_covariance(c, rig.handle.get(), id, &x.view, noise_px, &view); });
  return covariance;
}

constexpr const char* kDetectDoc =
    R"(Finds a board in an image: a BoardDetection with each point to a fraction of a pixel.

kind: 'chessboard' (inner corners) or 'circles' (asymmetric, dark). columns, rows: 3 to 100. spacing_mm: side of a square; of circles the
    distance of two rows. image: H x W, uint8, uint16 or float32. The whole board must be in the image.

Raises NotFound: the message tells what was seen; error.result.info-like fields too. InvalidArgument. Cancelled.
C: sgrt_board_detect)";

constexpr const char* kSolveDoc =
    R"(Calibrates cameras from what they saw of a flat target in many placements: a Calibration with rig, covariance and report.

cameras: list of (id, (width, height)); the first one's frame is the rig's room. points: N x 3, mm, z = 0. index: K x 3 int32: camera,
    placement, point. pixels: K x 2. sigma: K, relative one sigma of a coordinate. placements: their names. pairs: (id, left id, right id).
half_turn_ambiguous: the target turned by half a turn looks the same. distortion_count: 0, 5 (brown5) or 8 (rational8). min_views: of each
    camera. split_half: also calibrate two halves and compare. outlier_sigma: corners further off do not count. warp_sigma_mm: how far the
    board may be bent; 0: 1 % of its half size; negative: flat.

Raises InsufficientData: too few views, or a camera that nothing links to the others. Degenerate: a motion of the board is missing.
    NotConverged. These carry the report as error.result. InvalidArgument. LimitError. Cancelled.
C: sgrt_calibration_solve)";

constexpr const char* kCheckDoc =
    R"(Holds a rig against images that it was not made from; only the placements of the target are fitted. A Calibration without a rig.

Arguments as of calibration_solve; cameras must be in the rig. expected_rms_px tells what the rig's own uncertainty lets expect.

Raises InsufficientData: no usable view. InvalidArgument. Cancelled.
C: sgrt_calibration_check)";

constexpr const char* kRoomDoc =
    R"(Brings rigs into the room by a phantom whose points are known there. A Calibration whose rig holds all their cameras.

rigs: list of Rig. cameras, index, pixels: as of calibration_solve, placement 0. points: N x 3, mm, room frame. rig_id: of the result.
outlier_sigma: points further off do not count. point_sigma_mm: one sigma of the phantom's points. noise_px: one sigma of a found point; 0:
    what the rig states.

Raises InsufficientData: a rig that sees fewer than 3 points with two cameras. Degenerate: points on a line. NotFound. InvalidArgument.
C: sgrt_calibration_room)";

constexpr const char* kLaserDoc =
    R"(Calibrates a laser unit (fan, mirror axis, offset, angle scale) from its stripe on a board. A Calibration whose rig holds the laser.

rig: holds the laser's camera; a laser of this id in it is the start. cameras, points, index, pixels, placements: as of calibration_solve, one
    camera. stripe_placement: S int32. stripe_angle_rad: S mirror readings. stripe_px: S x 2. stripe_sigma_px: S. fixed: a laser without a
    mirror. noise_px: one sigma of a corner; 0: what the rig states.

Raises InsufficientData: the stripe hardly crosses the board, or one reading. Degenerate: the board stood in one place only, or the plane
    does not turn. InvalidArgument. Cancelled.
C: sgrt_calibration_laser)";

constexpr const char* kTofDoc =
    R"(The range error of a time-of-flight camera from a flat board at known poses: a Calibration whose rig holds the corrections.

taps: a list, one array a placement, as of tof_measure. board_mm: left, top, right, bottom of the part of the board's plane that is flat and
    bare. room_from_board: N x 4 x 4, the plane being z = 0; or None: cameras, points, index, pixels, placements as of calibration_check tell
    where the rig's cameras saw the board. range_min_mm, range_max_mm, saturation: as of tof_measure. amplitude_knots: of the amplitude's term, 0
    for none. knot_spacing_mm: of the range correction. pixel_sigma_mm: what a pixel's offset may be, 0 for none.

The result's pixel_offset_mm belongs into the file that its rig names.
Raises InsufficientData: too few pixels saw the board. InvalidArgument. Cancelled.
C: sgrt_calibration_tof)";

}  // namespace

void register_calibration(py::module_& m) {
  const auto o = defaults(sgrt_calibration_options_init);
  const auto none = py::none();

  py::class_<Detection>(m, "BoardDetection", "A board found in an image.\n\nC: sgrt_board_detect")
      .def_readonly("pixels", &Detection::pixels, "float64, N x 2, in the board's order; NaN where a point is hidden.")
      .def_readonly("sigma_px", &Detection::sigma_px,
                    "float64, N: one sigma of each coordinate from the image's noise.")
      .def_property_readonly(
          "found_count", [](const Detection& d) { return d.info.found_count; }, "Points found.")
      .def_property_readonly(
          "seen", [](const Detection& d) { return std::pair(d.info.seen_columns, d.info.seen_rows); },
          "Where it was not found: inner corners of the largest chessboard seen, (0, 0) for none.")
      .def_property_readonly(
          "half_turn_ambiguous", [](const Detection& d) { return d.info.half_turn_ambiguous != 0; },
          "Turned by half a turn the board looks the same.");

  py::class_<Calibration>(m, "Calibration",
                          "Result of a calibration, a check or a room fit. Numbers are NaN where there is none.\n\n"
                          "C: sgrt_calibration_summary, sgrt_calibration_array, sgrt_calibration_text")
      .def_property_readonly(
          "status", [](const Calibration& r) { return std::string(sgrt_status_word(r.info.status)); },
          "The word of its status: 'ok', 'degenerate', ...")
      .def_readonly("report", &Calibration::report, "JSON text, schema sgrt-calibration/1.")
      .def_readonly("warnings", &Calibration::warnings, "List of str, one line each.")
      .def_readonly("parameters", &Calibration::parameters, "Names of the rows of covariance: 'pod1-left.fx', ...")
      .def_readonly("covariance", &Calibration::covariance, "float64, P x P; None but after calibration_solve.")
      .def_readonly(
          "corners", &Calibration::corners,
          "float64, K x 8: camera, placement, point, pixel x y, residual x y (px), 1 where it counts; or None.")
      .def_readonly("pixel_offset_mm", &Calibration::pixel_offset,
                    "float32, H x W: to be subtracted from the range; None but after calibration_tof.")
      .def_property_readonly(
          "rig", [](Calibration& r) -> Rig* { return r.rig ? &*r.rig : nullptr; },
          py::return_value_policy::reference_internal, "The Rig, or None.\n\nC: sgrt_calibration_rig")
      .def_property_readonly(
          "noise_px", [](const Calibration& r) { return r.info.noise_px; },
          "One sigma of a corner's coordinate, corrected for degrees of freedom.")
      .def_property_readonly(
          "rms_px", [](const Calibration& r) { return r.info.rms_px; },
          "Root mean square length of the residuals that count (OpenCV's figure).")
      .def_property_readonly(
          "rms_all_px", [](const Calibration& r) { return r.info.rms_all_px; }, "... of all corners.")
      .def_property_readonly(
          "expected_rms_px", [](const Calibration& r) { return r.info.expected_rms_px; },
          "Of a check: what the rig's uncertainty lets expect.")
      .def_property_readonly(
          "view_count", [](const Calibration& r) { return r.info.view_count; }, "Images that count.")
      .def_property_readonly(
          "corner_count", [](const Calibration& r) { return r.info.corner_count; }, "Corners that count.")
      .def_property_readonly(
          "discarded_count", [](const Calibration& r) { return r.info.discarded_count; },
          "Images and corners that do not.")
      .def_property_readonly(
          "iterations", [](const Calibration& r) { return r.info.iterations; }, "Of all solves.");

  m.def("board_points", &board_points, py::arg("kind"), py::arg("columns"), py::arg("rows"), py::arg("spacing_mm"),
        "float64, N x 3, mm: a board's points, row by row, z = 0.\n\nRaises InvalidArgument.\nC: sgrt_board_points");
  m.def("board_detect", &detect, py::arg("kind"), py::arg("columns"), py::arg("rows"), py::arg("spacing_mm"),
        py::arg("image"), py::kw_only(), py::arg("context") = none, kDetectDoc);
  m.def("calibration_solve", &solve, py::arg("cameras"), py::arg("points"), py::arg("index"), py::arg("pixels"),
        py::kw_only(), py::arg("sigma") = none, py::arg("placements"), py::arg("pairs") = Pairs{},
        py::arg("half_turn_ambiguous") = false, py::arg("rig_id") = "calibrated rig",
        py::arg("distortion_count") = o.distortion_count, py::arg("max_iterations") = o.max_iterations,
        py::arg("min_views") = o.min_views, py::arg("split_half") = o.split_half != 0,
        py::arg("outlier_sigma") = o.outlier_sigma, py::arg("warp_sigma_mm") = o.warp_sigma_mm,
        py::arg("context") = none, kSolveDoc);
  m.def("calibration_check", &check, py::arg("rig"), py::arg("cameras"), py::arg("points"), py::arg("index"),
        py::arg("pixels"), py::kw_only(), py::arg("placements"), py::arg("half_turn_ambiguous") = false,
        py::arg("warp_sigma_mm") = o.warp_sigma_mm, py::arg("context") = none, kCheckDoc);
  m.def("calibration_room", &room, py::arg("rigs"), py::arg("cameras"), py::arg("points"), py::arg("index"),
        py::arg("pixels"), py::kw_only(), py::arg("rig_id") = none, py::arg("outlier_sigma") = o.outlier_sigma,
        py::arg("point_sigma_mm") = o.point_sigma_mm, py::arg("noise_px") = o.noise_px, py::arg("context") = none,
        kRoomDoc);
  m.def("calibration_laser", &laser, py::arg("rig"), py::arg("laser_id"), py::arg("cameras"), py::arg("points"),
        py::arg("index"), py::arg("pixels"), py::kw_only(), py::arg("placements"), py::arg("stripe_placement"),
        py::arg("stripe_angle_rad"), py::arg("stripe_px"), py::arg("stripe_sigma_px"),
        py::arg("half_turn_ambiguous") = false, py::arg("fixed") = false, py::arg("max_iterations") = o.max_iterations,
        py::arg("outlier_sigma") = o.outlier_sigma, py::arg("noise_px") = o.noise_px, py::arg("context") = none,
        kLaserDoc);
  const auto t = defaults(sgrt_calibration_tof_options_init);
  const auto sensor = defaults(sgrt_tof_options_init);
  m.def("calibration_tof", &tof, py::arg("rig"), py::arg("tof_id"), py::arg("taps"), py::kw_only(), py::arg("board_mm"),
        py::arg("room_from_board") = none, py::arg("cameras") = none, py::arg("points") = none, py::arg("index") = none,
        py::arg("pixels") = none, py::arg("placements") = std::vector<std::string>{},
        py::arg("half_turn_ambiguous") = false, py::arg("range_min_mm") = sensor.range_min_mm,
        py::arg("range_max_mm") = sensor.range_max_mm, py::arg("saturation") = sensor.saturation,
        py::arg("amplitude_knots") = t.amplitude_knots, py::arg("knot_spacing_mm") = t.knot_spacing_mm,
        py::arg("pixel_sigma_mm") = t.pixel_sigma_mm, py::arg("context") = none, kTofDoc);
  m.def("rig_pixel_covariance", &pixel_covariance, py::arg("rig"), py::arg("camera_id"), py::arg("x_in_room"),
        py::kw_only(), py::arg("context") = none,
        "float64, N x 3, xx xy yy, px2: how uncertain the rig's calibration leaves the pixels of room points (N x 3, "
        "mm).\n\n"
        "Raises InvalidArgument: also a rig that states no uncertainty.\nC: sgrt_rig_pixel_covariance");
  m.def("rig_point_covariance", &point_covariance, py::arg("rig"), py::arg("pair_id"), py::arg("x_in_room"),
        py::kw_only(), py::arg("noise_px") = 0.0, py::arg("context") = none,
        "float64, N x 6, xx xy xz yy yz zz, mm2: of the points that a pair triangulates, by the calibration and by "
        "noise_px on "
        "each pixel coordinate.\n\nRaises InvalidArgument.\nC: sgrt_rig_point_covariance");
}

}  // namespace sgrt_py
