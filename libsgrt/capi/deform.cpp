// Registration of a body that is not rigid.
#include "registration/deform.hpp"

#include <algorithm>

#include "capi/capi.hpp"
#include "capi/motion.hpp"

namespace sgrt {
namespace {

static_assert(static_cast<int>(DeformMode::kRigid) == SGRT_DEFORM_RIGID &&
              static_cast<int>(DeformMode::kSimilarity) == SGRT_DEFORM_SIMILARITY &&
              static_cast<int>(DeformMode::kField) == SGRT_DEFORM_FIELD);

sgrt_deform_options deform_defaults() {
  const DeformOptions o;
  sgrt_deform_options c{};
  c.struct_size = sizeof c;
  c.mode = static_cast<std::int32_t>(o.mode);
  c.min_rigid_share = o.min_rigid_share;
  c.max_structure_mm = o.max_structure;
  c.max_rivalry = o.max_rivalry;
  c.stiffness = o.stiffness;
  return c;
}

DeformOptions from_c(const sgrt_deform_options& c, const IcpOptions& icp) {
  DeformOptions o;
  check_range(c.mode, SGRT_DEFORM_RIGID, SGRT_DEFORM_FIELD, "options.mode");
  check_range(c.min_rigid_share, 0, 1, "options.min_rigid_share");
  check_range(c.max_structure_mm, 0, kMaxCoordinate, "options.max_structure_mm");
  check_range(c.max_rivalry, 0, 1, "options.max_rivalry");
  check_range(c.stiffness, 1e-6, 1e6, "options.stiffness");
  o.mode = static_cast<DeformMode>(c.mode);
  o.min_rigid_share = c.min_rigid_share;
  o.max_structure = c.max_structure_mm;
  o.max_rivalry = c.max_rivalry;
  o.stiffness = c.stiffness;
  o.icp = icp;
  return o;
}

sgrt_deform_info summary_of(const DeformResult& d) {
  const IcpResult& r = d.icp;
  sgrt_deform_info info{};
  info.status = static_cast<sgrt_status>(r.status);
  info.verdict = static_cast<std::int32_t>(r.verdict);
  info.free_count = static_cast<std::int32_t>(std::min<std::size_t>(r.free.size(), 6));
  Eigen::Map<Vec3>(info.isocentre_mm) = r.isocentre;
  write_motion(r, info);
  info.rms_mm = r.rms;
  info.inlier_share = r.inlier_share;
  info.rigid_share = d.rigid_share;
  info.structure_mm = d.structure;
  info.runner_up_share = d.runner_up_share;
  info.runner_up_distance_mm = d.runner_up_distance;
  info.runner_up_rivalry = d.runner_up_rivalry;
  info.scale = d.scale;
  info.scale_sigma = d.scale_sigma;
  info.deformation_rms_mm = d.deformation_rms;
  info.deformation_max_mm = d.deformation_max;
  return info;
}

sgrt_view array_of(const DeformResult& d, std::int32_t field) {
  const std::int64_t h = d.icp.live_height, w = d.icp.live_width, n = d.deformation.rows();
  const auto beside = [&](const void* data, std::int32_t dtype, std::int64_t size) {
    if (size == 0) return sgrt_view{};
    return h > 0 ? lend(data, dtype, {h, w}) : lend(data, dtype, {size});
  };
  switch (field) {
    case SGRT_DEFORM_PART:
      return beside(d.rigid.data(), SGRT_U8, static_cast<std::int64_t>(d.rigid.size()));
    case SGRT_DEFORM_DISTANCE:
      return beside(d.icp.distance.data(), SGRT_F64, d.icp.distance.size());
    case SGRT_DEFORM_MAP:
      if (n == 0) return {};
      return h > 0 ? lend(d.deformation.data(), SGRT_F64, {h, w, 3}) : lend(d.deformation.data(), SGRT_F64, {n, 3});
    default:
      refuse("field", std::to_string(field), "SGRT_DEFORM_PART (1) to SGRT_DEFORM_MAP (3)");
  }
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_deform_options_init(sgrt_deform_options* options, size_t size) {
  return guard([&] { init_struct(options, size, deform_defaults(), "options"); });
}

sgrt_status sgrt_deform_align(sgrt_context* context, const sgrt_surface* reference, const sgrt_surface* live,
                              const double isocentre_mm[3], const sgrt_roi* roi,
                              const double initial_reference_from_live[16], const sgrt_deform_options* options,
                              const sgrt_icp_options* icp_options, sgrt_deform** result) {
  return guard([&] {
    need(reference, "reference");
    need(live, "live");
    need(result, "result");
    const Vec3 isocentre = place(isocentre_mm, "isocentre_mm");
    const Pose initial = start(initial_reference_from_live);
    const IcpOptions icp = from_c(read_struct(icp_options, to_c(IcpOptions{}), "icp_options.struct_size"));
    const DeformOptions o = from_c(read_struct(options, deform_defaults(), "options.struct_size"), icp);
    auto handle = std::make_unique<sgrt_deform>();
    handle->result = deform_align(run_of(context), *reference->surface, *live->surface, isocentre,
                                  roi ? &roi->roi : nullptr, initial, o);
    *result = handle.release();
    return answer((*result)->result.icp.status, (*result)->result.icp.message.c_str());
  });
}

void sgrt_deform_free(sgrt_deform* result) {
  guard([&] { delete result; });
}

sgrt_status sgrt_deform_summary(const sgrt_deform* result, sgrt_deform_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, summary_of(result->result));
  });
}

sgrt_status sgrt_deform_array(const sgrt_deform* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    *view = array_of(result->result, field);
  });
}

const char* sgrt_deform_text(const sgrt_deform* result, int32_t field, int32_t index) {
  return guard_text([&]() -> const char* {
    if (!result) return nullptr;
    const IcpResult& r = result->result.icp;
    switch (field) {
      case SGRT_DEFORM_VERDICT:
        return index == 0 ? r.verdict_words.c_str() : nullptr;
      case SGRT_DEFORM_WORDS:
        return index >= 0 && static_cast<std::size_t>(index) < r.free.size() ? r.free[index].words.c_str() : nullptr;
      default:
        return nullptr;
    }
  });
}
