// Laser: stripes of an image, the sweep of a fan, breathing from one stripe, calibration of the unit.
#include "bindings.hpp"

#include <cmath>
#include <iterator>

namespace sgrt_py {
namespace {

using StripeHandle = Owned<sgrt_stripe, sgrt_stripe_free>;
using LaserHandle = Owned<sgrt_laser, sgrt_laser_free>;
using SessionHandle = Owned<sgrt_laser_session, sgrt_laser_session_free>;
template <class T>
using MaybeNumbers = std::optional<py::array_t<T>>;

constexpr const char* kReasons[] = {"none",       "out_of_view", "out_of_volume", "no_stripe", "saturated", "no_match",
                                    "left_right", "ambiguous",   "edge",          "moved",     "occluded"};
static_assert(std::size(kReasons) == SGRT_REASON_COUNT, "a reason of sgrt.h lacks its word");

struct Stripe {
  MaybeNumbers<double> centre;
  MaybeNumbers<float> sigma_px, signal, width_px, asymmetry;
  MaybeNumbers<uint8_t> reason;
  sgrt_stripe_info info{};
};

struct Laser {
  std::optional<Surface> surface;
  MaybeNumbers<uint8_t> reason;
  MaybeNumbers<double> stripe_px, angle_rad, time_s;
  MaybeNumbers<float> sigma_px;
  sgrt_laser_info info{};
};

struct LaserSession {
  SessionHandle handle;
};

int32_t method_of(const std::string& method) {
  if (method == "centroid") return SGRT_STRIPE_CENTROID;
  if (method == "gaussian") return SGRT_STRIPE_GAUSSIAN;
  if (method == "ridge") return SGRT_STRIPE_RIDGE;
  invalid("method: '" + method + "', expected 'centroid', 'gaussian' or 'ridge'");
}

sgrt_stripe_options stripe_options(const std::string& method, int32_t min_length, double half_width_px,
                                   double min_signal, double noise, double gain, double saturation,
                                   double max_asymmetry) {
  auto o = defaults(sgrt_stripe_options_init);
  o.method = method_of(method);
  o.min_length = min_length;
  o.half_width_px = half_width_px;
  o.min_signal = min_signal;
  o.noise = noise;
  o.gain = gain;
  o.saturation = saturation;
  o.max_asymmetry = max_asymmetry;
  return o;
}

sgrt_laser_options laser_options(double angle_sigma_rad, const ArrayLike& volume_min_mm, const ArrayLike& volume_max_mm,
                                 const std::optional<double>& reference_time_s) {
  auto o = defaults(sgrt_laser_options_init);
  o.angle_sigma_rad = angle_sigma_rad;
  read_numbers(volume_min_mm, "volume_min_mm", {3}, o.volume_min_mm);
  read_numbers(volume_max_mm, "volume_max_mm", {3}, o.volume_max_mm);
  if (reference_time_s) o.reference_time_s = *reference_time_s;
  return o;
}

template <class T, class Handle>
MaybeNumbers<T> array_of(sgrt_status (*get)(const Handle*, int32_t, sgrt_view*), const Handle* result, int32_t field,
                         const py::object& base) {
  sgrt_view view{};
  run([&] { return get(result, field, &view); });
  return lend<T>(view, base);
}

Stripe unpack(StripeHandle handle) {
  const sgrt_stripe* result = handle.get();
  const py::capsule base(handle.release(), [](void* raw) { sgrt_stripe_free(static_cast<sgrt_stripe*>(raw)); });
  Stripe s;
  s.info.struct_size = sizeof s.info;
  run([&] { return sgrt_stripe_summary(result, &s.info); });
  s.centre = array_of<double>(sgrt_stripe_array, result, SGRT_STRIPE_CENTRE, base);
  s.sigma_px = array_of<float>(sgrt_stripe_array, result, SGRT_STRIPE_SIGMA, base);
  s.signal = array_of<float>(sgrt_stripe_array, result, SGRT_STRIPE_SIGNAL, base);
  s.width_px = array_of<float>(sgrt_stripe_array, result, SGRT_STRIPE_WIDTH, base);
  s.asymmetry = array_of<float>(sgrt_stripe_array, result, SGRT_STRIPE_ASYMMETRY, base);
  s.reason = array_of<uint8_t>(sgrt_stripe_array, result, SGRT_STRIPE_REASON, base);
  return s;
}

Laser unpack(LaserHandle handle) {
  const sgrt_laser* result = handle.get();
  const py::capsule base(handle.release(), [](void* raw) { sgrt_laser_free(static_cast<sgrt_laser*>(raw)); });
  Laser l;
  l.info.struct_size = sizeof l.info;
  run([&] { return sgrt_laser_summary(result, &l.info); });
  l.reason = array_of<uint8_t>(sgrt_laser_array, result, SGRT_LASER_REASON, base);
  l.stripe_px = array_of<double>(sgrt_laser_array, result, SGRT_LASER_STRIPE_PX, base);
  l.sigma_px = array_of<float>(sgrt_laser_array, result, SGRT_LASER_SIGMA_PX, base);
  l.angle_rad = array_of<double>(sgrt_laser_array, result, SGRT_LASER_ANGLE, base);
  l.time_s = array_of<double>(sgrt_laser_array, result, SGRT_LASER_TIME, base);
  if (l.info.point_count > 0) {
    l.surface.emplace();
    run([&] { return sgrt_laser_surface(result, out(l.surface->handle)); });
  }
  return l;
}

template <class Result, class Handle>
Result answer(const Outcome& outcome, Handle handle) {
  if (outcome.status == SGRT_OK) return unpack(std::move(handle));
  raise(outcome.status, outcome.message, handle ? py::cast(unpack(std::move(handle))) : py::none());
}

Stripe extract(const ArrayLike& image, const MaybeArray& dark, const std::string& method, bool columns,
               int32_t min_length, double half_width_px, double min_signal, double noise, double gain,
               double saturation, double max_asymmetry, Context* context) {
  const InView view(image, "image", Accept::kImages), below(dark, "dark", Accept::kImages);
  auto options = stripe_options(method, min_length, half_width_px, min_signal, noise, gain, saturation, max_asymmetry);
  options.columns = columns ? 1 : 0;
  StripeHandle handle;
  const Outcome outcome = attempt(
      context, [&](sgrt_context* c) { return sgrt_stripe_extract(c, &view.view, &below.view, &options, out(handle)); });
  return answer<Stripe>(outcome, std::move(handle));
}

Doubles plane(const Rig& rig, const std::string& laser_id, double angle_rad) {
  double numbers[4];
  const char* id = c_text(laser_id, "laser_id");
  run([&] { return sgrt_laser_plane(rig.handle.get(), id, angle_rad, numbers); });
  return fixed_array(numbers, {4});
}

Laser sweep(const Rig& rig, const std::string& laser_id, const ArrayLike& images, const ArrayLike& angle_rad,
            const MaybeArray& dark, const MaybeArray& time_s, const MaybeArray& track_time_s,
            const MaybeArray& room_from_body, double angle_sigma_rad, const ArrayLike& volume_min_mm,
            const ArrayLike& volume_max_mm, const std::optional<double>& reference_time_s, const std::string& method,
            int32_t min_length, double half_width_px, double min_signal, double noise, double gain, double saturation,
            double max_asymmetry, Context* context) {
  const InView frames(images, "images", Accept::kImages), below(dark, "dark", Accept::kImages);
  const InView angles(angle_rad, "angle_rad", Accept::kFloats), times(time_s, "time_s", Accept::kFloats);
  const InView track(track_time_s, "track_time_s", Accept::kFloats);
  const InView poses(room_from_body, "room_from_body", Accept::kFloats);
  const char* id = c_text(laser_id, "laser_id");
  const auto stripe =
      stripe_options(method, min_length, half_width_px, min_signal, noise, gain, saturation, max_asymmetry);
  const auto options = laser_options(angle_sigma_rad, volume_min_mm, volume_max_mm, reference_time_s);
  LaserHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_laser_sweep(c, rig.handle.get(), id, &frames.view, &below.view, &angles.view, &times.view, &track.view,
                            &poses.view, &stripe, &options, out(handle));
  });
  return answer<Laser>(outcome, std::move(handle));
}

