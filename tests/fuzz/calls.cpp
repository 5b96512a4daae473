// Sequences of calls on handles and sessions in any order: a handle that is not there is NULL, times run any way,
// images have any size, the progress callback cancels now and then. What fits together answers, what does not is
// refused in one line, and nothing leaks.
#include "fuzz.hpp"

namespace {

const char kRig[] =
    R"({"schema": "sgrt-rig/1", "id": "fuzz", "room": "IEC 61217 fixed, mm", "cameras": [
{"id": "l", "image_size": [64, 48], "model": "pinhole", "intrinsics": [120, 120, 31.5, 23.5],
 "camera_from_room": [[1, 0, 0, 75], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]},
{"id": "r", "image_size": [64, 48], "model": "pinhole", "intrinsics": [120, 120, 31.5, 23.5],
 "camera_from_room": [[1, 0, 0, -75], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]}],
"pairs": [{"id": "pod", "left": "l", "right": "r"}],
"lasers": [{"id": "laser", "camera": "l", "fan": {"point": [300, 0, 1000], "normal": [0, 0, 1]}, "mirror": {"axis_point": [300, 0, 1000],
 "axis_direction": [0, 1, 0], "normal_at_zero": [0.5969, 0, -0.8023], "offset_mm": 0.5}}],
"tofs": [{"id": "tof", "camera": "l", "modulation_hz": [20e6], "tap_phase_rad": [0, 1.5707963, 3.1415927, 4.712389]}]})";

constexpr std::int64_t kMostPoints = 5000;

struct State {
  fuzz::Bytes bytes;
  bool cancel = false;
  sgrt_context* context = nullptr;
  sgrt_rig* rig = nullptr;
  sgrt_surface* surface[3] = {};
  sgrt_roi* roi = nullptr;
  sgrt_reference* reference = nullptr;
  sgrt_tracker* tracker = nullptr;
  sgrt_filter_session* filter = nullptr;
  sgrt_stereo_session* stereo = nullptr;
  sgrt_laser_session* laser = nullptr;
  sgrt_tof_session* tof = nullptr;
  double time_s = 0;
  std::vector<std::uint16_t> pixels = std::vector<std::uint16_t>(4 * 64 * 48);

  int slot() { return bytes.below(3); }
  double tick() { return time_s = bytes.below(8) == 7 ? bytes.number() : time_s + 0.05; }
  sgrt_context* any_context() { return bytes.below(2) == 1 ? context : nullptr; }
};

std::int32_t progress(void* user, double fraction, const char* stage) {
  fuzz::require(fraction >= 0 && fraction <= 1 && stage != nullptr && stage[0] != '\0',
                "progress lies in [0, 1] and names its stage");
  return static_cast<State*>(user)->cancel ? 1 : 0;
}

// A result put in the place of what stood there. By reference: it is looked at after the call among the arguments.
template <class Handle>
void put(Handle*& place, Handle*& made, sgrt_status status, void (*release)(Handle*)) {
  fuzz::require((made != nullptr) == (status == SGRT_OK), "a handle if and only if SGRT_OK");
  if (made == nullptr) return;
  release(place);
  place = made;
}

// Frames of noise with a ramp, the size mostly the rig's.
sgrt_view image(State& s, int frames) {
  std::uint32_t seed = s.bytes.byte();
  const int step = s.bytes.below(4) * 60;
  for (std::uint16_t& p : s.pixels) {
    seed = seed * 1664525U + 1013904223U;
    p = static_cast<std::uint16_t>(200 + step + (seed >> 24));
  }
  const int odd = s.bytes.below(16);
  return frames == 1 ? sgrt_view_of(s.pixels.data(), SGRT_U16, odd == 15 ? 47 : 48, 64, 0)
                     : sgrt_view_of(s.pixels.data(), SGRT_U16, frames, odd == 15 ? 47 : 48, 64);
}

