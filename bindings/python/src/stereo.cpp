// Stereo: a pair of speckle images to a surface, once or as a session.
#include "bindings.hpp"

#include <iterator>

namespace sgrt_py {
namespace {

constexpr const char* kReasons[] = {"none",       "out_of_view", "out_of_volume", "no_texture", "saturated", "no_match",
                                    "left_right", "ambiguous",   "edge",          "moved",      "occluded"};
static_assert(std::size(kReasons) == SGRT_REASON_COUNT, "a reason of sgrt.h lacks its word");

using StereoHandle = Owned<sgrt_stereo, sgrt_stereo_free>;
using SessionHandle = Owned<sgrt_stereo_session, sgrt_stereo_session_free>;
template <class T>
using MaybeNumbers = std::optional<py::array_t<T>>;

// The arrays keep the handle alive (match) or are copies (session, whose result is lent until the next push).
struct Stereo {
  std::optional<Surface> surface;
  MaybeNumbers<uint8_t> reason;
  MaybeNumbers<float> correlation, sigma_px;
  MaybeNumbers<double> left_px, right_px;
  sgrt_stereo_info info{};
};

struct StereoSession {
  SessionHandle handle;
};

template <class T>
MaybeNumbers<T> array_of(const sgrt_stereo* result, int32_t field, const py::object& base) {
  sgrt_view view{};
  run([&] { return sgrt_stereo_array(result, field, &view); });
  MaybeNumbers<T> array = lend<T>(view, base);
  if (array && base.is_none()) {
    array = py::array_t<T>(py::array(array->attr("copy")()));
    array->attr("setflags")(py::arg("write") = false);
  }
  return array;
}

// base: what keeps `result` alive; None: copy.
Stereo unpack(const sgrt_stereo* result, const py::object& base) {
  Stereo s;
  s.info.struct_size = sizeof s.info;
  run([&] { return sgrt_stereo_summary(result, &s.info); });
  s.reason = array_of<uint8_t>(result, SGRT_STEREO_REASON, base);
  s.correlation = array_of<float>(result, SGRT_STEREO_CORRELATION, base);
  s.sigma_px = array_of<float>(result, SGRT_STEREO_SIGMA_PX, base);
  s.left_px = array_of<double>(result, SGRT_STEREO_LEFT_PX, base);
  s.right_px = array_of<double>(result, SGRT_STEREO_RIGHT_PX, base);
  if (s.info.point_count > 0) {
    s.surface.emplace();  // it has its own share of the memory: it outlives what a session lends
    run([&] { return sgrt_stereo_surface(result, out(s.surface->handle)); });
  }
  return s;
}

Stereo lending(StereoHandle handle) {
  const sgrt_stereo* result = handle.get();
  py::capsule base(handle.release(), [](void* raw) { sgrt_stereo_free(static_cast<sgrt_stereo*>(raw)); });
  return unpack(result, base);
}

sgrt_stereo_options options_of(int32_t window_px, int32_t stride_px, int32_t min_component,
                               const ArrayLike& volume_min_mm, const ArrayLike& volume_max_mm, double min_correlation,
                               double max_left_right_px, double max_sigma_px, double max_epipolar_px) {
  auto o = defaults(sgrt_stereo_options_init);
  o.window_px = window_px;
  o.stride_px = stride_px;
  o.min_component = min_component;
  read_numbers(volume_min_mm, "volume_min_mm", {3}, o.volume_min_mm);
  read_numbers(volume_max_mm, "volume_max_mm", {3}, o.volume_max_mm);
  o.min_correlation = min_correlation;
  o.max_left_right_px = max_left_right_px;
  o.max_sigma_px = max_sigma_px;
  o.max_epipolar_px = max_epipolar_px;
  return o;
}

Stereo match(const Rig& rig, const std::string& pair_id, const ArrayLike& left, const ArrayLike& right,
             int32_t window_px, int32_t stride_px, int32_t min_component, const ArrayLike& volume_min_mm,
             const ArrayLike& volume_max_mm, double min_correlation, double max_left_right_px, double max_sigma_px,
             double max_epipolar_px, Context* context) {
  const InView l(left, "left", Accept::kImages), r(right, "right", Accept::kImages);
  const char* pair = c_text(pair_id, "pair_id");
  const auto options = options_of(window_px, stride_px, min_component, volume_min_mm, volume_max_mm, min_correlation,
                                  max_left_right_px, max_sigma_px, max_epipolar_px);
  StereoHandle handle;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_stereo_match(c, rig.handle.get(), pair, &l.view, &r.view, &options, out(handle));
  });
  if (outcome.status == SGRT_OK) return lending(std::move(handle));
  raise(outcome.status, outcome.message, handle ? py::cast(lending(std::move(handle))) : py::none());
}

