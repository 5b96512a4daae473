// Fine registration.
#include "registration/icp.hpp"

#include <algorithm>

#include "capi/capi.hpp"
#include "capi/motion.hpp"

namespace sgrt {
namespace {

static_assert(static_cast<int>(Verdict::kNone) == SGRT_VERDICT_NONE &&
              static_cast<int>(Verdict::kOk) == SGRT_VERDICT_OK &&
              static_cast<int>(Verdict::kWeak) == SGRT_VERDICT_WEAK);
static_assert(static_cast<int>(Residual::kPointSvd) == SGRT_RESIDUAL_POINT_SVD &&
              static_cast<int>(Residual::kPointQuaternion) == SGRT_RESIDUAL_POINT_QUATERNION &&
              static_cast<int>(Residual::kSymmetric) == SGRT_RESIDUAL_SYMMETRIC &&
              static_cast<int>(Kernel::kNone) == SGRT_KERNEL_NONE &&
              static_cast<int>(Kernel::kTukey) == SGRT_KERNEL_TUKEY &&
              static_cast<int>(Kernel::kWelsch) == SGRT_KERNEL_WELSCH);

sgrt_icp_info summary_of(const IcpResult& r) {
  sgrt_icp_info info{};
  info.status = static_cast<sgrt_status>(r.status);
  info.verdict = static_cast<std::int32_t>(r.verdict);
  info.iterations = r.iterations;
  info.pair_count = r.pair_count;
  info.free_count = static_cast<std::int32_t>(std::min<std::size_t>(r.free.size(), 6));
  Eigen::Map<Vec3>(info.isocentre_mm) = r.isocentre;
  write_motion(r, info);
  for (int i = 0; i < info.free_count; ++i) Eigen::Map<Vec6>(info.free_motion + 6 * i) = r.free[i].motion;
  info.rms_mm = r.rms;
  info.inlier_share = r.inlier_share;
  Eigen::Map<Mat6>(info.covariance_random) = r.random.transpose();
  Eigen::Map<Mat6>(info.covariance_shared) = r.shared.transpose();
  info.chi2 = r.chi2;
  info.coarse_score = r.coarse_score;
  info.coarse_runner_up = r.coarse_runner_up;
  info.direction_count = static_cast<std::int32_t>(std::min<std::size_t>(r.directions.size(), 6));
  for (int i = 0; i < info.direction_count; ++i) {
    Eigen::Map<Vec6>(info.direction_motion + 6 * i) = r.directions[i].motion;
    info.direction_sigma_mm[i] = r.directions[i].sigma;
    info.direction_detectable_mm[i] = r.directions[i].detectable;
  }
  return info;
}

sgrt_view array_of(const IcpResult& r, std::int32_t field) {
  const auto beside = [&r](const void* data, std::int32_t dtype, std::int64_t n) {
    if (n == 0) return sgrt_view{};
    return r.live_height > 0 ? lend(data, dtype, {r.live_height, r.live_width}) : lend(data, dtype, {n});
  };
  switch (field) {
    case SGRT_ICP_DISTANCE:
      return beside(r.distance.data(), SGRT_F64, r.distance.size());
    case SGRT_ICP_INLIER:
      return beside(r.inlier.data(), SGRT_U8, static_cast<std::int64_t>(r.inlier.size()));
    default:
      refuse("field", std::to_string(field), "SGRT_ICP_DISTANCE (1) or SGRT_ICP_INLIER (2)");
  }
}

const char* text_of_icp(const IcpResult& r, std::int32_t field, std::int32_t index) {
  switch (field) {
    case SGRT_ICP_VERDICT:
      return index == 0 ? r.verdict_words.c_str() : nullptr;
    case SGRT_ICP_WORDS:
      return index >= 0 && static_cast<std::size_t>(index) < r.free.size() ? r.free[index].words.c_str() : nullptr;
    case SGRT_ICP_DIRECTION:
      return index >= 0 && static_cast<std::size_t>(index) < r.directions.size() ? r.directions[index].words.c_str()
                                                                                 : nullptr;
    default:
      return nullptr;
  }
}

}  // namespace

sgrt_icp_options to_c(const IcpOptions& o) {
  sgrt_icp_options c{};
  c.struct_size = sizeof c;
  c.max_iterations = o.max_iterations;
  c.max_distance_mm = o.max_distance;
  c.max_angle_deg = o.max_angle_deg;
  c.min_inlier_share = o.min_inlier_share;
  c.step_tolerance_mm = o.step_tolerance;
  c.weak_sigma_mm = o.weak_sigma;
  c.degenerate_sigma_mm = o.degenerate_sigma;
  c.anywhere = o.anywhere ? 1 : 0;
  c.residual = static_cast<std::int32_t>(o.residual);
  c.kernel = static_cast<std::int32_t>(o.kernel);
  c.keep_share = o.keep_share;
  return c;
}

IcpOptions from_c(const sgrt_icp_options& c) {
  IcpOptions o;
  check_range(c.max_iterations, 1, 10'000, "options.max_iterations");
  check_positive(c.max_distance_mm, kMaxCoordinate, "options.max_distance_mm");
  check_positive(c.max_angle_deg, 90, "options.max_angle_deg");
  check_range(c.min_inlier_share, 0, 1, "options.min_inlier_share");
  check_positive(c.step_tolerance_mm, kMaxCoordinate, "options.step_tolerance_mm");
  check_positive(c.weak_sigma_mm, kMaxCoordinate, "options.weak_sigma_mm");
  check_positive(c.degenerate_sigma_mm, kMaxCoordinate, "options.degenerate_sigma_mm");
  o.max_iterations = c.max_iterations;
  o.max_distance = c.max_distance_mm;
  o.max_angle_deg = c.max_angle_deg;
  o.min_inlier_share = c.min_inlier_share;
  o.step_tolerance = c.step_tolerance_mm;
  o.weak_sigma = c.weak_sigma_mm;
  o.degenerate_sigma = c.degenerate_sigma_mm;
  check_range(c.anywhere, 0, 1, "options.anywhere");
  check_reserved(c.reserved, "options.reserved");
  o.anywhere = c.anywhere != 0;
  check_range(c.residual, SGRT_RESIDUAL_PLANE, SGRT_RESIDUAL_SYMMETRIC, "options.residual");
  check_range(c.kernel, SGRT_KERNEL_AUTO, SGRT_KERNEL_WELSCH, "options.kernel");
  check_positive(c.keep_share, 1, "options.keep_share");
  o.residual = static_cast<Residual>(c.residual);
  o.kernel = static_cast<Kernel>(c.kernel);
  o.keep_share = c.keep_share;
  return o;
}

}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_icp_options_init(sgrt_icp_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(IcpOptions{}), "options"); });
}