void make_surface(State& s) {
  const int rows = 1 + s.bytes.below(12), columns = 1 + s.bytes.below(12), changes = s.bytes.below(4) / 3;
  sgrt_surface*& place = s.surface[s.slot()];
  sgrt_surface_free(place);
  place = nullptr;
  const std::vector<double> points = fuzz::patch(s.bytes, rows, columns, changes);
  place = fuzz::surface(s.bytes, points, rows, columns);
}

void work_on_surface(State& s) {
  sgrt_surface *made = nullptr, *const from = s.surface[s.slot()];
  sgrt_context* const context = s.any_context();
  sgrt_status status = SGRT_OK;
  switch (s.bytes.below(6)) {
    case 0:
      status = sgrt_surface_filter(context, from, nullptr, &made, nullptr, nullptr);
      break;
    case 1: {
      const sgrt_surface* const all[] = {from, s.surface[s.slot()], s.surface[s.slot()]};
      sgrt_surface_fuse_info info;
      info.struct_size = sizeof info;
      status = sgrt_surface_fuse(context, all, s.bytes.below(4), nullptr, &made, &info);
      // Points without neighbours overlap nothing: fused with themselves again and again they would fill memory.
      if (status == SGRT_OK && info.point_count > kMostPoints) return sgrt_surface_free(made);
      break;
    }
    case 2: {
      double pose[16];
      const double zero[3] = {};
      fuzz::checked(sgrt_frame_couch_turn(s.bytes.number(), zero, pose));
      status = sgrt_surface_move(context, from, pose, &made);
      break;
    }
    case 3:
      status = sgrt_filter_session_surface(s.filter, &made);
      break;
    case 4: {
      auto options = fuzz::defaults(sgrt_surface_normals_options_init);
      options.neighbours = s.bytes.byte();
      options.radius_mm = s.bytes.number();
      status = sgrt_surface_estimate_normals(context, from, &options, &made);
      break;
    }
    default: {
      sgrt_curvature* curvature = nullptr;
      const bool good = fuzz::ok(sgrt_curvature_compute(context, from, nullptr, &curvature));
      fuzz::require(good == (curvature != nullptr), "a handle if and only if SGRT_OK");
      return sgrt_curvature_free(curvature);
    }
  }
  put(s.surface[s.slot()], made, fuzz::checked(status), sgrt_surface_free);
}

void make_region(State& s) {
  sgrt_roi* made = nullptr;
  if (s.bytes.below(2) == 0) {
    const double low[3] = {s.bytes.number(), -20, -1e3}, high[3] = {20, s.bytes.number(), 1e3};
    const sgrt_status status = fuzz::checked(sgrt_roi_from_box(low, high, &made));
    return put(s.roi, made, status, sgrt_roi_free);
  }
  std::vector<double> xy(2 * static_cast<std::size_t>(s.bytes.below(8)));
  for (double& x : xy) x = s.bytes.number();
  const sgrt_view vertices = fuzz::view(xy, static_cast<std::int64_t>(xy.size() / 2), 2);
  const sgrt_status status = fuzz::checked(sgrt_roi_from_polygon(&vertices, &made));
  put(s.roi, made, status, sgrt_roi_free);
}

