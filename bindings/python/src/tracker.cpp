// The tracker: surfaces in, shifts and the beam-hold signal out.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

struct Tracker {
  Owned<sgrt_tracker, sgrt_tracker_free> handle;
};

struct TrackFrame {
  sgrt_tracker_info info{};
  std::string verdict_text, hold_text;
};

int32_t profile_of(const std::string& name) {
  constexpr std::pair<const char*, int32_t> kProfiles[] = {
      {"conventional", SGRT_PROFILE_CONVENTIONAL}, {"sbrt", SGRT_PROFILE_SBRT}, {"srs", SGRT_PROFILE_SRS}};
  for (const auto& [word, code] : kProfiles) {
    if (name == word) return code;
  }
  invalid("profile: '" + name + "' is unknown; expected conventional, sbrt or srs");
}

Tracker create(const Surface& reference, const ArrayLike& isocentre_mm, const Roi* roi, const Roi* gate_roi,
               const std::string& profile, bool gated, double tolerance_mm, double tolerance_deg, double hysteresis,
               double resume_s, double max_gap_s, double gate_low_mm, double gate_high_mm, bool search,
               double search_every_s, double max_distance_mm, double min_inlier_share, Context* context) {
  const Vec3 isocentre(isocentre_mm, "isocentre_mm");
  auto options = defaults(sgrt_tracker_options_init);
  options.profile = profile_of(profile);
  options.gated = gated ? 1 : 0;
  options.tolerance_mm = tolerance_mm;
  options.tolerance_deg = tolerance_deg;
  options.hysteresis = hysteresis;
  options.resume_s = resume_s;
  options.max_gap_s = max_gap_s;
  options.gate_low_mm = gate_low_mm;
  options.gate_high_mm = gate_high_mm;
  options.search = search ? 1 : 0;
  options.search_every_s = search_every_s;
  auto icp = defaults(sgrt_icp_options_init);
  icp.max_distance_mm = max_distance_mm;
  icp.min_inlier_share = min_inlier_share;
  Tracker tracker;
  run(context, [&](sgrt_context* c) {
    return sgrt_tracker_create(c, reference.handle.get(), isocentre.v, roi ? roi->handle.get() : nullptr,
                               gate_roi ? gate_roi->handle.get() : nullptr, &options, &icp, out(tracker.handle));
  });
  return tracker;
}

std::string text_of(const sgrt_tracker* tracker, int32_t field) {
  const char* text = sgrt_tracker_text(tracker, field);
  return text ? text : "";
}

TrackFrame push(Tracker& tracker, const Surface* live, double time_s, Context* context) {
  TrackFrame frame;
  frame.info.struct_size = sizeof frame.info;
  const Outcome outcome = attempt(context, [&](sgrt_context* c) {
    return sgrt_tracker_push(c, tracker.handle.get(), live ? live->handle.get() : nullptr, time_s, &frame.info);
  });
  const bool of_a_frame = outcome.status == SGRT_OK || (outcome.status >= 10 && outcome.status < 20);
  if (!of_a_frame) raise(outcome.status, outcome.message);
  frame.verdict_text = text_of(tracker.handle.get(), SGRT_TRACKER_VERDICT);
  frame.hold_text = text_of(tracker.handle.get(), SGRT_TRACKER_HOLD);
  return frame;
}

void set_reference(Tracker& tracker, const Surface& reference, const Roi* roi, const Roi* gate_roi, Context* context) {
  run(context, [&](sgrt_context* c) {
    return sgrt_tracker_set_reference(c, tracker.handle.get(), reference.handle.get(),
                                      roi ? roi->handle.get() : nullptr, gate_roi ? gate_roi->handle.get() : nullptr);
  });
}

const char* verdict_word(int32_t verdict) {
  return verdict == SGRT_VERDICT_OK ? "ok" : verdict == SGRT_VERDICT_WEAK ? "weak" : "none";
}

const char* state_word(int32_t state) {
  return state == SGRT_TRACK_TRACKING ? "tracking" : state == SGRT_TRACK_FOUND ? "found" : "lost";
}

