// Speckle stereo: one pair of images, or a session of them.
#include "stereo/stereo.hpp"

#include <algorithm>
#include <limits>

#include "capi/capi.hpp"
#include "stereo/prior.hpp"

namespace sgrt {
namespace {

static_assert(static_cast<int>(Reason::kNone) == SGRT_REASON_NONE &&
              static_cast<int>(Reason::kOutOfView) == SGRT_REASON_OUT_OF_VIEW &&
              static_cast<int>(Reason::kOutOfVolume) == SGRT_REASON_OUT_OF_VOLUME &&
              static_cast<int>(Reason::kNoTexture) == SGRT_REASON_NO_TEXTURE &&
              static_cast<int>(Reason::kSaturated) == SGRT_REASON_SATURATED &&
              static_cast<int>(Reason::kNoMatch) == SGRT_REASON_NO_MATCH &&
              static_cast<int>(Reason::kLeftRight) == SGRT_REASON_LEFT_RIGHT &&
              static_cast<int>(Reason::kAmbiguous) == SGRT_REASON_AMBIGUOUS &&
              static_cast<int>(Reason::kEdge) == SGRT_REASON_EDGE &&
              static_cast<int>(Reason::kMoved) == SGRT_REASON_MOVED &&
              static_cast<int>(Reason::kOccluded) == SGRT_REASON_OCCLUDED &&
              static_cast<int>(Reason::kCount) == SGRT_REASON_COUNT);

sgrt_stereo_options to_c(const StereoOptions& o) {
  sgrt_stereo_options c{};
  c.struct_size = sizeof c;
  c.window_px = o.window;
  c.stride_px = o.stride;
  c.min_component = o.min_component;
  Eigen::Map<Vec3>(c.volume_min_mm) = o.volume_min;
  Eigen::Map<Vec3>(c.volume_max_mm) = o.volume_max;
  c.min_correlation = o.min_correlation;
  c.max_left_right_px = o.max_left_right;
  c.max_sigma_px = o.max_sigma;
  c.max_epipolar_px = o.max_epipolar;
  return c;
}

// The matcher checks the values.
StereoOptions from_c(const sgrt_stereo_options& c) {
  StereoOptions o;
  o.window = c.window_px;
  o.stride = c.stride_px;
  o.min_component = c.min_component;
  o.volume_min = Eigen::Map<const Vec3>(c.volume_min_mm);
  o.volume_max = Eigen::Map<const Vec3>(c.volume_max_mm);
  o.min_correlation = c.min_correlation;
  o.max_left_right = c.max_left_right_px;
  o.max_sigma = c.max_sigma_px;
  o.max_epipolar = c.max_epipolar_px;
  return o;
}

sgrt_stereo_prior_options to_c(const PriorOptions& o) {
  return {sizeof(sgrt_stereo_prior_options), o.follow ? 1 : 0, o.band};
}

const StereoPair& pair_from(const sgrt_rig* rig, const char* pair_id) {
  need(rig, "rig");
  need(pair_id, "pair_id");
  return pair_of(rig->rig, pair_id);
}

sgrt_stereo_info summary_of(const StereoResult& r) {
  sgrt_stereo_info info{};
  static_assert(std::tuple_size_v<decltype(r.reason_count)> <= std::size(info.reason_count));
  info.width = r.width;
  info.height = r.height;
  info.point_count = r.point_count;
  std::copy(r.reason_count.begin(), r.reason_count.end(), info.reason_count);
  info.noise_left = r.noise_left;
  info.median_sigma_px = r.median_sigma_px;
  info.median_sigma_mm = r.median_sigma_mm;
  info.epipolar_px = r.epipolar_px;
  info.epipolar_sigma_px = r.epipolar_sigma_px;
  info.epipolar_rms_px = r.epipolar_rms_px;
  info.epipolar_count = r.epipolar_count;
  info.out_of_calibration = r.out_of_calibration ? 1 : 0;
  return info;
}

sgrt_view array_of(const StereoResult& r, std::int32_t field) {
  const auto grid = [&r](const auto& v, std::int32_t dtype) {
    return v.empty() ? sgrt_view{} : lend(v.data(), dtype, {r.height, r.width});
  };
  const auto pixels = [&r](const std::vector<double>& v) {
    return v.empty() ? sgrt_view{} : lend(v.data(), SGRT_F64, {r.height, r.width, 2});
  };
  switch (field) {
    case SGRT_STEREO_REASON:
      return grid(r.reason, SGRT_U8);
    case SGRT_STEREO_CORRELATION:
      return grid(r.correlation, SGRT_F32);
    case SGRT_STEREO_SIGMA_PX:
      return grid(r.sigma_px, SGRT_F32);
    case SGRT_STEREO_LEFT_PX:
      return pixels(r.left_px);
    case SGRT_STEREO_RIGHT_PX:
      return pixels(r.right_px);
    default:
      refuse("field", std::to_string(field), "SGRT_STEREO_REASON (1) to SGRT_STEREO_RIGHT_PX (5)");
  }
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_stereo_options_init(sgrt_stereo_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(StereoOptions{}), "options"); });
}

