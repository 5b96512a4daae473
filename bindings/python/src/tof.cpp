// Time of flight: taps to ranges, flags and points, once or as a session.
#include "bindings.hpp"

#include <iterator>

namespace sgrt_py {
namespace {

constexpr const char* kFlags[] = {"saturated", "low_amplitude", "moved",       "flying",
                                  "wrapped",   "out_of_range",  "uncalibrated"};

using TofHandle = Owned<sgrt_tof, sgrt_tof_free>;
using SessionHandle = Owned<sgrt_tof_session, sgrt_tof_session_free>;
template <class T>
using MaybeNumbers = std::optional<py::array_t<T>>;

// The arrays keep the handle alive; while they live the session leaves its memory alone.
struct Tof {
  std::optional<Surface> surface;
  MaybeNumbers<float> phase, amplitude, offset, range, sigma, score, points, frames;
  MaybeNumbers<uint8_t> flags;
  sgrt_tof_info info{};
};

struct TofSession {
  SessionHandle handle;
};

// The C struct and the memory that it points to.
struct Options {
  sgrt_tof_options c{};
  InView pixel_offset;
};

template <class T>
MaybeNumbers<T> array_of(const sgrt_tof* result, int32_t field, const py::object& base) {
  sgrt_view view{};
  run([&] { return sgrt_tof_array(result, field, &view); });
  return lend<T>(view, base);
}

// base: what keeps `result` alive.
Tof unpack(const sgrt_tof* result, const py::object& base) {
  Tof t;
  t.info.struct_size = sizeof t.info;
  run([&] { return sgrt_tof_summary(result, &t.info); });
  t.phase = array_of<float>(result, SGRT_TOF_PHASE, base);
  t.amplitude = array_of<float>(result, SGRT_TOF_AMPLITUDE, base);
  t.offset = array_of<float>(result, SGRT_TOF_OFFSET, base);
  t.range = array_of<float>(result, SGRT_TOF_RANGE, base);
  t.sigma = array_of<float>(result, SGRT_TOF_SIGMA, base);
  t.flags = array_of<uint8_t>(result, SGRT_TOF_FLAGS, base);
  t.score = array_of<float>(result, SGRT_TOF_SCORE, base);
  t.points = array_of<float>(result, SGRT_TOF_POINTS, base);
  t.frames = array_of<float>(result, SGRT_TOF_FRAMES, base);
  return t;
}

// `surface`: whether the surface is wanted too.
Tof unpack(const sgrt_tof* result, const py::object& base, bool surface, Context* context) {
  Tof t = unpack(result, base);
  if (surface && t.info.point_count > 0) {
    t.surface.emplace();
    run(context, [&](sgrt_context* c) { return sgrt_tof_surface(c, result, out(t.surface->handle)); });
  }
  return t;
}

Tof lending(TofHandle handle, bool surface, Context* context) {
  const sgrt_tof* result = handle.get();
  const py::capsule base(handle.release(), [](void* raw) { sgrt_tof_free(static_cast<sgrt_tof*>(raw)); });
  return unpack(result, base, surface, context);
}

std::unique_ptr<Options> options_of(bool chapter_c, double range_min_mm, double range_max_mm, double saturation,
                                    double min_amplitude, double max_phase_sigma_rad, double max_sigma_mm,
                                    double moved_tolerance, double max_incidence_deg, double min_unwrap_score,
                                    double unwrap_tolerance_mm, int32_t normal_window_px,
                                    const MaybeArray& pixel_offset_mm) {
  auto o = std::make_unique<Options>();
  o->c = defaults(sgrt_tof_options_init);
  o->c.chapter_c = chapter_c ? 1 : 0;
  o->c.range_min_mm = range_min_mm;
  o->c.range_max_mm = range_max_mm;
  o->c.saturation = saturation;
  o->c.min_amplitude = min_amplitude;
  o->c.max_phase_sigma_rad = max_phase_sigma_rad;
  o->c.max_sigma_mm = max_sigma_mm;
  o->c.moved_tolerance = moved_tolerance;
  o->c.max_incidence_deg = max_incidence_deg;
  o->c.min_unwrap_score = min_unwrap_score;
  o->c.unwrap_tolerance_mm = unwrap_tolerance_mm;
  o->c.normal_window_px = normal_window_px;
  o->pixel_offset = InView(pixel_offset_mm, "pixel_offset_mm", Accept::kFloats);
  o->c.pixel_offset_mm = o->pixel_offset.view;
  return o;
}

Tof measure(const Rig& rig, const std::string& tof_id, const ArrayLike& taps, bool chapter_c, double range_min_mm,
            double range_max_mm, double saturation, double min_amplitude, double max_phase_sigma_rad,
            double max_sigma_mm, double moved_tolerance, double max_incidence_deg, double min_unwrap_score,
            double unwrap_tolerance_mm, int32_t normal_window_px, const MaybeArray& pixel_offset_mm, Context* context) {
  const InView view(taps, "taps", Accept::kTaps);
  const char* id = c_text(tof_id, "tof_id");
  const auto options = options_of(chapter_c, range_min_mm, range_max_mm, saturation, min_amplitude, max_phase_sigma_rad,
                                  max_sigma_mm, moved_tolerance, max_incidence_deg, min_unwrap_score,
                                  unwrap_tolerance_mm, normal_window_px, pixel_offset_mm);
  TofHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_tof_measure(c, rig.handle.get(), id, &view.view, &options->c, out(handle));
  });
  if (outcome.status == SGRT_OK) return lending(std::move(handle), true, context);
  raise(outcome.status, outcome.message, handle ? py::cast(lending(std::move(handle), false, context)) : py::none());
}

