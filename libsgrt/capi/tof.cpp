// Time of flight: taps of one frame or several to ranges and points, or a session of them.
#include "tof/tof.hpp"

#include <algorithm>
#include <limits>

#include "capi/capi.hpp"
#include "tof/kernels.hpp"

namespace sgrt {
namespace {

static_assert(kernels::kSaturated == SGRT_TOF_SATURATED && kernels::kLowAmplitude == SGRT_TOF_LOW_AMPLITUDE &&
              kernels::kMoved == SGRT_TOF_MOVED && kernels::kFlying == SGRT_TOF_FLYING &&
              kernels::kWrapped == SGRT_TOF_WRAPPED && kernels::kOutOfRange == SGRT_TOF_OUT_OF_RANGE &&
              kernels::kUncalibrated == SGRT_TOF_UNCALIBRATED);

std::vector<float> offsets_of(const sgrt_view& view, const Camera& camera) {
  if (absent(&view)) return {};
  check_view(&view, "pixel_offset_mm", Kind::kReal, {camera.height, camera.width});
  std::vector<double> values(static_cast<std::size_t>(camera.height) * static_cast<std::size_t>(camera.width));
  read_view(view, values.data());
  return {values.begin(), values.end()};
}

std::shared_ptr<TofSensor> sensor_of(const Run& run, const sgrt_rig* rig, const char* tof_id,
                                     const sgrt_tof_options* options) {
  need(rig, "rig");
  need(tof_id, "tof_id");
  const int unit = tof_index(rig->rig, tof_id);
  const sgrt_tof_options c = read_struct(options, to_c(TofOptions{}), "options.struct_size");
  const Camera& camera =
      rig->rig.cameras[static_cast<std::size_t>(rig->rig.tofs[static_cast<std::size_t>(unit)].camera)];
  return std::make_shared<TofSensor>(run, rig->rig, unit, from_c(c), offsets_of(c.pixel_offset_mm, camera));
}

sgrt_tof_info summary_of(const TofResult& r) {
  sgrt_tof_info info{};
  info.width = r.width;
  info.height = r.height;
  info.frequency_count = r.frequencies;
  info.point_count = r.point_count;
  std::copy(r.flag_count.begin(), r.flag_count.end(), info.flag_count);
  info.range_min_mm = r.range_min;
  info.range_max_mm = r.range_max;
  info.ambiguity_mm = r.ambiguity;
  info.median_sigma_mm = r.median_sigma;
  return info;
}

// A plane, or as many as there are: planes x H x W.
sgrt_view lend_planes(const TofResult& r, const Planes& planes, bool all) {
  if (planes.count() == 0) return {};
  if (!all) return lend(planes.plane(0), SGRT_F32, {r.height, r.width});
  sgrt_view view = lend(planes.plane(0), SGRT_F32, {planes.count(), r.height, r.width});
  view.strides[0] = planes.stride() * static_cast<std::int64_t>(sizeof(float));
  return view;
}

sgrt_view array_of(const TofResult& r, std::int32_t field) {
  switch (field) {
    case SGRT_TOF_PHASE:
      return lend_planes(r, r.phase, true);
    case SGRT_TOF_AMPLITUDE:
      return lend_planes(r, r.amplitude, true);
    case SGRT_TOF_OFFSET:
      return lend_planes(r, r.offset, true);
    case SGRT_TOF_RANGE:
      return lend_planes(r, r.range, false);
    case SGRT_TOF_SIGMA:
      return lend_planes(r, r.sigma, false);
    case SGRT_TOF_FLAGS:
      return lend(r.flags.data(), SGRT_U8, {r.height, r.width});
    case SGRT_TOF_SCORE:
      return lend_planes(r, r.score, false);
    case SGRT_TOF_POINTS: {
      sgrt_view view = lend(r.points.plane(0), SGRT_F32, {r.height, r.width, 3});
      view.strides[0] = r.width * static_cast<std::int64_t>(sizeof(float));
      view.strides[1] = sizeof(float);
      view.strides[2] = r.points.stride() * static_cast<std::int64_t>(sizeof(float));
      return view;
    }
    case SGRT_TOF_FRAMES:
      return lend_planes(r, r.frames, false);
    default:
      refuse("field", std::to_string(field), "SGRT_TOF_PHASE (1) to SGRT_TOF_FRAMES (9)");
  }
}

}  // namespace

sgrt_tof_options to_c(const TofOptions& o) {
  sgrt_tof_options c{};
  c.struct_size = sizeof c;
  c.chapter_c = o.chapter_c ? 1 : 0;
  c.range_min_mm = o.range_min;
  c.range_max_mm = o.range_max;
  c.saturation = o.saturation;
  c.min_amplitude = o.min_amplitude;
  c.max_phase_sigma_rad = o.max_phase_sigma;
  c.max_sigma_mm = o.max_sigma;
  c.moved_tolerance = o.moved_tolerance;
  c.max_incidence_deg = o.max_incidence_deg;
  c.min_unwrap_score = o.min_unwrap_score;
  c.unwrap_tolerance_mm = o.unwrap_tolerance;
  c.normal_window_px = o.normal_window;
  return c;
}

// The sensor checks the values.
TofOptions from_c(const sgrt_tof_options& c) {
  check_range(c.chapter_c, 0, 1, "chapter_c");
  check_reserved(c.reserved, "reserved");
  TofOptions o;
  o.chapter_c = c.chapter_c != 0;
  o.range_min = c.range_min_mm;
  o.range_max = c.range_max_mm;
  o.saturation = c.saturation;
  o.min_amplitude = c.min_amplitude;
  o.max_phase_sigma = c.max_phase_sigma_rad;
  o.max_sigma = c.max_sigma_mm;
  o.moved_tolerance = c.moved_tolerance;
  o.max_incidence_deg = c.max_incidence_deg;
  o.min_unwrap_score = c.min_unwrap_score;
  o.unwrap_tolerance = c.unwrap_tolerance_mm;
  o.normal_window = c.normal_window_px;
  return o;
}

TapsView taps_of(const sgrt_view* view, const char* name) {
  need(view, name);
  if (view->ndim == 4) {
    check_view(view, name, Kind::kTaps, {kAny, kAny, kAny, kAny});
  } else {
    check_view(view, name, Kind::kTaps, {kAny, kAny, kAny, kAny, kAny});
  }
  TapsView taps;
  taps.data = view->data;
  taps.type = view->dtype == SGRT_U16   ? TapsView::Type::kU16
              : view->dtype == SGRT_I16 ? TapsView::Type::kI16
                                        : TapsView::Type::kF32;
  const int first = 5 - view->ndim;
  taps.shape[0] = 1;
  for (int i = 0; i < view->ndim; ++i) {
    taps.shape[static_cast<std::size_t>(first + i)] = view->shape[i];
    taps.strides[static_cast<std::size_t>(first + i)] = view->strides[i];
  }
  return taps;
}

}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_tof_options_init(sgrt_tof_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(TofOptions{}), "options"); });
}

