// The tracker.
#include "tracking/tracker.hpp"

#include <algorithm>
#include <limits>

#include "capi/capi.hpp"
#include "capi/motion.hpp"

namespace sgrt {
namespace {

static_assert(static_cast<int>(Profile::kConventional) == SGRT_PROFILE_CONVENTIONAL &&
              static_cast<int>(Profile::kSbrt) == SGRT_PROFILE_SBRT &&
              static_cast<int>(Profile::kSrs) == SGRT_PROFILE_SRS &&
              static_cast<int>(kHoldNoPose) == SGRT_HOLD_NO_POSE && static_cast<int>(kHoldWeak) == SGRT_HOLD_WEAK &&
              static_cast<int>(kHoldTranslation) == SGRT_HOLD_TRANSLATION &&
              static_cast<int>(kHoldRotation) == SGRT_HOLD_ROTATION &&
              static_cast<int>(kHoldBreathing) == SGRT_HOLD_BREATHING &&
              static_cast<int>(kHoldReturning) == SGRT_HOLD_RETURNING &&
              static_cast<int>(TrackState::kLost) == SGRT_TRACK_LOST &&
              static_cast<int>(TrackState::kTracking) == SGRT_TRACK_TRACKING &&
              static_cast<int>(TrackState::kFound) == SGRT_TRACK_FOUND);

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kMaxSeconds = 1e6;

sgrt_tracker_options tracker_defaults() {
  const TrackerOptions o;
  sgrt_tracker_options c{};
  c.struct_size = sizeof c;
  c.profile = static_cast<std::int32_t>(o.profile);
  c.gated = o.gated ? 1 : 0;
  c.search = o.search ? 1 : 0;
  c.search_every_s = o.search_every;
  c.tolerance_mm = o.tolerance_mm;
  c.tolerance_deg = o.tolerance_deg;
  c.hysteresis = o.hysteresis;
  c.resume_s = o.resume;
  c.max_gap_s = o.max_gap;
  c.gate_low_mm = o.gate_low;
  c.gate_high_mm = o.gate_high;
  return c;
}

TrackerOptions from_c(const sgrt_tracker_options& c, const IcpOptions& icp) {
  TrackerOptions o;
  check_range(c.profile, SGRT_PROFILE_CONVENTIONAL, SGRT_PROFILE_SRS, "options.profile");
  check_range(c.gated, 0, 1, "options.gated");
  check_range(c.search, 0, 1, "options.search");
  check_range(c.search_every_s, 0, kMaxSeconds, "options.search_every_s");
  check_range(c.tolerance_mm, 0, kMaxCoordinate, "options.tolerance_mm");
  check_range(c.tolerance_deg, 0, 180, "options.tolerance_deg");
  check_positive(c.hysteresis, 1, "options.hysteresis");
  check_range(c.resume_s, 0, kMaxSeconds, "options.resume_s");
  check_positive(c.max_gap_s, kMaxSeconds, "options.max_gap_s");
  check_range(c.gate_low_mm, -kMaxCoordinate, kMaxCoordinate, "options.gate_low_mm");
  check_range(c.gate_high_mm, -kMaxCoordinate, kMaxCoordinate, "options.gate_high_mm");
  if (!(c.gate_low_mm < c.gate_high_mm))
    refuse("options.gate_low_mm", text_of(c.gate_low_mm), "less than gate_high_mm, " + text_of(c.gate_high_mm));
  o.profile = static_cast<Profile>(c.profile);
  o.gated = c.gated != 0;
  o.search = c.search != 0;
  o.search_every = c.search_every_s;
  o.tolerance_mm = c.tolerance_mm;
  o.tolerance_deg = c.tolerance_deg;
  o.hysteresis = c.hysteresis;
  o.resume = c.resume_s;
  o.max_gap = c.max_gap_s;
  o.gate_low = c.gate_low_mm;
  o.gate_high = c.gate_high_mm;
  o.icp = icp;
  return o;
}

sgrt_tracker_info to_c(const TrackFrame& f) {
  const IcpResult& r = f.icp;
  sgrt_tracker_info info{};
  info.status = static_cast<sgrt_status>(r.status);
  info.verdict = static_cast<std::int32_t>(r.verdict);
  info.beam = f.beam ? SGRT_BEAM_ON : SGRT_BEAM_HOLD;
  info.hold = f.hold;
  info.state = static_cast<std::int32_t>(f.state);
  info.attempts = f.attempts;
  info.iterations = r.iterations;
  info.frame = f.index;
  info.time_s = f.time;
  write_motion(r, info);
  info.drift = to_c(f.drift);
  info.rms_mm = r.rms;
  info.inlier_share = r.inlier_share;
  info.breathing_mm = f.breathing.mm;
  info.breathing_sigma_mm = f.breathing.sigma;
  info.searched = f.searched ? 1 : 0;
  return info;
}

// A frame that never was: the beam holds, the numbers are NaN.
sgrt_tracker_info no_frame(sgrt_status status, double time_s) {
  sgrt_tracker_info info{};
  info.status = status;
  info.hold = SGRT_HOLD_NO_POSE;
  info.frame = -1;
  info.time_s = time_s;
  const auto nan = [](double* first, int count) { std::fill_n(first, count, kNan); };
  const auto no_shift = [&](auto& s) { s = {kNan, kNan, kNan, kNan, kNan, kNan, kNan}; };
  nan(info.reference_from_live, 16);
  no_shift(info.displacement);
  no_shift(info.correction);
  no_shift(info.drift);
  nan(info.covariance, 36);
  nan(info.sigma_mm, 3);
  nan(info.sigma_deg, 3);
  info.rms_mm = info.inlier_share = info.breathing_mm = info.breathing_sigma_mm = kNan;
  return info;
}

// Into a text that keeps its memory from frame to frame.
void say_hold(int hold, std::string& words) {
  constexpr std::pair<int, const char*> kWords[] = {{kHoldNoPose, "no pose"},
                                                    {kHoldWeak, "a pose that is not certain enough"},
                                                    {kHoldTranslation, "the translation is beyond tolerance"},
                                                    {kHoldRotation, "the rotation is beyond tolerance"},
                                                    {kHoldBreathing, "the breathing is outside the window"},
                                                    {kHoldReturning, "coming back"}};
  words.clear();
  for (const auto& [bit, text] : kWords) {
    if ((hold & bit) == 0) continue;
    if (!words.empty()) words += "; ";
    words += text;
  }
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_tracker_options_init(sgrt_tracker_options* options, size_t size) {
  return guard([&] { init_struct(options, size, tracker_defaults(), "options"); });
}

sgrt_status sgrt_tracker_create(sgrt_context* context, const sgrt_surface* reference, const double isocentre_mm[3],
                                const sgrt_roi* roi, const sgrt_roi* gate_roi, const sgrt_tracker_options* options,
                                const sgrt_icp_options* icp_options, sgrt_tracker** tracker) {
  return guard([&] {
    need(reference, "reference");
    need(tracker, "tracker");
    const Vec3 isocentre = place(isocentre_mm, "isocentre_mm");
    const IcpOptions icp = from_c(read_struct(icp_options, to_c(IcpOptions{}), "icp_options.struct_size"));
    const TrackerOptions o = from_c(read_struct(options, tracker_defaults(), "options.struct_size"), icp);
    *tracker = new sgrt_tracker{Tracker(run_of(context), reference->surface, isocentre, roi ? &roi->roi : nullptr,
                                        gate_roi ? &gate_roi->roi : nullptr, o),
                                ""};
  });
}

void sgrt_tracker_free(sgrt_tracker* tracker) {
  guard([&] { delete tracker; });
}

sgrt_status sgrt_tracker_push(sgrt_context* context, sgrt_tracker* tracker, const sgrt_surface* live, double time_s,
                              sgrt_tracker_info* info) {
  return guard([&] {
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, no_frame(SGRT_E_INTERNAL, time_s));  // whatever happens now, the beam holds
    try {
      need(tracker, "tracker");
      say_hold(kHoldNoPose, tracker->hold_words);
      const TrackFrame& frame = tracker->tracker.push(run_of(context), live ? live->surface.get() : nullptr, time_s);
      say_hold(frame.hold, tracker->hold_words);
      write_struct(info, to_c(frame));
      return answer(frame.icp.status, frame.icp.message.c_str());
    } catch (const Error& error) {
      write_struct(info, no_frame(static_cast<sgrt_status>(error.status()), time_s));
      throw;
    }
  });
}

sgrt_status sgrt_tracker_set_reference(sgrt_context* context, sgrt_tracker* tracker, const sgrt_surface* reference,
                                       const sgrt_roi* roi, const sgrt_roi* gate_roi) {
  return guard([&] {
    need(tracker, "tracker");
    need(reference, "reference");
    tracker->tracker.replace_reference(run_of(context), reference->surface, roi ? &roi->roi : nullptr,
                                       gate_roi ? &gate_roi->roi : nullptr);
  });
}

const char* sgrt_tracker_text(const sgrt_tracker* tracker, int32_t field) {
  return guard_text([&]() -> const char* {
    if (!tracker) return nullptr;
    switch (field) {
      case SGRT_TRACKER_VERDICT:
        return tracker->tracker.last().icp.verdict_words.c_str();
      case SGRT_TRACKER_HOLD:
        return tracker->hold_words.c_str();
      default:
        return nullptr;
    }
  });
}
