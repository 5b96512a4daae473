// The sweep of a laser fan: whole, or frame by frame; its light plane; breathing from one stripe.
#include "capi/laser.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace sgrt {
namespace {

sgrt_laser_options default_options() {
  const LaserOptions o;
  sgrt_laser_options c{};
  c.struct_size = sizeof c;
  c.angle_sigma_rad = o.angle_sigma;
  Eigen::Map<Vec3>(c.volume_min_mm) = o.volume_min;
  Eigen::Map<Vec3>(c.volume_max_mm) = o.volume_max;
  c.reference_time_s = std::nan("");
  return c;
}

struct Options {
  LaserOptions laser;
  double reference_time;
};
Options from_c(const sgrt_stripe_options* stripe, const sgrt_laser_options* given) {
  const sgrt_laser_options c = read_struct(given, default_options(), "options.struct_size");
  check_reserved(c.reserved, "options.reserved");
  Options o{{}, c.reference_time_s};
  o.laser.stripe = stripe_options_from_c(stripe);
  o.laser.angle_sigma = c.angle_sigma_rad;
  o.laser.volume_min = Eigen::Map<const Vec3>(c.volume_min_mm);
  o.laser.volume_max = Eigen::Map<const Vec3>(c.volume_max_mm);
  check_options(o.laser);
  return o;
}

LaserUnit unit_from(const sgrt_rig* rig, const char* laser_id) {
  need(rig, "rig");
  need(laser_id, "laser_id");
  return laser_of(rig->rig, laser_id);
}

std::vector<double> numbers(const sgrt_view* view, const char* name, std::int64_t count) {
  check_view(view, name, Kind::kReal, {count});
  check_limit(view->shape[0], 1'000'000, name);
  std::vector<double> values(static_cast<std::size_t>(view->shape[0]));
  read_view(*view, values.data());
  return values;
}

std::optional<PoseTrack> track_of(const sgrt_view* time_s, const sgrt_view* room_from_body) {
  if (absent(time_s) && absent(room_from_body)) return std::nullopt;
  PoseTrack track;
  track.time = numbers(time_s, "track_time_s", kAny);
  const auto n = static_cast<std::int64_t>(track.time.size());
  check_view(room_from_body, "room_from_body", Kind::kReal, {n, 4, 4});
  std::vector<double> rows(static_cast<std::size_t>(16 * n));
  read_view(*room_from_body, rows.data());
  track.room_from_body.reserve(track.time.size());
  for (std::size_t i = 0; i < track.time.size(); ++i)
    track.room_from_body.push_back(
        pose_from_rows(&rows[16 * i], ("room_from_body[" + std::to_string(i) + "]").c_str()));
  check_track(track);
  return track;
}

sgrt_status give(LaserResult&& r, sgrt_laser** result) {
  auto handle = std::make_unique<sgrt_laser>();
  handle->result = std::move(r);
  *result = handle.release();
  return answer((*result)->result.status, (*result)->result.message.c_str());
}

// Frame i of F x H x W as an image of its own.
sgrt_view frame_of(const sgrt_view& images, std::int64_t i) {
  sgrt_view v = images;
  v.data = static_cast<const char*>(images.data) + i * images.strides[0];
  v.ndim = 2;
  for (int k = 0; k < 2; ++k) v.shape[k] = images.shape[k + 1], v.strides[k] = images.strides[k + 1];
  v.shape[2] = v.strides[2] = 0;
  return v;
}

sgrt_view array_of(const LaserResult& r, std::int32_t field) {
  switch (field) {
    case SGRT_LASER_REASON:
      return lend(r.reason.data(), SGRT_U8, {r.height, r.width});
    case SGRT_LASER_STRIPE_PX:
      return lend(r.stripe_px.data(), SGRT_F64, {r.height, r.width});
    case SGRT_LASER_SIGMA_PX:
      return lend(r.sigma_px.data(), SGRT_F32, {r.height, r.width});
    case SGRT_LASER_ANGLE:
      return lend(r.angle.data(), SGRT_F64, {r.width});
    case SGRT_LASER_TIME:
      return lend(r.time.data(), SGRT_F64, {r.width});
    default:
      refuse("field", std::to_string(field), "SGRT_LASER_REASON (1) to SGRT_LASER_TIME (5)");
  }
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_laser_plane(const sgrt_rig* rig, const char* laser_id, double angle_rad, double plane[4]) {
  return guard([&] {
    need(plane, "plane");
    check_finite(&angle_rad, 1, "angle_rad");
    const LightPlane p = light_plane(unit_from(rig, laser_id), angle_rad);
    Eigen::Map<Vec3>{plane} = p.n;
    plane[3] = p.d;
  });
}

sgrt_status sgrt_laser_options_init(sgrt_laser_options* options, size_t size) {
  return guard([&] { init_struct(options, size, default_options(), "options"); });
}

sgrt_status sgrt_laser_sweep(sgrt_context* context, const sgrt_rig* rig, const char* laser_id, const sgrt_view* images,
                             const sgrt_view* dark, const sgrt_view* angle_rad, const sgrt_view* time_s,
                             const sgrt_view* track_time_s, const sgrt_view* room_from_body,
                             const sgrt_stripe_options* stripe, const sgrt_laser_options* options,
                             sgrt_laser** result) {
  return guard([&] {
    need(result, "result");
    const LaserUnit unit = unit_from(rig, laser_id);
    const Options o = from_c(stripe, options);
    check_view(images, "images", Kind::kImage, {kAny, kAny, kAny});
    const std::int64_t frames = images->shape[0];
    const std::vector<double> angles = numbers(angle_rad, "angle_rad", frames);
    const std::vector<double> times =
        absent(time_s) ? std::vector<double>(angles.size()) : numbers(time_s, "time_s", frames);
    const DarkFrame below(dark);
    const std::optional<PoseTrack> track = track_of(track_time_s, room_from_body);
    const Run run = run_of(context);
    Sweep sweep(rig->rig, unit, o.laser);
    for (std::int64_t i = 0; i < frames; ++i) {
      const sgrt_view frame = frame_of(*images, i);
      const auto k = static_cast<std::size_t>(i);
      sweep.push(run, image_of(&frame, "images"), below.get(), angles[k], times[k]);
    }
    return give(sweep.finish(run, track ? &*track : nullptr, o.reference_time), result);
  });
}

void sgrt_laser_free(sgrt_laser* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_laser_summary(const sgrt_laser* result, sgrt_laser_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    const LaserResult& r = result->result;
    sgrt_laser_info c{};
    c.width = r.width;
    c.height = r.height;
    c.columns = r.columns ? 1 : 0;
    c.point_count = r.point_count;
    std::copy(r.reason_count.begin(), r.reason_count.end(), c.reason_count);
    c.median_sigma_px = r.median_sigma_px;
    c.median_sigma_mm = r.median_sigma_mm;
    c.reference_time_s = r.reference_time;
    write_struct(info, c);
  });
}

sgrt_status sgrt_laser_array(const sgrt_laser* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    *view = array_of(result->result, field);
  });
}