LaserSession open_session(const Rig& rig, const std::string& laser_id, double angle_sigma_rad,
                          const ArrayLike& volume_min_mm, const ArrayLike& volume_max_mm,
                          const std::optional<double>& reference_time_s, const std::string& method, int32_t min_length,
                          double half_width_px, double min_signal, double noise, double gain, double saturation,
                          double max_asymmetry, Context* context) {
  const char* id = c_text(laser_id, "laser_id");
  const auto stripe =
      stripe_options(method, min_length, half_width_px, min_signal, noise, gain, saturation, max_asymmetry);
  const auto options = laser_options(angle_sigma_rad, volume_min_mm, volume_max_mm, reference_time_s);
  LaserSession session;
  run(context, [&](sgrt_context* c) {
    return sgrt_laser_session_create(c, rig.handle.get(), id, &stripe, &options, out(session.handle));
  });
  return session;
}

int64_t push(LaserSession& session, const ArrayLike& image, const MaybeArray& dark, double angle_rad, double time_s,
             Context* context) {
  const InView view(image, "image", Accept::kImages), below(dark, "dark", Accept::kImages);
  sgrt_laser_column column{};
  column.struct_size = sizeof column;
  run(context, [&](sgrt_context* c) {
    return sgrt_laser_session_push(c, session.handle.get(), &view.view, &below.view, angle_rad, time_s, &column);
  });
  return column.point_count;
}