void make_session(State& s) {
  sgrt_context* const context = s.any_context();
  switch (s.bytes.below(6)) {
    case 0: {
      sgrt_reference* made = nullptr;
      const sgrt_status status = fuzz::checked(sgrt_reference_create(context, s.surface[s.slot()], s.roi, &made));
      return put(s.reference, made, status, sgrt_reference_free);
    }
    case 1: {
      sgrt_tracker* made = nullptr;
      auto options = fuzz::defaults(sgrt_tracker_options_init);
      options.gated = s.bytes.below(2);
      options.search = s.bytes.below(2);
      options.profile = s.bytes.below(4);
      const double isocentre[3] = {0, s.bytes.number(), 0};
      const sgrt_status status =
          fuzz::checked(sgrt_tracker_create(context, s.surface[s.slot()], isocentre, nullptr,
                                            s.bytes.below(2) == 1 ? s.roi : nullptr, &options, nullptr, &made));
      return put(s.tracker, made, status, sgrt_tracker_free);
    }
    case 2: {
      sgrt_filter_session* made = nullptr;
      return put(s.filter, made, fuzz::checked(sgrt_filter_session_create(nullptr, &made)), sgrt_filter_session_free);
    }
    case 3: {
      sgrt_stereo_session* made = nullptr;
      auto options = fuzz::defaults(sgrt_stereo_options_init);
      options.window_px = 9 + s.bytes.below(8);
      options.stride_px = s.bytes.below(6);
      const sgrt_status status = fuzz::checked(sgrt_stereo_session_create(context, s.rig, "pod", &options, &made));
      return put(s.stereo, made, status, sgrt_stereo_session_free);
    }
    case 4: {
      sgrt_laser_session* made = nullptr;
      const sgrt_status status =
          fuzz::checked(sgrt_laser_session_create(context, s.rig, "laser", nullptr, nullptr, &made));
      return put(s.laser, made, status, sgrt_laser_session_free);
    }
    default: {
      sgrt_tof_session* made = nullptr;
      return put(s.tof, made, fuzz::checked(sgrt_tof_session_create(context, s.rig, "tof", nullptr, &made)),
                 sgrt_tof_session_free);
    }
  }
}

void push_to_tracker(State& s) {
  sgrt_tracker_info info;
  info.struct_size = sizeof info;
  info.beam = SGRT_BEAM_ON;
  const sgrt_surface* live = s.surface[s.slot()];
  const sgrt_status status = fuzz::checked(sgrt_tracker_push(s.any_context(), s.tracker, live, s.tick(), &info));
  if (status != SGRT_OK) fuzz::require(info.beam == SGRT_BEAM_HOLD, "without SGRT_OK the beam holds");
  if (info.beam == SGRT_BEAM_ON)
    fuzz::require(info.hold == 0 && fuzz::rigid(info.reference_from_live), "a beam that is on has a pose");
  if (info.beam == SGRT_BEAM_HOLD && s.tracker != nullptr && status == SGRT_OK)
    fuzz::require(info.hold != 0, "a hold has a reason");
}

void push_to_stereo(State& s) {
  if (s.bytes.below(4) == 3) {
    fuzz::checked(sgrt_stereo_session_set_prior(s.any_context(), s.stereo, s.surface[s.slot()], s.roi, nullptr));
  }
  const sgrt_view left = image(s, 1), right = image(s, 1);
  const sgrt_stereo* lent = nullptr;
  const sgrt_status status =
      fuzz::checked(sgrt_stereo_session_push(s.any_context(), s.stereo, &left, &right, s.tick(), &lent));
  fuzz::require((status == SGRT_OK || status == SGRT_E_NOT_FOUND) == (lent != nullptr),
                "a result is lent for SGRT_OK and not found");
  sgrt_surface* made = nullptr;
  if (lent != nullptr)
    put(s.surface[s.slot()], made, fuzz::checked(sgrt_stereo_surface(lent, &made)), sgrt_surface_free);
}

void push_to_laser(State& s) {
  const sgrt_view frame = image(s, 1);
  const double angle = s.bytes.below(8) == 7 ? s.bytes.number() : 0.01 * s.bytes.byte();
  fuzz::checked(sgrt_laser_session_push(s.any_context(), s.laser, &frame, nullptr, angle, s.tick(), nullptr));
  sgrt_laser* result = nullptr;
  if (s.bytes.below(4) == 3)
    fuzz::checked(sgrt_laser_session_finish(s.any_context(), s.laser, nullptr, nullptr, &result));
  sgrt_laser_free(result);
}