sgrt_status sgrt_laser_surface(const sgrt_laser* result, sgrt_surface** surface) {
  return guard([&] {
    need(result, "result");
    need(surface, "surface");
    if (result->result.point_count == 0) fail(Status::kNotFound, "result: it has no point");
    *surface = handle_of(std::shared_ptr<const Surface>(result->result.surface)).release();
  });
}

sgrt_status sgrt_laser_session_create(sgrt_context* context, const sgrt_rig* rig, const char* laser_id,
                                      const sgrt_stripe_options* stripe, const sgrt_laser_options* options,
                                      sgrt_laser_session** session) {
  return guard([&] {
    need(session, "session");
    run_of(context);
    const LaserUnit unit = unit_from(rig, laser_id);
    const Options o = from_c(stripe, options);
    *session = new sgrt_laser_session{Sweep(rig->rig, unit, o.laser), o.reference_time};
  });
}

sgrt_status sgrt_laser_session_push(sgrt_context* context, sgrt_laser_session* session, const sgrt_view* image,
                                    const sgrt_view* dark, double angle_rad, double time_s, sgrt_laser_column* column) {
  return guard([&] {
    need(session, "session");
    check_result(column, "column.struct_size");
    const ImageView view = image_of(image, "image");
    const DarkFrame below(dark);
    const Column& pushed = session->sweep.push(run_of(context), view, below.get(), angle_rad, time_s);
    sgrt_laser_column c{};
    c.stripe_count = pushed.stripe_count;
    c.point_count = pushed.point_count;
    write_struct(column, c);
  });
}

sgrt_status sgrt_laser_session_finish(sgrt_context* context, const sgrt_laser_session* session,
                                      const sgrt_view* track_time_s, const sgrt_view* room_from_body,
                                      sgrt_laser** result) {
  return guard([&] {
    need(session, "session");
    need(result, "result");
    const std::optional<PoseTrack> track = track_of(track_time_s, room_from_body);
    return give(session->sweep.finish(run_of(context), track ? &*track : nullptr, session->reference_time), result);
  });
}

void sgrt_laser_session_free(sgrt_laser_session* session) {
  guard([&] { delete session; });
}

sgrt_status sgrt_laser_signal(sgrt_context* context, const sgrt_rig* rig, const char* laser_id, const sgrt_view* image,
                              const sgrt_view* dark, double angle_rad, const sgrt_stripe_options* stripe,
                              const double point_mm[3], const double axis[3], double radius_mm, double* signal_mm,
                              double* sigma_mm) {
  return guard([&] {
    need(signal_mm, "signal_mm");
    const LaserUnit unit = unit_from(rig, laser_id);
    const Vec3 point = place(point_mm, "point_mm");
    need(axis, "axis");
    check_finite(axis, 3, "axis");
    const Vec3 along = Eigen::Map<const Vec3>(axis);
    if (std::abs(along.norm() - 1) > 1e-3) refuse("axis", "length " + text_of(along.norm()), "1");
    check_positive(radius_mm, kMaxCoordinate, "radius_mm");
    check_finite(&angle_rad, 1, "angle_rad");
    const ImageView view = image_of(image, "image");
    const DarkFrame below(dark);
    LaserOptions o;
    o.stripe = stripe_options_from_c(stripe);
    const Camera& camera = rig->rig.cameras[static_cast<std::size_t>(unit.camera)];
    const bool across = stripe_runs_across(camera, light_plane(unit, angle_rad));
    const Column c = make_column(run_of(context), camera, unit, o, across, view, below.get(), angle_rad, 0);
    try {
      const LaserSignal s = signal_of(c, point, along.normalized(), radius_mm);
      *signal_mm = s.value;
      if (sigma_mm) *sigma_mm = s.sigma;
    } catch (const Error& error) {
      if (error.status() < Status::kInsufficientData || error.status() >= Status::kCancelled) throw;
      *signal_mm = std::nan("");
      if (sigma_mm) *sigma_mm = std::nan("");
      throw;
    }
  });
}