std::vector<std::string> hold_words(const TrackFrame& frame) {
  constexpr std::pair<int32_t, const char*> kWords[] = {
      {SGRT_HOLD_NO_POSE, "no_pose"},   {SGRT_HOLD_WEAK, "weak"},           {SGRT_HOLD_TRANSLATION, "translation"},
      {SGRT_HOLD_ROTATION, "rotation"}, {SGRT_HOLD_BREATHING, "breathing"}, {SGRT_HOLD_RETURNING, "returning"}};
  std::vector<std::string> words;
  for (const auto& [bit, word] : kWords) {
    if ((frame.info.hold & bit) != 0) words.emplace_back(word);
  }
  return words;
}

constexpr const char* kTrackerDoc =
    R"(Surfaces in, shifts out, and whether the beam may be on. A session: one thread at a time; it does not pickle.

reference, isocentre_mm, roi: as icp_align. gate_roi: the patch of the reference whose height over it is the breathing amplitude.
profile: 'conventional' (2 mm, 1 deg), 'sbrt' or 'srs' (1 mm, 0.5 deg), of the length of the translation and the angle of the
    rotation. tolerance_mm, tolerance_deg: instead of the profile's; 0: the profile's.
gated: the beam is on only with the amplitude within gate_low_mm to gate_high_mm (DIBH).
hysteresis: after a hold the beam comes on at this share of the tolerance and of the window. resume_s: after so long within it.
max_gap_s: after a longer pause no motion is predicted, and the beam comes back as from a hold.
search: a patient who is lost is looked for anywhere, too, at most every search_every_s; such a search takes 0.1 to 0.3 s.
max_distance_mm, min_inlier_share: of the registration, as icp_align.

Raises InvalidArgument: an option out of range, gated without gate_roi. InsufficientData: fewer than 6 points in gate_roi.
C: sgrt_tracker_create)";

constexpr const char* kPushDoc =
    R"(Takes one frame: a TrackFrame.

live: a Surface; None where the cameras had nothing. time_s: must not decrease. A frame without a pose does not raise: its status
says why, its numbers are NaN and its beam is 'hold'.

Raises InvalidArgument: a time that runs backwards or is not finite; the beam then has to come back as from a hold. Cancelled.
C: sgrt_tracker_push)";

template <class Get>
void number(py::class_<TrackFrame>& cls, const char* name, Get get, const char* doc) {
  cls.def_property_readonly(
      name, [get](const TrackFrame& f) { return get(f.info); }, doc);
}