TofSession open_session(const Rig& rig, const std::string& tof_id, bool chapter_c, double range_min_mm,
                        double range_max_mm, double saturation, double min_amplitude, double max_phase_sigma_rad,
                        double max_sigma_mm, double moved_tolerance, double max_incidence_deg, double min_unwrap_score,
                        double unwrap_tolerance_mm, int32_t normal_window_px, const MaybeArray& pixel_offset_mm,
                        Context* context) {
  const char* id = c_text(tof_id, "tof_id");
  const auto options = options_of(chapter_c, range_min_mm, range_max_mm, saturation, min_amplitude, max_phase_sigma_rad,
                                  max_sigma_mm, moved_tolerance, max_incidence_deg, min_unwrap_score,
                                  unwrap_tolerance_mm, normal_window_px, pixel_offset_mm);
  TofSession session;
  run(context, [&](sgrt_context* c) {
    return sgrt_tof_session_create(c, rig.handle.get(), id, &options->c, out(session.handle));
  });
  return session;
}

Tof push(TofSession& session, const ArrayLike& taps, double time_s, bool surface, Context* context) {
  const InView view(taps, "taps", Accept::kTaps);
  const sgrt_tof* lent = nullptr;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_tof_session_push(c, session.handle.get(), &view.view, time_s, &lent);
  });
  TofHandle kept;
  if (lent) run([&] { return sgrt_tof_keep(lent, out(kept)); });
  if (outcome.status == SGRT_OK) return lending(std::move(kept), surface, context);
  raise(outcome.status, outcome.message, kept ? py::cast(lending(std::move(kept), false, context)) : py::none());
}

py::typing::Dict<py::str, int> counts(const Tof& t) {
  py::typing::Dict<py::str, int> by_word;
  for (size_t i = 0; i < std::size(kFlags); ++i) by_word[kFlags[i]] = t.info.flag_count[i];
  return by_word;
}

constexpr const char* kMeasureDoc = R"(Taps of a time-of-flight camera to phase, range and points: a Tof.

tof_id: of the rig. taps: frames x frequencies x taps x H x W, or without the frames; uint16, int16 or float32, counts. Several frames are
    averaged, each pixel backwards from the last one as far as nothing moved.
chapter_c: eq. 10.2 as the chapter prints it, c = 3e8 m/s and no air. range_min_mm, range_max_mm: the window along the ray; NaN: one
    unambiguous range. saturation: counts; NaN: the end of the integer type. min_amplitude: counts.
max_phase_sigma_rad, max_sigma_mm: noisier pixels have no point. moved_tolerance: of the amplitude, how far taps of a still scene may disagree.
max_incidence_deg: steeper jumps to both sides are no skin. min_unwrap_score, unwrap_tolerance_mm: of several frequencies.
normal_window_px: odd. pixel_offset_mm: H x W, subtracted from the range.

Raises InvalidArgument: unknown unit, taps of another shape or dtype. NotFound: no pixel has a range (error.result tells why). LimitError.
    Cancelled.
C: sgrt_tof_measure)";

constexpr const char* kSessionDoc =
    R"(The same unit again and again (live mode); options as tof_measure. One thread at a time; does not pickle.

C: sgrt_tof_session_create)";

constexpr const char* kPushDoc =
    R"(The Tof of the next frame (or frames); no array is copied, and its memory is used again once nothing holds it.

taps: as tof_measure. time_s: must not decrease. surface: make the Surface too, which takes longer than all else.
Raises as tof_measure; after an error the session can go on.
C: sgrt_tof_session_push)";

}  // namespace