void set_prior(StereoSession& session, const Surface* prior, const Roi* roi, double band_mm, bool follow,
               Context* context) {
  auto options = defaults(sgrt_stereo_prior_options_init);
  options.band_mm = band_mm;
  options.follow = follow ? 1 : 0;
  run(context, [&](sgrt_context* c) {
    return sgrt_stereo_session_set_prior(c, session.handle.get(), prior ? prior->handle.get() : nullptr,
                                         roi ? roi->handle.get() : nullptr, &options);
  });
}

StereoSession open_session(const Rig& rig, const std::string& pair_id, int32_t window_px, int32_t stride_px,
                           int32_t min_component, const ArrayLike& volume_min_mm, const ArrayLike& volume_max_mm,
                           double min_correlation, double max_left_right_px, double max_sigma_px,
                           double max_epipolar_px, const Surface* prior, const Roi* roi, double band_mm, bool follow,
                           Context* context) {
  const char* pair = c_text(pair_id, "pair_id");
  const auto options = options_of(window_px, stride_px, min_component, volume_min_mm, volume_max_mm, min_correlation,
                                  max_left_right_px, max_sigma_px, max_epipolar_px);
  StereoSession session;
  run(context, [&](sgrt_context* c) {
    return sgrt_stereo_session_create(c, rig.handle.get(), pair, &options, out(session.handle));
  });
  if (prior || roi) set_prior(session, prior, roi, band_mm, follow, context);
  return session;
}

Stereo push(StereoSession& session, const ArrayLike& left, const ArrayLike& right, double time_s, Context* context) {
  const InView l(left, "left", Accept::kImages), r(right, "right", Accept::kImages);
  const sgrt_stereo* lent = nullptr;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_stereo_session_push(c, session.handle.get(), &l.view, &r.view, time_s, &lent);
  });
  if (outcome.status == SGRT_OK) return unpack(lent, py::none());
  raise(outcome.status, outcome.message, lent ? py::cast(unpack(lent, py::none())) : py::none());
}

py::typing::Dict<py::str, int> counts(const Stereo& s) {
  py::typing::Dict<py::str, int> by_word;
  for (int i = 0; i < SGRT_REASON_COUNT; ++i) by_word[kReasons[i]] = s.info.reason_count[i];
  return by_word;
}

constexpr const char* kMatchDoc =
    R"(Matches one pair of speckle images along its epipolar lines and triangulates: a Stereo.

pair_id: of the rig. left, right: H x W, uint8, uint16 or float32, of the size the rig states.
window_px: side of the square window, odd, 9 to 41. stride_px: a point every so many pixels of the rectified left image, 1 to 32.
min_component: groups of fewer connected points are rejected. volume_min_mm, volume_max_mm: working volume, 3 numbers each, room axes;
    it decides the search range. min_correlation: ZNCC of an accepted match. max_left_right_px: left-right check.
max_sigma_px: matches of a larger predicted sigma have no texture. max_epipolar_px: off the epipolar lines by more (RMS), the rig is
    out of calibration.

Raises InvalidArgument: unknown pair, image of another size or dtype, an even window. NotFound: nothing matched (error.result tells
    why). Degenerate: a camera looks along the baseline. Cancelled.
C: sgrt_stereo_match)";

constexpr const char* kSessionDoc =
    R"(The same pair again and again (live mode); options as stereo_match. One thread at a time; does not pickle.

prior, roi, band_mm, follow: as set_prior.
C: sgrt_stereo_session_create)";

constexpr const char* kPriorDoc =
    R"(Live mode: the pushes that follow search only near `prior`, only where it lies in `roi`.

prior: a Surface in room axes (a reference, an earlier result, any cloud of chosen points); None: search everywhere again.
roi: the part of the prior that counts; None: all. band_mm: along the line of sight; what has moved further is "moved", and what
    lies beside the region "out_of_volume". follow: each result is the prior of the next push.
The prior says where to look, never what is found: a match must correlate and agree left-right as without it.

Raises InsufficientData: fewer than 3 points of the prior lie in roi and where both cameras see. InvalidArgument: a roi without a
    prior; band_mm. The session is then as before.
C: sgrt_stereo_session_set_prior)";

constexpr const char* kPushDoc = R"(The Stereo of the next pair of images, as arrays of its own.

left, right: as stereo_match. time_s: must not decrease. After an error the session can go on.
Raises as stereo_match.
C: sgrt_stereo_session_push)";

}  // namespace