namespace {

// The handle of a result, and its status.
sgrt_status keep(IcpResult&& found, sgrt_icp** result) {
  auto handle = std::make_unique<sgrt_icp>();
  handle->result = std::move(found);
  *result = handle.release();
  return answer((*result)->result.status, (*result)->result.message.c_str());
}

}  // namespace

sgrt_status sgrt_icp_align(sgrt_context* context, const sgrt_surface* reference, const sgrt_surface* live,
                           const double isocentre_mm[3], const sgrt_roi* roi,
                           const double initial_reference_from_live[16], const sgrt_icp_options* options,
                           sgrt_icp** result) {
  return guard([&] {
    need(reference, "reference");
    need(live, "live");
    need(result, "result");
    const Vec3 isocentre = place(isocentre_mm, "isocentre_mm");
    const Pose initial = start(initial_reference_from_live);
    const IcpOptions o = from_c(read_struct(options, to_c(IcpOptions{}), "options.struct_size"));
    return keep(
        align(run_of(context), *reference->surface, *live->surface, isocentre, roi ? &roi->roi : nullptr, initial, o),
        result);
  });
}

sgrt_status sgrt_reference_create(sgrt_context* context, const sgrt_surface* surface, const sgrt_roi* roi,
                                  sgrt_reference** reference) {
  return guard([&] {
    need(surface, "surface");
    need(reference, "reference");
    auto handle = std::make_unique<sgrt_reference>();
    handle->reference = prepare_reference(run_of(context), *surface->surface, roi ? &roi->roi : nullptr);
    *reference = handle.release();
  });
}

void sgrt_reference_free(sgrt_reference* reference) {
  guard([&] { delete reference; });
}

sgrt_status sgrt_reference_align(sgrt_context* context, const sgrt_reference* reference, const sgrt_surface* live,
                                 const double isocentre_mm[3], const double initial_reference_from_live[16],
                                 const sgrt_icp_options* options, sgrt_icp** result) {
  return guard([&] {
    need(reference, "reference");
    need(live, "live");
    need(result, "result");
    const Vec3 isocentre = place(isocentre_mm, "isocentre_mm");
    const Pose initial = start(initial_reference_from_live);
    const IcpOptions o = from_c(read_struct(options, to_c(IcpOptions{}), "options.struct_size"));
    return keep(align(run_of(context), *reference->reference, *live->surface, isocentre, initial, o), result);
  });
}

sgrt_status sgrt_reference_predict(sgrt_context* context, const sgrt_reference* reference, const double isocentre_mm[3],
                                   double live_sigma_mm, sgrt_icp** result) {
  return guard([&] {
    need(reference, "reference");
    need(result, "result");
    const Vec3 isocentre = place(isocentre_mm, "isocentre_mm");
    check_positive(live_sigma_mm, kMaxCoordinate, "live_sigma_mm");
    run_of(context);
    return keep(promise_of(*reference->reference, isocentre, live_sigma_mm), result);
  });
}

void sgrt_icp_free(sgrt_icp* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_icp_summary(const sgrt_icp* result, sgrt_icp_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, summary_of(result->result));
  });
}

sgrt_status sgrt_icp_array(const sgrt_icp* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    *view = array_of(result->result, field);
  });
}

const char* sgrt_icp_text(const sgrt_icp* result, int32_t field, int32_t index) {
  return guard_text([&] { return result ? text_of_icp(result->result, field, index) : nullptr; });
}
