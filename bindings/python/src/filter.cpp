// Filters of surfaces: in space, and over time.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

constexpr const char* kReasons[SGRT_FILTER_COUNT] = {"filtered", "absent", "kept", "outlier"};
constexpr const char* kStates[SGRT_TEMPORAL_COUNT] = {"averaged", "absent", "started", "moved"};

using Counts = py::typing::Dict<py::str, int>;

template <int N>
Counts counts_of(const int64_t* count, const char* const (&words)[N]) {
  Counts by_word;
  for (int i = 0; i < N; ++i) by_word[words[i]] = count[i];
  return by_word;
}

struct Filtered {
  Surface surface;
  py::array_t<uint8_t> reason;
  sgrt_surface_filter_info info;
};

Filtered filter(const Surface& surface, double radius_mm, double max_sigmas, double min_support, Context* context) {
  auto options = defaults(sgrt_surface_filter_options_init);
  options.radius_mm = radius_mm;
  options.max_sigmas = max_sigmas;
  options.min_support = min_support;
  Filtered f{{}, py::array_t<uint8_t>(point_shape(surface.handle.get())), {}};
  f.info.struct_size = sizeof f.info;
  const sgrt_mut_view reason = out_view(f.reason, "reason", SGRT_U8);
  run(context, [&](sgrt_context* c) {
    return sgrt_surface_filter(c, surface.handle.get(), &options, out(f.surface.handle), &reason, &f.info);
  });
  return f;
}

struct FilterSession {
  Owned<sgrt_filter_session, sgrt_filter_session_free> handle;
};

struct FilteredFrame {
  Surface surface;
  py::array_t<uint8_t> state;
  sgrt_filter_session_info info;
};

FilterSession open_session(double motion_sigmas, double drift_mm) {
  auto options = defaults(sgrt_filter_session_options_init);
  options.motion_sigmas = motion_sigmas;
  options.drift_mm = drift_mm;
  FilterSession session;
  run([&] { return sgrt_filter_session_create(&options, out(session.handle)); });
  return session;
}

FilteredFrame push(FilterSession& session, const Surface& frame, double time_s, Context* context) {
  FilteredFrame f{};
  f.info.struct_size = sizeof f.info;
  run(context, [&](sgrt_context* c) {
    return sgrt_filter_session_push(c, session.handle.get(), frame.handle.get(), time_s, &f.info);
  });
  run([&] { return sgrt_filter_session_surface(session.handle.get(), out(f.surface.handle)); });
  sgrt_view states{};
  run([&] { return sgrt_filter_session_states(session.handle.get(), &states); });
  f.state = py::array_t<uint8_t>({states.shape[0], states.shape[1]}, static_cast<const uint8_t*>(states.data));
  return f;
}

constexpr const char* kFilterDoc =
    R"(The spatial filter, for the surface of any sensor: a Filtered. Outliers go; the other points move along their normals onto a
weighted quadric through the neighbours on the same side of every edge. Nothing is filled.

radius_mm: neighbours within it count; 0: three spacings of the points. max_sigmas: two points further apart along their normals, in
    sigmas of both, are not one skin. min_support: a point that agrees with no more than this share of its neighbours is an outlier.

Raises InvalidArgument: no normals, an option out of range. InsufficientData: points without neighbours, nothing left.
C: sgrt_surface_filter)";

constexpr const char* kSessionDoc =
    R"(The temporal filter of one sensor's organised surfaces: a Kalman filter a pixel, which starts again where a patch of 1 to 63
pixels has moved by more than its noise. One thread at a time; does not pickle.

motion_sigmas: of a patch's mean innovation, beyond which it has moved. drift_mm: how far skin may wander unseen in a second.
C: sgrt_filter_session_create)";

constexpr const char* kPushDoc = R"(The next frame, filtered: a FilteredFrame.

frame: an organised grid with normals and sigma_mm or covariance, of one size in all pushes. time_s: must not decrease.
Raises InvalidArgument: another size, no normals, no sigma, a time that runs backwards.
C: sgrt_filter_session_push)";

}  // namespace

void register_filter(py::module_& m) {
  const auto d = defaults(sgrt_surface_filter_options_init);
  const auto t = defaults(sgrt_filter_session_options_init);
  m.attr("FILTER_REASONS") = py::make_tuple(kReasons[0], kReasons[1], kReasons[2], kReasons[3]);
  m.attr("FILTER_STATES") = py::make_tuple(kStates[0], kStates[1], kStates[2], kStates[3]);

  py::class_<Filtered>(m, "Filtered", "A surface after the spatial filter.\n\nC: sgrt_surface_filter_info")
      .def_property_readonly(
          "surface", [](Filtered& f) { return &f.surface; }, "The Surface.")
      .def_readonly("reason", &Filtered::reason,
                    "uint8, a number a point of the surface that went in; index of FILTER_REASONS.")
      .def_property_readonly(
          "counts", [](const Filtered& f) { return counts_of(f.info.count, kReasons); }, "Points by reason.")
      .def_property_readonly(
          "radius_mm", [](const Filtered& f) { return f.info.radius_mm; }, "The radius that was used.")
      .def_property_readonly(
          "sigma_before_mm", [](const Filtered& f) { return f.info.sigma_before_mm; },
          "Median sigma along the normal of the filtered points, before; NaN without any.")
      .def_property_readonly(
          "sigma_after_mm", [](const Filtered& f) { return f.info.sigma_after_mm; }, "The same, after.")
      .def_property_readonly(
          "correlation_points", [](const Filtered& f) { return f.info.correlation_points; },
          "Of the result: what a point has gained, it shares with its neighbours.")
      .def("__repr__", [](const Filtered& f) {
        return py::str("<sgrt.Filtered {} filtered, {} kept, {} outliers, sigma {:.3f} to {:.3f} mm>")
            .format(f.info.count[SGRT_FILTER_FILTERED], f.info.count[SGRT_FILTER_KEPT],
                    f.info.count[SGRT_FILTER_OUTLIER], f.info.sigma_before_mm, f.info.sigma_after_mm);
      });
  m.def("surface_filter", &filter, py::arg("surface"), py::kw_only(), py::arg("radius_mm") = d.radius_mm,
        py::arg("max_sigmas") = d.max_sigmas, py::arg("min_support") = d.min_support, py::arg("context") = py::none(),
        kFilterDoc);

  py::class_<FilteredFrame>(m, "FilteredFrame", "A frame after the temporal filter.\n\nC: sgrt_filter_session_info")
      .def_property_readonly(
          "surface", [](FilteredFrame& f) { return &f.surface; },
          "The Surface: as the frame, its points averaged where they have not moved.")
      .def_readonly("state", &FilteredFrame::state, "uint8, H x W: index of FILTER_STATES.")
      .def_property_readonly(
          "counts", [](const FilteredFrame& f) { return counts_of(f.info.count, kStates); }, "Pixels by state.")
      .def("__repr__", [](const FilteredFrame& f) {
        return py::str("<sgrt.FilteredFrame {} averaged, {} moved>")
            .format(f.info.count[SGRT_TEMPORAL_AVERAGED], f.info.count[SGRT_TEMPORAL_MOVED]);
      });
  py::class_<FilterSession>(m, "FilterSession", kSessionDoc)
      .def(py::init(&open_session), py::kw_only(), py::arg("motion_sigmas") = t.motion_sigmas,
           py::arg("drift_mm") = t.drift_mm)
      .def("push", &push, py::arg("frame"), py::kw_only(), py::arg("time_s"), py::arg("context") = py::none(),
           kPushDoc);
}

}  // namespace sgrt_py
