// Curvature of curves and surfaces.
#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "capi/nurbs.hpp"
#include "shape/curvature.hpp"
#include "shape/curve.hpp"
#include "shape/extrema.hpp"
#include "shape/nurbs_curvature.hpp"

namespace sgrt {
namespace {

static_assert(static_cast<int>(HkClass::kMinimal) == SGRT_HK_MINIMAL &&
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

Vec3 plane_of(const double* normal) {
  if (!normal) return Vec3::Zero();
  const Vec3 n = place(normal, "plane_normal");
  if (!(n.norm() > 0)) refuse("plane_normal", "0 0 0", "a vector with a length");
  return n;
}

// Outputs of one number a place: checked all, before any is written.
void check_numbers(std::initializer_list<std::pair<const sgrt_mut_view*, const char*>> outputs, std::int64_t n,
                   const sgrt_view* input, const char* input_name) {
  for (const auto* a = outputs.begin(); a != outputs.end(); ++a) {
    if (absent(a->first)) continue;
    check_output(a->first, a->second, SGRT_F64, {n});
    check_apart(a->first, a->second, input, input_name);
    for (const auto* b = outputs.begin(); b != a; ++b)
      if (!absent(b->first)) check_apart(a->first, a->second, b->first, b->second);
  }
}

void write_curve(const std::vector<CurvePoint>& points, const sgrt_mut_view* curvature, const sgrt_mut_view* torsion) {
  std::vector<double> values(points.size());
  if (!absent(curvature)) {
    std::transform(points.begin(), points.end(), values.begin(), [](const CurvePoint& p) { return p.curvature; });
    write_view(*curvature, values.data());
  }
  if (!absent(torsion)) {
    std::transform(points.begin(), points.end(), values.begin(), [](const CurvePoint& p) { return p.torsion; });
    write_view(*torsion, values.data());
  }
}

struct WantedNumber {
  sgrt_mut_view sgrt_curvature_samples::*view;
  const char* name;
  double Curvature::*number;
};
constexpr WantedNumber kNumbers[] = {
    {&sgrt_curvature_samples::k1, "samples.k1", &Curvature::k1},
    {&sgrt_curvature_samples::k2, "samples.k2", &Curvature::k2},
    {&sgrt_curvature_samples::mean, "samples.mean", &Curvature::mean},
    {&sgrt_curvature_samples::gauss, "samples.gauss", &Curvature::gauss},
    {&sgrt_curvature_samples::shape_index, "samples.shape_index", &Curvature::shape_index},
    {&sgrt_curvature_samples::curvedness, "samples.curvedness", &Curvature::curvedness},
};
struct WantedVector {
  sgrt_mut_view sgrt_curvature_samples::*view;
  const char* name;
  Vec3 Curvature::*vector;
};
constexpr WantedVector kVectors[] = {
    {&sgrt_curvature_samples::normals, "samples.normals", &Curvature::normal},
    {&sgrt_curvature_samples::d1, "samples.d1", &Curvature::d1},
    {&sgrt_curvature_samples::d2, "samples.d2", &Curvature::d2},
};

void check_samples(const sgrt_curvature_samples& samples, std::int64_t n, const sgrt_view* uv) {
  check_reserved(samples.reserved, "samples.reserved");
  std::vector<std::pair<const sgrt_mut_view*, const char*>> seen;
  seen.reserve(10);
  const auto one = [&](const sgrt_mut_view* view, const char* name, std::int32_t dtype, bool vector) {
    if (absent(view)) return;
    if (vector)
      check_output(view, name, dtype, {n, 3});
    else
      check_output(view, name, dtype, {n});
    check_apart(view, name, uv, "uv");
    for (const auto& [other, other_name] : seen) check_apart(view, name, other, other_name);
    seen.emplace_back(view, name);
  };
  for (const WantedNumber& w : kNumbers) one(&(samples.*w.view), w.name, SGRT_F64, false);
  for (const WantedVector& w : kVectors) one(&(samples.*w.view), w.name, SGRT_F64, true);
  one(&samples.hk, "samples.hk", SGRT_U8, false);
}

void write_samples(const sgrt_curvature_samples& samples, const std::vector<Curvature>& values) {
  std::vector<std::uint8_t> hk;  // first, as it takes memory
  hk.reserve(values.size());
  // Exact curvature: zero is rounding.
  for (const Curvature& c : values) {
    const double zero = 1e-10 * c.curvedness;
    hk.push_back(static_cast<std::uint8_t>(hk_class(c.mean, c.gauss, zero, zero * c.curvedness)));
  }
  for (const WantedNumber& w : kNumbers) {
    if (absent(&(samples.*w.view))) continue;
    fill_output(samples.*w.view, [&](double* out) {
      for (const Curvature& c : values) *out++ = c.*w.number;
    });
  }
  for (const WantedVector& w : kVectors) {
    if (absent(&(samples.*w.view))) continue;
    fill_output(samples.*w.view, [&](double* out) {
      for (const Curvature& c : values) out = std::copy_n((c.*w.vector).data(), 3, out);
    });
  }
  if (!absent(&samples.hk)) write_view(samples.hk, hk.data());
}

const Eigen::VectorXd* numbers_of(const CurvatureField& f, std::int32_t field) {
  const Eigen::VectorXd* all[] = {
      &f.k1,       &f.k2,       &f.mean,       &f.gauss,       &f.shape_index,       &f.curvedness,
      &f.sigma_k1, &f.sigma_k2, &f.sigma_mean, &f.sigma_gauss, &f.sigma_shape_index, &f.radius};
  return field >= SGRT_CURVATURE_K1 && field <= SGRT_CURVATURE_RADIUS ? all[field - SGRT_CURVATURE_K1] : nullptr;
}

sgrt_view array_of(const CurvatureField& f, std::int32_t field) {
  const auto n = static_cast<std::int64_t>(f.reason.size());
  const auto beside = [&](const void* data, std::int32_t dtype) {
    return f.height > 0 ? lend(data, dtype, {f.height, f.width}) : lend(data, dtype, {n});
  };
  if (const Eigen::VectorXd* numbers = numbers_of(f, field)) return beside(numbers->data(), SGRT_F64);
  switch (field) {
    case SGRT_CURVATURE_NORMALS:
    case SGRT_CURVATURE_D1:
    case SGRT_CURVATURE_D2: {
      const Points& p = field == SGRT_CURVATURE_NORMALS ? f.normals : field == SGRT_CURVATURE_D1 ? f.d1 : f.d2;
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

sgrt_status sgrt_curvature_nurbs_curve(const sgrt_nurbs_curve* curve, const sgrt_view* u, int32_t outside,
                                       const double plane_normal[3], const sgrt_mut_view* curvature,
                                       const sgrt_mut_view* torsion) {
  return guard([&] {
    need(curve, "curve");
    check_view(u, "u", Kind::kReal, {kAny});
    check_numbers({{curvature, "curvature"}, {torsion, "torsion"}}, u->shape[0], u, "u");
    const Vec3 plane = plane_of(plane_normal);
    const ParameterView<1> parameters(*u, "u", &curve->curve.basis, outside);
    write_curve(curve_curvature(curve->curve, parameters.data(), u->shape[0], plane), curvature, torsion);
  });
}

sgrt_status sgrt_curvature_points(const sgrt_view* points_mm, int32_t closed, int32_t half_window, int32_t degree,
                                  double sigma_mm, const double plane_normal[3], const sgrt_mut_view* curvature,
                                  const sgrt_mut_view* torsion, const sgrt_mut_view* sigma_curvature) {
  return guard([&] {
    const Points points = read_points(points_mm, "points_mm");
    check_range(closed, 0, 1, "closed");
    check_range(sigma_mm, 0, kMaxCoordinate, "sigma_mm");
    const std::int64_t n = points.rows();
    check_numbers({{curvature, "curvature"}, {torsion, "torsion"}, {sigma_curvature, "sigma_curvature"}}, n, points_mm,
                  "points_mm");
    std::vector<double> sigma(absent(sigma_curvature) ? 0 : static_cast<std::size_t>(n));
    const auto values = sampled_curvature(points, half_window, degree, closed != 0, plane_of(plane_normal), sigma_mm,
                                          sigma.empty() ? nullptr : sigma.data());
    write_curve(values, curvature, torsion);
    if (!sigma.empty()) write_view(*sigma_curvature, sigma.data());
  });
}

sgrt_status sgrt_curvature_samples_init(sgrt_curvature_samples* samples, size_t size) {
  return guard([&] { init_struct(samples, size, sgrt_curvature_samples{}, "samples"); });
}

sgrt_status sgrt_curvature_nurbs_surface(sgrt_context* context, const sgrt_nurbs_surface* surface, const sgrt_view* uv,
                                         int32_t outside, const sgrt_curvature_samples* samples) {
  return guard([&] {
    need(surface, "surface");
    need(samples, "samples");
    check_view(uv, "uv", Kind::kReal, {kAny, 2});
    const auto wanted = read_struct(samples, sgrt_curvature_samples{}, "samples.struct_size");
    check_samples(wanted, uv->shape[0], uv);
    const ParameterView<2> parameters(*uv, "uv", surface->evaluator.surface().basis, outside);
    std::vector<Curvature> values(static_cast<std::size_t>(uv->shape[0]));
    nurbs_curvature(run_of(context), surface->evaluator, parameters.data(), uv->shape[0], values.data());
    write_samples(wanted, values);
  });
}

sgrt_status sgrt_curvature_options_init(sgrt_curvature_options* options, size_t size) {
  return guard([&] { init_struct(options, size, curvature_defaults(), "options"); });
}

sgrt_status sgrt_curvature_compute(sgrt_context* context, const sgrt_surface* surface,
                                   const sgrt_curvature_options* options, sgrt_curvature** result) {
  return guard([&] {
    need(surface, "surface");
    need(result, "result");
    const CurvatureOptions o = from_c(read_struct(options, curvature_defaults(), "options.struct_size"));
    if (!surface->surface->has_normals())
      refuse("surface", "a surface without normals",
             "normals, which say what is outward (see sgrt_surface_estimate_normals)");
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
    std::vector<std::uint8_t> lines;
    if (!absent(crest)) lines = crests(run, s, f, sigmas);
    if (!absent(persistence)) {
      std::vector<double> values(f.reason.size(), std::numeric_limits<double>::quiet_NaN());
      for (const Extremum& e : extrema(run, s, f, sigmas))
        values[static_cast<std::size_t>(e.row)] = e.sign * e.persistence;
      write_view(*persistence, values.data());
    }
    if (!absent(crest)) write_view(*crest, lines.data());
  });
}
