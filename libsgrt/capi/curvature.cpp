// Curvature of surfaces: clouds, grids and meshes.
#include <algorithm>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "capi/outward.hpp"
#include "shape/curvature.hpp"
#include "shape/extrema.hpp"

namespace sgrt {
namespace {

static_assert(std::size(kCurvatureNumbers) == SGRT_CURVATURE_RADIUS - SGRT_CURVATURE_K1 + 1 &&
              std::size(kCurvatureVectors) == SGRT_CURVATURE_D2 - SGRT_CURVATURE_NORMALS + 1 &&
              static_cast<int>(HkClass::kMinimal) == SGRT_HK_MINIMAL &&
              static_cast<int>(CurvatureReason::kTooNoisy) == SGRT_CURVATURE_TOO_NOISY &&
              kCurvatureReasons == SGRT_CURVATURE_TOO_NOISY + 1);

constexpr const char* kReasons[kCurvatureReasons] = {"known",  "absent",   "no_normal",   "too_few",
                                                     "border", "disagree", "not_a_sheet", "too_noisy"};

sgrt_curvature_options curvature_defaults() {
  const CurvatureOptions o;
  sgrt_curvature_options c{};
  c.struct_size = sizeof c;
  c.degree = o.degree;
  c.radius_mm = o.radius;
  c.max_radius_mm = o.max_radius;
  c.noise_mm = o.noise;
  c.max_sigma_per_mm = o.max_sigma;
  return c;
}

CurvatureOptions from_c(const sgrt_curvature_options& c) {
  CurvatureOptions o;
  check_range(c.degree, 2, 4, "options.degree");
  check_range(c.radius_mm, 0, kMaxCoordinate, "options.radius_mm");
  check_positive(c.max_radius_mm, kMaxCoordinate, "options.max_radius_mm");
  check_range(c.noise_mm, 0, kMaxCoordinate, "options.noise_mm");
  check_positive(c.max_sigma_per_mm, 1e6, "options.max_sigma_per_mm");
  o.degree = c.degree;
  o.radius = c.radius_mm;
  o.max_radius = c.max_radius_mm;
  o.noise = c.noise_mm;
  o.max_sigma = c.max_sigma_per_mm;
  return o;
}

sgrt_view array_of(const CurvatureField& f, std::int32_t field) {
  const auto n = static_cast<std::int64_t>(f.reason.size());
  const auto beside = [&](const void* data, std::int32_t dtype) {
    return f.height > 0 ? lend(data, dtype, {f.height, f.width}) : lend(data, dtype, {n});
  };
  if (field >= SGRT_CURVATURE_K1 && field <= SGRT_CURVATURE_RADIUS)
    return beside((f.*kCurvatureNumbers[field - SGRT_CURVATURE_K1]).data(), SGRT_F64);
  switch (field) {
    case SGRT_CURVATURE_NORMALS:
    case SGRT_CURVATURE_D1:
    case SGRT_CURVATURE_D2: {
      const Points& p = f.*kCurvatureVectors[field - SGRT_CURVATURE_NORMALS];
      return f.height > 0 ? lend(p.data(), SGRT_F64, {f.height, f.width, 3}) : lend(p.data(), SGRT_F64, {n, 3});
    }
    case SGRT_CURVATURE_HK:
      return beside(f.hk.data(), SGRT_U8);
    case SGRT_CURVATURE_REASON:
      return beside(f.reason.data(), SGRT_U8);
    default:
      refuse("field", std::to_string(field), "SGRT_CURVATURE_K1 (1) to SGRT_CURVATURE_REASON (17)");
  }
}

// Why not one point has curvature: the reason of most.
std::string why_none(const CurvatureField& f) {
  int most = 1;
  for (int k = 1; k < kCurvatureReasons; ++k)
    if (f.count[k] > f.count[most]) most = k;
  return "not one of " + std::to_string(f.reason.size()) + " points has curvature: " + std::to_string(f.count[most]) +
         " are " + kReasons[most];
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_curvature_options_init(sgrt_curvature_options* options, size_t size) {
  return guard([&] { init_struct(options, size, curvature_defaults(), "options"); });
}

sgrt_status sgrt_curvature_compute(sgrt_context* context, const sgrt_surface* surface,
                                   const sgrt_curvature_options* options, sgrt_curvature** result) {
  return guard([&] {
    need(surface, "surface");
    need(result, "result");
    const CurvatureOptions o = from_c(read_struct(options, curvature_defaults(), "options.struct_size"));
    need_outward(*surface->surface, "surface");
    auto handle = std::make_unique<sgrt_curvature>();
    handle->field = surface_curvature(run_of(context), *surface->surface, o);
    if (handle->field.known == 0) fail(Status::kInsufficientData, why_none(handle->field));
    *result = handle.release();
  });
}

void sgrt_curvature_free(sgrt_curvature* result) {
  guard([&] { delete result; });
}

const char* sgrt_curvature_reason_word(int32_t reason) {
  return guard_text([&] { return reason >= 0 && reason < kCurvatureReasons ? kReasons[reason] : "unknown"; });
}

sgrt_status sgrt_curvature_summary(const sgrt_curvature* result, sgrt_curvature_info* info) {
  return guard([&] {
    need(result, "result");
    need(info, "info");
    check_result(info, "info.struct_size");
    const CurvatureField& f = result->field;
    sgrt_curvature_info i{};
    i.point_count = static_cast<std::int64_t>(f.reason.size());
    i.known_count = f.known;
    i.duplicate_count = f.duplicates;
    std::copy_n(f.count, kCurvatureReasons, i.reason_count);
    i.height = f.height, i.width = f.width;
    i.spacing_mm = f.spacing;
    i.noise_mm = f.noise;
    write_struct(info, i);
  });
}

sgrt_status sgrt_curvature_array(const sgrt_curvature* result, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(result, "result");
    need(view, "view");
    *view = array_of(result->field, field);
  });
}

sgrt_status sgrt_curvature_features(sgrt_context* context, const sgrt_surface* surface, const sgrt_curvature* curvature,
                                    double sigmas, const sgrt_mut_view* crest, const sgrt_mut_view* persistence) {
  return guard([&] {
    need(surface, "surface");
    need(curvature, "curvature");
    check_range(sigmas, 0, 100, "sigmas");
    const Surface& s = *surface->surface;
    const CurvatureField& f = curvature->field;
    if (static_cast<std::int64_t>(f.reason.size()) != s.size() || f.height != s.height)
      refuse("curvature", std::to_string(f.reason.size()) + " points",
             "that of the surface, which has " + std::to_string(s.size()));
    if (!absent(crest)) check_output_beside(crest, "crest", SGRT_U8, s.size(), s.height);
    if (!absent(persistence)) check_output_beside(persistence, "persistence", SGRT_F64, s.size(), s.height);
    if (!absent(crest) && !absent(persistence)) check_apart(crest, "crest", persistence, "persistence");
    const Run run = run_of(context);
    const std::vector<std::int32_t> beside = beside_in_sheet(run, s, f);
    std::vector<std::uint8_t> lines;
    if (!absent(crest)) lines = crests(run, s, f, beside, sigmas);
    if (!absent(persistence)) {
      std::vector<double> values(f.reason.size(), std::numeric_limits<double>::quiet_NaN());
      for (const Extremum& e : extrema(f, beside, sigmas))
        values[static_cast<std::size_t>(e.row)] = e.sign * e.persistence;
      write_view(*persistence, values.data());
    }
    if (!absent(crest)) write_view(*crest, lines.data());
  });
}