void register_frame_class(py::module_& m) {
  py::class_<TrackFrame> cls(m, "TrackFrame",
                             "What the tracker says of one frame.\n\nC: sgrt_tracker_info, sgrt_tracker_text");
  cls.def_property_readonly(
         "status", [](const TrackFrame& f) { return std::string(sgrt_status_word(f.info.status)); },
         "The word of its status: 'ok', 'not_found', ...")
      .def_property_readonly(
          "verdict", [](const TrackFrame& f) { return verdict_word(f.info.verdict); },
          "'ok', 'weak', or 'none' without a pose.")
      .def_readonly("verdict_text", &TrackFrame::verdict_text, "'ok', 'weak: ...', or why there is no pose.")
      .def_property_readonly(
          "beam", [](const TrackFrame& f) { return f.info.beam == SGRT_BEAM_ON ? "on" : "hold"; }, "'on' or 'hold'.")
      .def_property_readonly("hold", &hold_words,
                             "Why the beam holds: of 'no_pose', 'weak', 'translation', 'rotation', 'breathing', "
                             "'returning'; empty where it is on.")
      .def_readonly("hold_text", &TrackFrame::hold_text, "The same as one English text.")
      .def_property_readonly(
          "state", [](const TrackFrame& f) { return state_word(f.info.state); },
          "'tracking', 'lost', or 'found': the first trusted frame after a loss.")
      .def_property_readonly(
          "reference_from_live",
          [](const TrackFrame& f) {
            return fixed_array(f.info.reference_from_live, {4, 4});
          },
          "4 x 4, room frame, mm; the inverse of the displacement.")
      .def_property_readonly(
          "displacement", [](const TrackFrame& f) { return f.info.displacement; }, "Where the patient is.")
      .def_property_readonly(
          "correction", [](const TrackFrame& f) { return f.info.correction; }, "What the couch must do.")
      .def_property_readonly(
          "drift", [](const TrackFrame& f) { return f.info.drift; },
          "Where the patient went since the first trusted frame.")
      .def_property_readonly(
          "covariance",
          [](const TrackFrame& f) {
            return fixed_array(f.info.covariance, {6, 6});
          },
          "6 x 6, as Icp.covariance.")
      .def_property_readonly(
          "sigma_mm", [](const TrackFrame& f) { return fixed_array(f.info.sigma_mm, {3}); },
          "One sigma of lat, lng, vrt.")
      .def_property_readonly(
          "sigma_deg", [](const TrackFrame& f) { return fixed_array(f.info.sigma_deg, {3}); },
          "One sigma about room X, Y, Z.");
  number(
      cls, "time_s", [](const sgrt_tracker_info& i) { return i.time_s; }, "As it was given.");
  number(
      cls, "frame", [](const sgrt_tracker_info& i) { return i.frame; }, "Its number, from 0.");
  number(
      cls, "searched", [](const sgrt_tracker_info& i) { return i.searched != 0; },
      "True where the patient was looked for anywhere in this frame.");
  number(
      cls, "attempts", [](const sgrt_tracker_info& i) { return i.attempts; },
      "Starts tried: predicted, last seen, set up.");
  number(
      cls, "iterations", [](const sgrt_tracker_info& i) { return i.iterations; }, "Of the registration.");
  number(
      cls, "rms_mm", [](const sgrt_tracker_info& i) { return i.rms_mm; }, "As Icp.rms_mm.");
  number(
      cls, "inlier_share", [](const sgrt_tracker_info& i) { return i.inlier_share; }, "As Icp.inlier_share.");
  number(
      cls, "breathing_mm", [](const sgrt_tracker_info& i) { return i.breathing_mm; },
      "The breathing amplitude, outward positive; NaN without gate_roi or points.");
  number(
      cls, "breathing_sigma_mm", [](const sgrt_tracker_info& i) { return i.breathing_sigma_mm; }, "One sigma of it.");
  cls.def("__repr__", [](const TrackFrame& f) {
    return py::str("<sgrt.TrackFrame {} at {:.6g} s, {}, beam {}, {!r}>")
        .format(f.info.frame, f.info.time_s, sgrt_status_word(f.info.status),
                f.info.beam == SGRT_BEAM_ON ? "on" : "hold", py::cast(f.info.displacement));
  });
}

}  // namespace

void register_tracker(py::module_& m) {
  const auto d = defaults(sgrt_tracker_options_init);
  const auto icp = defaults(sgrt_icp_options_init);
  const auto none = py::none();
  register_frame_class(m);
  py::class_<Tracker>(m, "Tracker", kTrackerDoc)
      .def(py::init(&create), py::arg("reference"), py::kw_only(), py::arg("isocentre_mm"), py::arg("roi") = none,
           py::arg("gate_roi") = none, py::arg("profile") = "conventional", py::arg("gated") = d.gated != 0,
           py::arg("tolerance_mm") = d.tolerance_mm, py::arg("tolerance_deg") = d.tolerance_deg,
           py::arg("hysteresis") = d.hysteresis, py::arg("resume_s") = d.resume_s, py::arg("max_gap_s") = d.max_gap_s,
           py::arg("gate_low_mm") = d.gate_low_mm, py::arg("gate_high_mm") = d.gate_high_mm,
           py::arg("search") = d.search != 0, py::arg("search_every_s") = d.search_every_s,
           py::arg("max_distance_mm") = icp.max_distance_mm, py::arg("min_inlier_share") = icp.min_inlier_share,
           py::arg("context") = none)
      .def("push", &push, py::arg("live").none(true), py::kw_only(), py::arg("time_s"), py::arg("context") = none,
           kPushDoc)
      .def("set_reference", &set_reference, py::arg("reference"), py::kw_only(), py::arg("roi") = none,
           py::arg("gate_roi") = none, py::arg("context") = none,
           R"(Another reference from the next frame on: motion, drift and beam start afresh, the time does not.

Raises as the constructor; the old reference then stays, the beam on hold.
C: sgrt_tracker_set_reference)");
}

}  // namespace sgrt_py