void register_tof(py::module_& m) {
  const auto d = defaults(sgrt_tof_options_init);
  const auto none = py::none();

  py::tuple words(std::size(kFlags));
  for (size_t i = 0; i < std::size(kFlags); ++i) words[i] = kFlags[i];
  m.attr("TOF_FLAGS") = words;

  py::class_<Tof>(m, "Tof", R"(What a time-of-flight camera measured in H x W pixels.

C: sgrt_tof_summary, sgrt_tof_array, sgrt_tof_surface)")
      .def_property_readonly(
          "surface", [](Tof& t) { return t.surface ? std::optional<Surface*>(&*t.surface) : std::nullopt; },
          "The Surface: organised grid with normals, and sigma_mm and covariance where the noise is known; None "
          "without a point.")
      .def_readonly("phase_rad", &Tof::phase, "float32, frequencies x H x W, in [0, 2 pi).")
      .def_readonly("amplitude", &Tof::amplitude, "float32, frequencies x H x W, counts.")
      .def_readonly("offset", &Tof::offset, "float32, frequencies x H x W, counts.")
      .def_readonly("range_mm", &Tof::range,
                    "float32, H x W: along the ray, corrected; given for flagged pixels too, NaN where there is none.")
      .def_readonly("sigma_mm", &Tof::sigma,
                    "float32, H x W: one sigma of the range; NaN where the noise is not known.")
      .def_readonly("flags", &Tof::flags,
                    "uint8, H x W: bit i is TOF_FLAGS[i]; a pixel with any but the last has no point.")
      .def_readonly("score", &Tof::score,
                    "float32, H x W: log-likelihood of the range over the next best; None for one frequency.")
      .def_readonly("points", &Tof::points, "float32, H x W x 3: room, mm; NaN where absent.")
      .def_readonly("frames", &Tof::frames, "float32, H x W: how many frames were averaged; None for one frame.")
      .def_property_readonly("counts", &counts, "Pixels by the word of their flag.")
      .def_property_readonly(
          "point_count", [](const Tof& t) { return t.info.point_count; }, "Pixels with a point.")
      .def_property_readonly(
          "range_window_mm", [](const Tof& t) { return py::make_tuple(t.info.range_min_mm, t.info.range_max_mm); },
          "The window that held, mm.")
      .def_property_readonly(
          "ambiguity_mm", [](const Tof& t) { return t.info.ambiguity_mm; },
          "Ranges this far apart have the same phases, mm.")
      .def_property_readonly(
          "median_sigma_mm", [](const Tof& t) { return t.info.median_sigma_mm; },
          "Median one-sigma of the points along the ray, mm; NaN where the noise is not known.")
      .def("__repr__", [](const Tof& t) {
        return py::str("<sgrt.Tof {} of {} x {} points, median sigma {:.3f} mm>")
            .format(t.info.point_count, t.info.height, t.info.width, t.info.median_sigma_mm);
      });

  m.def("tof_measure", &measure, py::arg("rig"), py::arg("tof_id"), py::arg("taps"), py::kw_only(),
        py::arg("chapter_c") = d.chapter_c != 0, py::arg("range_min_mm") = d.range_min_mm,
        py::arg("range_max_mm") = d.range_max_mm, py::arg("saturation") = d.saturation,
        py::arg("min_amplitude") = d.min_amplitude, py::arg("max_phase_sigma_rad") = d.max_phase_sigma_rad,
        py::arg("max_sigma_mm") = d.max_sigma_mm, py::arg("moved_tolerance") = d.moved_tolerance,
        py::arg("max_incidence_deg") = d.max_incidence_deg, py::arg("min_unwrap_score") = d.min_unwrap_score,
        py::arg("unwrap_tolerance_mm") = d.unwrap_tolerance_mm, py::arg("normal_window_px") = d.normal_window_px,
        py::arg("pixel_offset_mm") = none, py::arg("context") = none, kMeasureDoc);

  py::class_<TofSession>(m, "TofSession", kSessionDoc)
      .def(py::init(&open_session), py::arg("rig"), py::arg("tof_id"), py::kw_only(),
           py::arg("chapter_c") = d.chapter_c != 0, py::arg("range_min_mm") = d.range_min_mm,
           py::arg("range_max_mm") = d.range_max_mm, py::arg("saturation") = d.saturation,
           py::arg("min_amplitude") = d.min_amplitude, py::arg("max_phase_sigma_rad") = d.max_phase_sigma_rad,
           py::arg("max_sigma_mm") = d.max_sigma_mm, py::arg("moved_tolerance") = d.moved_tolerance,
           py::arg("max_incidence_deg") = d.max_incidence_deg, py::arg("min_unwrap_score") = d.min_unwrap_score,
           py::arg("unwrap_tolerance_mm") = d.unwrap_tolerance_mm, py::arg("normal_window_px") = d.normal_window_px,
           py::arg("pixel_offset_mm") = none, py::arg("context") = none)
      .def("push", &push, py::arg("taps"), py::kw_only(), py::arg("time_s"), py::arg("surface") = true,
           py::arg("context") = none, kPushDoc);
}

}  // namespace sgrt_py