void push_to_tof(State& s) {
  sgrt_view taps = image(s, 4);
  taps.ndim = 4;  // 1 frequency x taps x H x W
  for (int i = 3; i > 0; --i) taps.shape[i] = taps.shape[i - 1], taps.strides[i] = taps.strides[i - 1];
  taps.shape[0] = 1;
  const sgrt_tof* lent = nullptr;
  const sgrt_status status = fuzz::checked(sgrt_tof_session_push(s.any_context(), s.tof, &taps, s.tick(), &lent));
  fuzz::require((status == SGRT_OK || status == SGRT_E_NOT_FOUND) == (lent != nullptr),
                "a result is lent for SGRT_OK and not found");
  sgrt_surface* made = nullptr;
  if (lent != nullptr)
    put(s.surface[s.slot()], made, fuzz::checked(sgrt_tof_surface(s.any_context(), lent, &made)), sgrt_surface_free);
}

void register_pair(State& s) {
  const double isocentre[3] = {0, 0, 0};
  sgrt_icp* result = nullptr;
  const sgrt_surface* live = s.surface[s.slot()];
  if (s.bytes.below(2) == 0) {
    fuzz::checked(
        sgrt_icp_align(s.any_context(), s.surface[s.slot()], live, isocentre, s.roi, nullptr, nullptr, &result));
  } else {
    fuzz::checked(sgrt_reference_align(s.any_context(), s.reference, live, isocentre, nullptr, nullptr, &result));
  }
  sgrt_view view;
  if (result != nullptr) fuzz::require(fuzz::ok(sgrt_icp_array(result, SGRT_ICP_DISTANCE, &view)), "a distance map");
  sgrt_icp_free(result);
}

void release_something(State& s) {
  switch (s.bytes.below(8)) {
    case 0:
      sgrt_surface_free(s.surface[0]), s.surface[0] = nullptr;
      break;
    case 1:
      sgrt_roi_free(s.roi), s.roi = nullptr;
      break;
    case 2:
      sgrt_reference_free(s.reference), s.reference = nullptr;
      break;
    case 3:
      sgrt_tracker_free(s.tracker), s.tracker = nullptr;
      break;
    case 4:
      sgrt_stereo_session_free(s.stereo), s.stereo = nullptr;
      break;
    case 5:
      sgrt_rig_free(s.rig), s.rig = nullptr;
      break;
    default:
      s.cancel = !s.cancel;
  }
}

void step(State& s) {
  switch (s.bytes.below(11)) {
    case 0:
      return make_surface(s);
    case 1:
      return work_on_surface(s);
    case 2:
      return make_region(s);
    case 3:
      return make_session(s);
    case 4:
      return push_to_tracker(s);
    case 5:
      return push_to_stereo(s);
    case 6:
      return push_to_laser(s);
    case 7:
      return push_to_tof(s);
    case 8:
      return register_pair(s);
    case 9:
      return release_something(s);
    default: {
      const sgrt_surface* frame = s.surface[s.slot()];
      fuzz::checked(sgrt_filter_session_push(s.any_context(), s.filter, frame, s.tick(), nullptr));
      return;
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  State s{{data, size}};
  auto options = fuzz::defaults(sgrt_context_options_init);
  options.progress = progress;
  options.progress_user = &s;
  fuzz::require(fuzz::ok(sgrt_context_create(&options, &s.context)), "a context");
  fuzz::require(fuzz::ok(sgrt_rig_from_json(kRig, sizeof kRig - 1, &s.rig)), "the rig");
  for (int calls = 0; s.bytes.size > 0 && calls < 24; ++calls) step(s);
  for (sgrt_surface* surface : s.surface) sgrt_surface_free(surface);
  sgrt_roi_free(s.roi);
  sgrt_reference_free(s.reference);
  sgrt_tracker_free(s.tracker);
  sgrt_filter_session_free(s.filter);
  sgrt_stereo_session_free(s.stereo);
  sgrt_laser_session_free(s.laser);
  sgrt_tof_session_free(s.tof);
  sgrt_rig_free(s.rig);
  sgrt_context_free(s.context);
  return 0;
}