sgrt_status sgrt_stereo_match(sgrt_context* context, const sgrt_rig* rig, const char* pair_id, const sgrt_view* left,
                              const sgrt_view* right, const sgrt_stereo_options* options, sgrt_stereo** result) {
  return guard([&] {
    need(result, "result");
    const StereoPair& pair = pair_from(rig, pair_id);
    const ImageView l = image_of(left, "left");
    const ImageView r = image_of(right, "right");
    const StereoOptions o = from_c(read_struct(options, to_c(StereoOptions{}), "options.struct_size"));
    const Run run = run_of(context);
    auto handle = std::make_unique<sgrt_stereo>();
    handle->result = StereoMatcher(run, rig->rig, pair, o).match(run, l, r);
    *result = handle.release();
    return answer((*result)->result->status, (*result)->result->message.c_str());
  });
}

void sgrt_stereo_free(sgrt_stereo* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_stereo_summary(const sgrt_stereo* result, sgrt_stereo_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, summary_of(*result->result));
  });
}

sgrt_status sgrt_stereo_array(const sgrt_stereo* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    *view = array_of(*result->result, field);
  });
}

sgrt_status sgrt_stereo_surface(const sgrt_stereo* result, sgrt_surface** surface) {
  return guard([&] {
    need(result, "result");
    need(surface, "surface");
    if (!result->result->surface) fail(Status::kNotFound, "result: it has no surface");
    *surface = handle_of(result->result->surface).release();
  });
}

sgrt_status sgrt_stereo_session_create(sgrt_context* context, const sgrt_rig* rig, const char* pair_id,
                                       const sgrt_stereo_options* options, sgrt_stereo_session** session) {
  return guard([&] {
    need(session, "session");
    const StereoPair& pair = pair_from(rig, pair_id);
    const StereoOptions o = from_c(read_struct(options, to_c(StereoOptions{}), "options.struct_size"));
    *session = new sgrt_stereo_session{
        StereoMatcher(run_of(context), rig->rig, pair, o), -std::numeric_limits<double>::infinity(), {}};
  });
}

sgrt_status sgrt_stereo_session_push(sgrt_context* context, sgrt_stereo_session* session, const sgrt_view* left,
                                     const sgrt_view* right, double time_s, const sgrt_stereo** result) {
  return guard([&] {
    need(result, "result");
    *result = nullptr;  // nothing is lent after an error
    need(session, "session");
    const ImageView l = image_of(left, "left");
    const ImageView r = image_of(right, "right");
    check_finite(&time_s, 1, "time_s");
    if (time_s < session->time_s)
      refuse("time_s", text_of(time_s), "at least that of the push before, " + text_of(session->time_s));
    const Run run = run_of(context);
    session->lent.result.reset();  // so that the matcher can use its memory again
    session->lent.result = session->matcher.match(run, l, r);
    session->time_s = time_s;
    *result = &session->lent;
    return answer(session->lent.result->status, session->lent.result->message.c_str());
  });
}

void sgrt_stereo_session_free(sgrt_stereo_session* session) {
  guard([&] { delete session; });
}

sgrt_status sgrt_stereo_prior_options_init(sgrt_stereo_prior_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(PriorOptions{}), "options"); });
}

sgrt_status sgrt_stereo_session_set_prior(sgrt_context* context, sgrt_stereo_session* session,
                                          const sgrt_surface* prior, const sgrt_roi* roi,
                                          const sgrt_stereo_prior_options* options) {
  return guard([&] {
    need(session, "session");
    const auto c = read_struct(options, to_c(PriorOptions{}), "options.struct_size");
    if (c.follow != 0 && c.follow != 1) refuse("follow", std::to_string(c.follow), "0 or 1");
    if (!prior && roi) refuse("roi", "given without a prior", "NULL: it says which part of the prior counts");
    session->matcher.set_prior(run_of(context), prior ? prior->surface.get() : nullptr, roi ? &roi->roi : nullptr,
                               {c.band_mm, c.follow == 1});
  });
}