Laser finish(const LaserSession& session, const MaybeArray& track_time_s, const MaybeArray& room_from_body,
             Context* context) {
  const InView track(track_time_s, "track_time_s", Accept::kFloats);
  const InView poses(room_from_body, "room_from_body", Accept::kFloats);
  LaserHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_laser_session_finish(c, session.handle.get(), &track.view, &poses.view, out(handle));
  });
  return answer<Laser>(outcome, std::move(handle));
}

std::pair<double, double> signal(const Rig& rig, const std::string& laser_id, const ArrayLike& image, double angle_rad,
                                 const ArrayLike& point_mm, const ArrayLike& axis, double radius_mm,
                                 const MaybeArray& dark, const std::string& method, int32_t min_length,
                                 double half_width_px, double min_signal, double noise, double gain, double saturation,
                                 double max_asymmetry, Context* context) {
  const InView view(image, "image", Accept::kImages), below(dark, "dark", Accept::kImages);
  const Vec3 point(point_mm, "point_mm"), along(axis, "axis");
  const char* id = c_text(laser_id, "laser_id");
  const auto stripe =
      stripe_options(method, min_length, half_width_px, min_signal, noise, gain, saturation, max_asymmetry);
  double value = std::nan(""), sigma = std::nan("");
  run(context, [&](sgrt_context* c) {
    return sgrt_laser_signal(c, rig.handle.get(), id, &view.view, &below.view, angle_rad, &stripe, point.v, along.v,
                             radius_mm, &value, &sigma);
  });
  return {value, sigma};
}

py::typing::Dict<py::str, int> counts(const int64_t* by_reason) {
  py::typing::Dict<py::str, int> by_word;
  for (int i = 0; i < SGRT_REASON_COUNT; ++i) by_word[kReasons[i]] = by_reason[i];
  return by_word;
}

constexpr const char* kExtractDoc = R"(The centre of a laser stripe in each line of an image: a Stripe.

image: H x W, uint8, uint16 or float32. dark: the same without laser, or None (then the local background is taken off).
method: 'centroid' (fastest), 'gaussian' (nearest to what the noise allows) or 'ridge' (Steger; weak stripes). columns: lines are columns.
min_length: lines; shorter pieces are ambiguous. half_width_px: of the centroid's window; 0: from the stripe. min_signal: grey levels over
    the background; 0: 6 times the noise. noise: grey levels; 0: from the image. gain: grey levels an electron. saturation: grey level
    from which a pixel is clipped; 0: the type's largest. max_asymmetry: two-sided width test.

Raises NotFound: no stripe in any line (error.result tells why). InvalidArgument. Cancelled.
C: sgrt_stripe_extract)";

constexpr const char* kSweepDoc = R"(The surface of a body from a whole sweep: a Laser.

laser_id: of the rig. images: F x H x W, uint8, uint16 or float32. angle_rad: F mirror readings in any order, none twice. dark: H x W or None.
time_s: F, not decreasing, or None. track_time_s, room_from_body: N and N x 4 x 4, the body's poses over the time of the frames: each
    column is moved to where the body was at reference_time_s (None: the first frame's); None: it lay still.
angle_sigma_rad: one sigma of a reading. volume_min_mm, volume_max_mm: working volume. The others as stripe_extract.

Raises InvalidArgument: unknown laser, size, a reading twice, a time that runs backwards or that the track does not cover.
    InsufficientData: no frame. NotFound: no stripe in any frame. Degenerate: the plane is parallel to the rays. FormatError. Cancelled.
C: sgrt_laser_sweep)";

