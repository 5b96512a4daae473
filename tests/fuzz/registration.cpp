// Registration of arbitrary floats: whatever the surfaces, the region, the first guess and the options are, an answer
// is a rigid motion with a finite covariance, and no answer is NaN.
#include "fuzz.hpp"

namespace {

struct Scene {
  sgrt_surface *reference, *live;
  sgrt_roi* roi;
  double isocentre[3], initial[16];
  bool has_initial;
};

sgrt_icp_options icp_options(fuzz::Bytes& bytes) {
  auto o = fuzz::defaults(sgrt_icp_options_init);
  if (bytes.below(2) == 0) return o;
  o.residual = bytes.below(4);
  o.kernel = bytes.below(4);
  o.max_iterations = 1 + bytes.below(40);
  double* const all[] = {&o.max_distance_mm, &o.max_angle_deg, &o.min_inlier_share,   &o.step_tolerance_mm,
                         &o.weak_sigma_mm,   &o.keep_share,    &o.degenerate_sigma_mm};
  if (bytes.below(4) == 0) *all[bytes.below(7)] = bytes.number();
  return o;
}

void check_icp(sgrt_status status, sgrt_icp* result) {
  fuzz::checked(status);
  fuzz::require((status == SGRT_OK || (status >= 10 && status < 20)) == (result != nullptr),
                "a result for SGRT_OK and 10-19");
  if (result == nullptr) return;
  sgrt_icp_info info;
  info.struct_size = sizeof info;
  fuzz::require(fuzz::ok(sgrt_icp_summary(result, &info)), "a summary");
  fuzz::require(info.status == status && (status == SGRT_OK) == (info.verdict != SGRT_VERDICT_NONE),
                "status and verdict agree");
  if (status == SGRT_OK) {
    fuzz::require(fuzz::rigid(info.reference_from_live), "a pose is a rigid motion");
    for (int i = 0; i < 3; ++i) fuzz::require(info.sigma_mm[i] > 0 && info.sigma_deg[i] > 0, "a pose has its sigma");
    for (double c : info.covariance) fuzz::require(std::isfinite(c), "a pose has its covariance");
    fuzz::require(std::isfinite(info.displacement.mag_mm) && std::isfinite(info.correction.mag_mm),
                  "and its six numbers");
  } else {
    fuzz::require(fuzz::all_nan(info.reference_from_live, 16), "no pose is NaN");
    fuzz::require(std::isnan(info.displacement.lat_mm) && std::isnan(info.correction.rtn_deg), "no shift is NaN");
  }
  for (int i = 0; i < info.free_count; ++i)
    fuzz::require(sgrt_icp_text(result, SGRT_ICP_WORDS, i) != nullptr, "free motions in words");
  sgrt_icp_free(result);
}

void deform(fuzz::Bytes& bytes, const Scene& s) {
  auto options = fuzz::defaults(sgrt_deform_options_init);
  options.mode = bytes.below(3);
  sgrt_deform* result = nullptr;
  const sgrt_status status =
      fuzz::checked(sgrt_deform_align(nullptr, s.reference, s.live, s.isocentre, s.roi,
                                      s.has_initial ? s.initial : nullptr, &options, nullptr, &result));
  fuzz::require((status == SGRT_OK || (status >= 10 && status < 20)) == (result != nullptr),
                "a result for SGRT_OK and 10-19");
  if (result == nullptr) return;
  sgrt_deform_info info;
  info.struct_size = sizeof info;
  fuzz::require(fuzz::ok(sgrt_deform_summary(result, &info)), "a summary");
  if (status == SGRT_OK) fuzz::require(fuzz::rigid(info.reference_from_live), "a pose is a rigid motion");
  if (status != SGRT_OK) fuzz::require(std::isnan(info.displacement.lat_mm), "no shift is NaN");
  sgrt_deform_free(result);
}

void register_surfaces(fuzz::Bytes& bytes, const Scene& s) {
  const int way = bytes.below(8);
  if (way == 7) return deform(bytes, s);
  sgrt_icp* result = nullptr;
  const sgrt_icp_options options = icp_options(bytes);
  if (way < 4) {
    const sgrt_status status = sgrt_icp_align(nullptr, s.reference, s.live, s.isocentre, s.roi,
                                              s.has_initial ? s.initial : nullptr, &options, &result);
    return check_icp(status, result);
  }
  sgrt_reference* prepared = nullptr;
  if (!fuzz::ok(sgrt_reference_create(nullptr, s.reference, s.roi, &prepared))) return;
  const sgrt_status status = sgrt_reference_align(nullptr, prepared, s.live, s.isocentre,
                                                  s.has_initial ? s.initial : nullptr, &options, &result);
  check_icp(status, result);
  sgrt_icp* promised = nullptr;
  fuzz::checked(sgrt_reference_predict(nullptr, prepared, s.isocentre, way == 4 ? bytes.number() : 0.3, &promised));
  sgrt_icp_free(promised);
  sgrt_reference_free(prepared);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes{data, size};
  const int rows = 1 + bytes.below(14), columns = 1 + bytes.below(14);
  Scene s{};
  s.has_initial = bytes.below(2) == 1;
  const double small = s.has_initial ? 0.02 : 0;
  const double start[16] = {1, -small, 0, 1, small, 1, 0, -2, 0, 0, 1, 0.5, 0, 0, 0, 1};
  std::memcpy(s.initial, start, sizeof start);
  s.initial[0] = s.initial[5] = std::sqrt(1 - small * small);
  if (bytes.below(8) == 7) s.initial[bytes.below(16)] = bytes.number();
  for (double& c : s.isocentre) c = bytes.below(4) == 3 ? bytes.number() : 0;
  if (bytes.below(4) == 3) {
    const double low[3] = {-20, bytes.number(), -1e3}, high[3] = {bytes.number(), 30, 1e3};
    fuzz::checked(sgrt_roi_from_box(low, high, &s.roi));
  }
  const int changes = bytes.below(4) * bytes.below(24);
  const std::vector<double> reference = fuzz::patch(bytes, rows, columns, changes / 2);
  s.reference = fuzz::surface(bytes, reference, rows, columns);
  const int live_rows = bytes.below(3) == 0 ? 1 + bytes.below(14) : rows;
  s.live = fuzz::surface(bytes, fuzz::patch(bytes, live_rows, columns, changes), live_rows, columns);
  if (s.reference != nullptr && s.live != nullptr) register_surfaces(bytes, s);
  sgrt_surface_free(s.reference);
  sgrt_surface_free(s.live);
  sgrt_roi_free(s.roi);
  return 0;
}
