// Coarse registration of landmarks.
#include "capi/capi.hpp"
#include "capi/motion.hpp"

namespace sgrt {
namespace {

sgrt_coarse_options coarse_defaults() {
  const LandmarkOptions o;
  sgrt_coarse_options c{};
  c.struct_size = sizeof c;
  c.sigma_mm = o.sigma;
  c.min_share = o.min_share;
  c.weak_sigma_mm = o.weak_sigma;
  c.degenerate_sigma_mm = o.degenerate_sigma;
  return c;
}

LandmarkOptions from_c(const sgrt_coarse_options& c) {
  check_reserved(c.reserved, "options.reserved");
  check_positive(c.sigma_mm, kMaxCoordinate, "options.sigma_mm");
  check_range(c.min_share, 0, 1, "options.min_share");
  check_positive(c.weak_sigma_mm, kMaxCoordinate, "options.weak_sigma_mm");
  check_positive(c.degenerate_sigma_mm, kMaxCoordinate, "options.degenerate_sigma_mm");
  return {c.sigma_mm, c.min_share, c.weak_sigma_mm, c.degenerate_sigma_mm};
}

// The names of the three views of one side, for messages.
struct Names {
  const char *position, *ids, *covariance;
};

LandmarkSet landmarks_of(const sgrt_view* position, const sgrt_view* ids, const sgrt_view* covariance,
                         const Names& names) {
  check_view(position, names.position, Kind::kReal, {kAny, 3});
  const std::int64_t n = position->shape[0];
  check_limit(n, 10'000, names.position);
  check_view(ids, names.ids, Kind::kIndex, {n});
  if (!absent(covariance)) check_view(covariance, names.covariance, Kind::kReal, {n, 3, 3});
  LandmarkSet out;
  out.position.resize(n, 3);
  if (n == 0) return out;
  read_view(*position, out.position.data());
  check_place(out.position.data(), static_cast<int>(3 * n), names.position);
  out.id.resize(static_cast<std::size_t>(n));
  read_view(*ids, out.id.data());
  if (absent(covariance)) return out;
  out.covariance.resize(static_cast<std::size_t>(n));
  read_view(*covariance, out.covariance[0].data());
  return out;
}

sgrt_coarse_info summary_of(const LandmarkFit& f) {
  sgrt_coarse_info info{};
  info.status = static_cast<sgrt_status>(f.status);
  info.verdict = static_cast<std::int32_t>(f.verdict);
  info.common_count = static_cast<std::int32_t>(f.common);
  info.used_count = static_cast<std::int32_t>(f.used);
  info.runner_up_count = static_cast<std::int32_t>(f.runner_up);
  Eigen::Map<Vec3>(info.isocentre_mm) = f.isocentre;
  write_motion(f, info);
  info.rms_mm = f.rms;
  info.chi2 = f.chi2;
  return info;
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_coarse_options_init(sgrt_coarse_options* options, size_t size) {
  return guard([&] { init_struct(options, size, coarse_defaults(), "options"); });
}

sgrt_status sgrt_coarse_align(sgrt_context* context, const sgrt_view* reference_mm, const sgrt_view* reference_ids,
                              const sgrt_view* reference_covariance_mm2, const sgrt_view* live_mm,
                              const sgrt_view* live_ids, const sgrt_view* live_covariance_mm2,
                              const double isocentre_mm[3], const sgrt_coarse_options* options, sgrt_coarse** result) {
  return guard([&] {
    need(result, "result");
    const LandmarkSet reference = landmarks_of(reference_mm, reference_ids, reference_covariance_mm2,
                                               {"reference_mm", "reference_ids", "reference_covariance_mm2"});
    const LandmarkSet live =
        landmarks_of(live_mm, live_ids, live_covariance_mm2, {"live_mm", "live_ids", "live_covariance_mm2"});
    const Vec3 isocentre = place(isocentre_mm, "isocentre_mm");
    const LandmarkOptions o = from_c(read_struct(options, coarse_defaults(), "options.struct_size"));
    auto handle = std::make_unique<sgrt_coarse>();
    handle->fit = fit_landmarks(run_of(context), reference, live, isocentre, o);
    *result = handle.release();
    return answer((*result)->fit.status, (*result)->fit.message.c_str());
  });
}

void sgrt_coarse_free(sgrt_coarse* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_coarse_summary(const sgrt_coarse* result, sgrt_coarse_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, summary_of(result->fit));
  });
}

sgrt_status sgrt_coarse_array(const sgrt_coarse* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    const LandmarkFit& f = result->fit;
    switch (field) {
      case SGRT_COARSE_DISTANCE:
        *view = lend(f.distance.data(), SGRT_F64, {f.distance.size()});
        break;
      case SGRT_COARSE_INLIER:
        *view = lend(f.inlier.data(), SGRT_U8, {static_cast<std::int64_t>(f.inlier.size())});
        break;
      default:
        refuse("field", std::to_string(field), "SGRT_COARSE_DISTANCE (1) or SGRT_COARSE_INLIER (2)");
    }
  });
}

const char* sgrt_coarse_text(const sgrt_coarse* result, int32_t field) {
  return guard_text(
      [&] { return result && field == SGRT_COARSE_VERDICT ? result->fit.verdict_words.c_str() : nullptr; });
}