constexpr const char* kSessionDoc =
    R"(The frames of a sweep one by one; options as laser_sweep. One thread at a time; does not pickle.

C: sgrt_laser_session_create)";

constexpr const char* kPushDoc =
    R"(Takes the next frame; the number of points that it gave. A frame without a stripe is no error.

Raises as laser_sweep; the session can go on.
C: sgrt_laser_session_push)";

constexpr const char* kFinishDoc = R"(The Laser of what was pushed so far; the session can go on.

Raises as laser_sweep.
C: sgrt_laser_session_finish)";

constexpr const char* kSignalDoc =
    R"(Breathing from one stripe: (mm, sigma mm) of the skin from point_mm along axis, from the stripe's points within radius_mm of that line.

Raises NotFound: the stripe does not pass there. Degenerate: the axis is at right angles to the light plane. InvalidArgument.
C: sgrt_laser_signal)";

// The keyword arguments of a stripe's extraction, alike in every call.
#define SGRT_STRIPE_ARGUMENTS                                                                                       \
  py::arg("method") = "gaussian", py::arg("min_length") = d.min_length, py::arg("half_width_px") = d.half_width_px, \
  py::arg("min_signal") = d.min_signal, py::arg("noise") = d.noise, py::arg("gain") = d.gain,                       \
  py::arg("saturation") = d.saturation, py::arg("max_asymmetry") = d.max_asymmetry, py::arg("context") = py::none()

void register_results(py::module_& m) {
  py::class_<Stripe>(m, "Stripe", R"(The stripe of an image, an entry a line.

C: sgrt_stripe_summary, sgrt_stripe_array)")
      .def_readonly("centre", &Stripe::centre, "float64, N: px along the line; NaN where absent.")
      .def_readonly("sigma_px", &Stripe::sigma_px, "float32, N: one sigma of the centre.")
      .def_readonly("signal", &Stripe::signal, "float32, N: grey levels of the peak over its background.")
      .def_readonly("width_px", &Stripe::width_px, "float32, N: sigma of the profile along the line.")
      .def_readonly("asymmetry", &Stripe::asymmetry, "float32, N: (right - left) / (right + left) of the half widths.")
      .def_readonly("reason", &Stripe::reason, "uint8, N: why a line has no centre; index of LASER_REASONS.")
      .def_property_readonly(
          "counts", [](const Stripe& s) { return counts(s.info.reason_count); }, "Lines by the word of their reason.")
      .def_property_readonly(
          "found_count", [](const Stripe& s) { return s.info.found_count; }, "Lines with a centre.")
      .def_property_readonly(
          "noise", [](const Stripe& s) { return s.info.noise; }, "Grey levels, one sigma of a pixel.")
      .def_property_readonly(
          "fit_scale", [](const Stripe& s) { return s.info.fit_scale; },
          "Residuals of the Gaussian fits over the noise; it is in sigma_px.")
      .def_property_readonly(
          "median_sigma_px", [](const Stripe& s) { return s.info.median_sigma_px; }, "Median one-sigma, px.");

  py::class_<Laser>(m, "Laser", R"(What a sweep gave, on a grid of H lines x W mirror readings.

C: sgrt_laser_summary, sgrt_laser_array, sgrt_laser_surface)")
      .def_property_readonly(
          "surface", [](Laser& l) { return l.surface ? std::optional<Surface*>(&*l.surface) : std::nullopt; },
          "The Surface: organised grid with normals, sigma_mm and covariance; None where there is no point.")
      .def_readonly("reason", &Laser::reason, "uint8, H x W: why there is no point; index of LASER_REASONS.")
      .def_readonly("stripe_px", &Laser::stripe_px, "float64, H x W: the stripe's centre along the line.")
      .def_readonly("sigma_px", &Laser::sigma_px, "float32, H x W: one sigma of the centre.")
      .def_readonly("angle_rad", &Laser::angle_rad, "float64, W: mirror reading of each column, increasing.")
      .def_readonly("time_s", &Laser::time_s, "float64, W: time of each column.")
      .def_property_readonly(
          "columns", [](const Laser& l) { return l.info.columns != 0; }, "A line is a column of the image, not a row.")
      .def_property_readonly(
          "counts", [](const Laser& l) { return counts(l.info.reason_count); }, "Grid points by their reason's word.")
      .def_property_readonly(
          "point_count", [](const Laser& l) { return l.info.point_count; }, "Points of the surface.")
      .def_property_readonly(
          "median_sigma_px", [](const Laser& l) { return l.info.median_sigma_px; }, "Median one-sigma of a centre, px.")
      .def_property_readonly(
          "median_sigma_mm", [](const Laser& l) { return l.info.median_sigma_mm; },
          "Median one-sigma of a point along its normal by noise alone, mm.")
      .def_property_readonly(
          "reference_time_s", [](const Laser& l) { return l.info.reference_time_s; },
          "The instant that the surface shows.")
      .def("__repr__", [](const Laser& l) {
        return py::str("<sgrt.Laser {} of {} x {} points, median sigma {:.3f} mm>")
            .format(l.info.point_count, l.info.height, l.info.width, l.info.median_sigma_mm);
      });
}

}  // namespace