void register_stereo(py::module_& m) {
  const auto d = defaults(sgrt_stereo_options_init);
  const auto live = defaults(sgrt_stereo_prior_options_init);
  const auto corner = [](const double* v) { return py::make_tuple(v[0], v[1], v[2]); };
  const auto volume_min = corner(d.volume_min_mm), volume_max = corner(d.volume_max_mm);
  const auto none = py::none();

  py::tuple words(static_cast<size_t>(SGRT_REASON_COUNT));
  for (int i = 0; i < SGRT_REASON_COUNT; ++i) words[i] = kReasons[i];
  m.attr("STEREO_REASONS") = words;

  py::class_<Stereo>(m, "Stereo", R"(What a pair of speckle images gave, on a grid of H x W points.

C: sgrt_stereo_summary, sgrt_stereo_array, sgrt_stereo_surface)")
      .def_property_readonly(
          "surface", [](Stereo& s) { return s.surface ? std::optional<Surface*>(&*s.surface) : std::nullopt; },
          "The Surface: organised grid with normals, sigma_mm and covariance; None where nothing matched.")
      .def_readonly("reason", &Stereo::reason,
                    "uint8, H x W: why a grid point has no surface point; index of STEREO_REASONS.")
      .def_readonly("correlation", &Stereo::correlation, "float32, H x W: ZNCC; NaN where absent.")
      .def_readonly("sigma_px", &Stereo::sigma_px, "float32, H x W: one sigma of the match, px; NaN where absent.")
      .def_readonly("left_px", &Stereo::left_px, "float64, H x W x 2: pixel in the left image as taken.")
      .def_readonly("right_px", &Stereo::right_px, "float64, H x W x 2: pixel in the right image; NaN where absent.")
      .def_property_readonly("counts", &counts, "Grid points by the word of their reason; they sum to H W.")
      .def_property_readonly(
          "point_count", [](const Stereo& s) { return s.info.point_count; }, "Points of the surface.")
      .def_property_readonly(
          "noise_left", [](const Stereo& s) { return s.info.noise_left; },
          "Image noise, grey levels of the left image; NaN if nothing matched.")
      .def_property_readonly(
          "median_sigma_px", [](const Stereo& s) { return s.info.median_sigma_px; },
          "Median predicted one-sigma of a match, px.")
      .def_property_readonly(
          "median_sigma_mm", [](const Stereo& s) { return s.info.median_sigma_mm; },
          "Median one-sigma of a point along its normal, mm.")
      .def_property_readonly(
          "epipolar_px", [](const Stereo& s) { return s.info.epipolar_px; },
          "The rig on trial: median of how far matches lie off their epipolar lines, px; NaN where too few tell.")
      .def_property_readonly(
          "epipolar_sigma_px", [](const Stereo& s) { return s.info.epipolar_sigma_px; }, "Its one-sigma, px.")
      .def_property_readonly(
          "epipolar_rms_px", [](const Stereo& s) { return s.info.epipolar_rms_px; },
          "RMS over the image, noise taken out, px.")
      .def_property_readonly(
          "epipolar_count", [](const Stereo& s) { return s.info.epipolar_count; }, "Windows that it is made of.")
      .def_property_readonly(
          "out_of_calibration", [](const Stereo& s) { return s.info.out_of_calibration != 0; },
          "The rig fails: depths are wrong by an unknown amount.")
      .def("__repr__", [](const Stereo& s) {
        return py::str("<sgrt.Stereo {} of {} x {} points, median sigma {:.3f} mm>")
            .format(s.info.point_count, s.info.height, s.info.width, s.info.median_sigma_mm);
      });

  m.def("stereo_match", &match, py::arg("rig"), py::arg("pair_id"), py::arg("left"), py::arg("right"), py::kw_only(),
        py::arg("window_px") = d.window_px, py::arg("stride_px") = d.stride_px,
        py::arg("min_component") = d.min_component, py::arg("volume_min_mm") = volume_min,
        py::arg("volume_max_mm") = volume_max, py::arg("min_correlation") = d.min_correlation,
        py::arg("max_left_right_px") = d.max_left_right_px, py::arg("max_sigma_px") = d.max_sigma_px,
        py::arg("max_epipolar_px") = d.max_epipolar_px, py::arg("context") = none, kMatchDoc);

  py::class_<StereoSession>(m, "StereoSession", kSessionDoc)
      .def(py::init(&open_session), py::arg("rig"), py::arg("pair_id"), py::kw_only(),
           py::arg("window_px") = d.window_px, py::arg("stride_px") = d.stride_px,
           py::arg("min_component") = d.min_component, py::arg("volume_min_mm") = volume_min,
           py::arg("volume_max_mm") = volume_max, py::arg("min_correlation") = d.min_correlation,
           py::arg("max_left_right_px") = d.max_left_right_px, py::arg("max_sigma_px") = d.max_sigma_px,
           py::arg("max_epipolar_px") = d.max_epipolar_px, py::arg("prior") = none, py::arg("roi") = none,
           py::arg("band_mm") = live.band_mm, py::arg("follow") = live.follow != 0, py::arg("context") = none)
      .def("set_prior", &set_prior, py::arg("prior") = none, py::kw_only(), py::arg("roi") = none,
           py::arg("band_mm") = live.band_mm, py::arg("follow") = live.follow != 0, py::arg("context") = none,
           kPriorDoc)
      .def("push", &push, py::arg("left"), py::arg("right"), py::kw_only(), py::arg("time_s"),
           py::arg("context") = none, kPushDoc);
}

}  // namespace sgrt_py
