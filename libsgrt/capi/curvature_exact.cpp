// Curvature of curves, and of NURBS surfaces at parameters.
#include <algorithm>
#include <string>
#include <vector>

#include "capi/nurbs.hpp"
#include "shape/curve.hpp"
#include "shape/nurbs_curvature.hpp"

namespace sgrt {
namespace {

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
  std::vector<std::uint8_t> hk;  // all memory first: nothing is written when it ends
  std::vector<double> numbers(3 * values.size());
  hk.reserve(values.size());
  // Exact curvature: zero is rounding.
  for (const Curvature& c : values) {
    const double zero = 1e-10 * c.curvedness;
    hk.push_back(static_cast<std::uint8_t>(hk_class(c.mean, c.gauss, zero, zero * c.curvedness)));
  }
  for (const WantedNumber& w : kNumbers) {
    if (absent(&(samples.*w.view))) continue;
    std::transform(values.begin(), values.end(), numbers.begin(), [&](const Curvature& c) { return c.*w.number; });
    write_view(samples.*w.view, numbers.data());
  }
  for (const WantedVector& w : kVectors) {
    if (absent(&(samples.*w.view))) continue;
    double* to = numbers.data();
    for (const Curvature& c : values) to = std::copy_n((c.*w.vector).data(), 3, to);
    write_view(samples.*w.view, numbers.data());
  }
  if (!absent(&samples.hk)) write_view(samples.hk, hk.data());
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