void register_laser(py::module_& m) {
  const auto d = defaults(sgrt_stripe_options_init);
  const auto l = defaults(sgrt_laser_options_init);
  const auto corner = [](const double* v) { return py::make_tuple(v[0], v[1], v[2]); };
  const auto volume_min = corner(l.volume_min_mm), volume_max = corner(l.volume_max_mm);
  const auto none = py::none();
  py::tuple words(static_cast<size_t>(SGRT_REASON_COUNT));
  for (int i = 0; i < SGRT_REASON_COUNT; ++i) words[i] = kReasons[i];
  m.attr("LASER_REASONS") = words;
  register_results(m);

  m.def("stripe_extract", &extract, py::arg("image"), py::kw_only(), py::arg("dark") = none,
        py::arg("method") = "gaussian", py::arg("columns") = false, py::arg("min_length") = d.min_length,
        py::arg("half_width_px") = d.half_width_px, py::arg("min_signal") = d.min_signal, py::arg("noise") = d.noise,
        py::arg("gain") = d.gain, py::arg("saturation") = d.saturation, py::arg("max_asymmetry") = d.max_asymmetry,
        py::arg("context") = none, kExtractDoc);
  m.def("laser_plane", &plane, py::arg("rig"), py::arg("laser_id"), py::arg("angle_rad"),
        "float64, 4: the light plane of a mirror reading, plane[:3] . x = plane[3], room, mm.\n\n"
        "Raises InvalidArgument: unknown laser. FormatError.\nC: sgrt_laser_plane");
  m.def("laser_sweep", &sweep, py::arg("rig"), py::arg("laser_id"), py::arg("images"), py::arg("angle_rad"),
        py::kw_only(), py::arg("dark") = none, py::arg("time_s") = none, py::arg("track_time_s") = none,
        py::arg("room_from_body") = none, py::arg("angle_sigma_rad") = l.angle_sigma_rad,
        py::arg("volume_min_mm") = volume_min, py::arg("volume_max_mm") = volume_max,
        py::arg("reference_time_s") = none, SGRT_STRIPE_ARGUMENTS, kSweepDoc);
  py::class_<LaserSession>(m, "LaserSession", kSessionDoc)
      .def(py::init(&open_session), py::arg("rig"), py::arg("laser_id"), py::kw_only(),
           py::arg("angle_sigma_rad") = l.angle_sigma_rad, py::arg("volume_min_mm") = volume_min,
           py::arg("volume_max_mm") = volume_max, py::arg("reference_time_s") = none, SGRT_STRIPE_ARGUMENTS)
      .def("push", &push, py::arg("image"), py::kw_only(), py::arg("dark") = none, py::arg("angle_rad"),
           py::arg("time_s"), py::arg("context") = none, kPushDoc)
      .def("finish", &finish, py::kw_only(), py::arg("track_time_s") = none, py::arg("room_from_body") = none,
           py::arg("context") = none, kFinishDoc);
  m.def("laser_signal", &signal, py::arg("rig"), py::arg("laser_id"), py::arg("image"), py::arg("angle_rad"),
        py::kw_only(), py::arg("point_mm"), py::arg("axis"), py::arg("radius_mm"), py::arg("dark") = none,
        SGRT_STRIPE_ARGUMENTS, kSignalDoc);
}

}  // namespace sgrt_py