sgrt_status sgrt_tof_measure(sgrt_context* context, const sgrt_rig* rig, const char* tof_id, const sgrt_view* taps,
                             const sgrt_tof_options* options, sgrt_tof** result) {
  return guard([&] {
    need(result, "result");
    const TapsView t = taps_of(taps, "taps");
    const Run run = run_of(context);
    const std::shared_ptr<TofSensor> sensor = sensor_of(run, rig, tof_id, options);
    auto handle = std::make_unique<sgrt_tof>();
    handle->result = sensor->measure(run, t);
    handle->sensor = sensor;
    *result = handle.release();
    return answer((*result)->result->status, (*result)->result->message.c_str());
  });
}

void sgrt_tof_free(sgrt_tof* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_tof_summary(const sgrt_tof* result, sgrt_tof_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, summary_of(*result->result));
  });
}

sgrt_status sgrt_tof_array(const sgrt_tof* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    *view = array_of(*result->result, field);
  });
}

sgrt_status sgrt_tof_surface(sgrt_context* context, const sgrt_tof* result, sgrt_surface** surface) {
  return guard([&] {
    need(result, "result");
    need(surface, "surface");
    if (result->result->point_count == 0) fail(Status::kNotFound, "result: it has no point");
    *surface = handle_of(result->sensor->surface(run_of(context), *result->result)).release();
  });
}

sgrt_status sgrt_tof_session_create(sgrt_context* context, const sgrt_rig* rig, const char* tof_id,
                                    const sgrt_tof_options* options, sgrt_tof_session** session) {
  return guard([&] {
    need(session, "session");
    *session = new sgrt_tof_session{
        sensor_of(run_of(context), rig, tof_id, options), -std::numeric_limits<double>::infinity(), {}};
  });
}

sgrt_status sgrt_tof_session_push(sgrt_context* context, sgrt_tof_session* session, const sgrt_view* taps,
                                  double time_s, const sgrt_tof** result) {
  return guard([&] {
    need(result, "result");
    *result = nullptr;  // nothing is lent after an error
    need(session, "session");
    const TapsView t = taps_of(taps, "taps");
    check_finite(&time_s, 1, "time_s");
    if (time_s < session->time_s)
      refuse("time_s", text_of(time_s), "at least that of the push before, " + text_of(session->time_s));
    const Run run = run_of(context);
    session->lent.result.reset();  // so that the sensor can use its memory again
    session->lent.result = session->sensor->measure(run, t);
    session->lent.sensor = session->sensor;
    session->time_s = time_s;
    *result = &session->lent;
    return answer(session->lent.result->status, session->lent.result->message.c_str());
  });
}

sgrt_status sgrt_tof_keep(const sgrt_tof* lent, sgrt_tof** result) {
  return guard([&] {
    need(lent, "lent");
    need(result, "result");
    *result = new sgrt_tof(*lent);
  });
}

void sgrt_tof_session_free(sgrt_tof_session* session) {
  guard([&] { delete session; });
}
