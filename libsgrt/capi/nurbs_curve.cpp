// NURBS curves: made, evaluated, and made anew by the tools.
#include "capi/nurbs.hpp"
#include "nurbs/conics.hpp"
#include "nurbs/knots.hpp"
#include "nurbs/length.hpp"
#include "nurbs/nurbs_json.hpp"

namespace sgrt {
namespace {

sgrt_nurbs_curve_data data_defaults() {
  sgrt_nurbs_curve_data d{};
  d.struct_size = sizeof d;
  d.degree = 3;
  return d;
}

NurbsCurve from_c(const sgrt_nurbs_curve_data& d) {
  NurbsCurve curve;
  curve.points = read_points(&d.control_points, "data.control_points");
  const std::int64_t n = curve.points.rows();
  curve.basis = basis_of(d.knots, d.degree, n, "data.knots");
  if (!absent(&d.weights)) {
    check_view(&d.weights, "data.weights", Kind::kReal, {n});
    curve.weights.resize(n);
    read_view(d.weights, curve.weights.data());
  }
  return make_nurbs_curve(std::move(curve));
}

sgrt_view array_of(const NurbsCurve& curve, std::int32_t field) {
  switch (field) {
    case SGRT_NURBS_KNOTS_U:
      return lend(curve.basis.knots.data(), SGRT_F64, {static_cast<std::int64_t>(curve.basis.knots.size())});
    case SGRT_NURBS_KNOTS_V:
      return {};
    case SGRT_NURBS_CONTROL_POINTS:
      return lend(curve.points.data(), SGRT_F64, {curve.points.rows(), 3});
    case SGRT_NURBS_WEIGHTS:
      return curve.rational() ? lend(curve.weights.data(), SGRT_F64, {curve.weights.size()}) : sgrt_view{};
    default:
      refuse("field", std::to_string(field), "SGRT_NURBS_KNOTS_U (1) to SGRT_NURBS_WEIGHTS (4)");
  }
}

sgrt_nurbs_curve* handle_of(NurbsCurve&& curve) {
  auto handle = std::make_unique<sgrt_nurbs_curve>();
  handle->curve = std::move(curve);
  return handle.release();
}

const NurbsCurve& curve_of(const sgrt_nurbs_curve* curve) {
  need(curve, "curve");
  return curve->curve;
}

// A tool: one curve to another.
template <class Tool>
void tool(const sgrt_nurbs_curve* curve, sgrt_nurbs_curve** result, Tool&& make) {
  need(curve, "curve");
  need(result, "result");
  *result = handle_of(make(curve->curve));
}

template <class Tool>
void approximating(const sgrt_nurbs_curve* curve, sgrt_nurbs_curve** result, std::int32_t* count, double* bound_mm,
                   Tool&& make) {
  need(result, "result");
  Approximated<NurbsCurve> a = make(curve_of(curve));
  *result = handle_of(std::move(a.shape));
  if (count) *count = a.count;
  if (bound_mm) *bound_mm = a.bound_mm;
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_nurbs_curve_data_init(sgrt_nurbs_curve_data* data, size_t size) {
  return guard([&] { init_struct(data, size, data_defaults(), "data"); });
}

sgrt_status sgrt_nurbs_curve_create(const sgrt_nurbs_curve_data* data, sgrt_nurbs_curve** curve) {
  return guard([&] {
    need(data, "data");
    need(curve, "curve");
    *curve = handle_of(from_c(read_struct(data, data_defaults(), "data.struct_size")));
  });
}

sgrt_status sgrt_nurbs_curve_from_json(const char* text, size_t size, sgrt_nurbs_curve** curve) {
  return guard([&] {
    need(text, "text");
    need(curve, "curve");
    *curve = handle_of(curve_from_json(text, size));
  });
}

sgrt_status sgrt_nurbs_curve_arc(const double centre_mm[3], const double x_mm[3], const double y_mm[3],
                                 double begin_rad, double end_rad, sgrt_nurbs_curve** curve) {
  return guard([&] {
    need(curve, "curve");
    *curve = handle_of(
        make_arc(place(centre_mm, "centre_mm"), place(x_mm, "x_mm"), place(y_mm, "y_mm"), begin_rad, end_rad));
  });
}

sgrt_status sgrt_nurbs_curve_interpolate(const sgrt_view* points_mm, int32_t degree, int32_t count, int32_t parameters,
                                         sgrt_nurbs_curve** curve) {
  return guard([&] {
    need(curve, "curve");
    const Points points = read_points(points_mm, "points_mm");
    check_limit(points.rows(), kMaxKnots / 2, "points_mm");
    const int n = count == 0 ? static_cast<int>(points.rows()) : count;
    *curve = handle_of(fit_curve(points, degree, n, parameters_kind(parameters)));
  });
}

void sgrt_nurbs_curve_free(sgrt_nurbs_curve* curve) {
  guard([&] { delete curve; });
}

sgrt_status sgrt_nurbs_curve_summary(const sgrt_nurbs_curve* curve, sgrt_nurbs_curve_info* info) {
  return guard([&] {
    const NurbsCurve& c = curve_of(curve);
    need(info, "info");
    check_result(info, "info.struct_size");
    sgrt_nurbs_curve_info r{};
    r.degree = c.basis.degree;
    r.count = c.basis.size();
    r.rational = c.rational();
    r.domain[0] = c.basis.begin();
    r.domain[1] = c.basis.end();
    write_struct(info, r);
  });
}

sgrt_status sgrt_nurbs_curve_array(const sgrt_nurbs_curve* curve, int32_t field, sgrt_view* view) {
  return guard([&] {
    const NurbsCurve& c = curve_of(curve);
    need(view, "view");
    *view = array_of(c, field);
  });
}

const char* sgrt_nurbs_curve_text(const sgrt_nurbs_curve* curve, int32_t field) {
  return guard_text([&]() -> const char* {
    if (!curve || field != SGRT_NURBS_JSON) return nullptr;
    return curve->json.get([&] { return to_json(curve->curve); }).c_str();
  });
}

sgrt_status sgrt_nurbs_curve_evaluate(sgrt_context* context, const sgrt_nurbs_curve* curve, const sgrt_view* u,
                                      int32_t order, int32_t outside, const sgrt_mut_view* derivatives) {
  return guard([&] {
    const NurbsCurve& c = curve_of(curve);
    check_view(u, "u", Kind::kReal, {kAny});
    check_order(order);
    const std::int64_t n = u->shape[0], width = order + 1;
    check_output(derivatives, "derivatives", SGRT_F64, {n, width, 3});
    check_apart(derivatives, "derivatives", u, "u");
    const ParameterView<1> at(*u, "u", &c.basis, outside);
    Run run = run_of(context);
    run.progress = nullptr;  // the output is written as it goes, so this call cannot be cancelled
    fill_output(*derivatives, [&](double* out) {
      parallel_for(run, n, 4096, [&](std::int64_t begin, std::int64_t end) {
        Vec3 ders[kMaxOrder + 1];
        for (std::int64_t i = begin; i < end; ++i) {
          sgrt::derivatives(c, at.data()[i], order, ders);
          std::copy_n(ders[0].data(), 3 * width, out + 3 * width * i);
        }
      });
    });
  });
}

sgrt_status sgrt_nurbs_curve_closest(sgrt_context* context, const sgrt_nurbs_curve* curve, const sgrt_view* points_mm,
                                     const sgrt_mut_view* u, const sgrt_mut_view* distance_mm,
                                     const sgrt_mut_view* gap_mm) {
  return guard([&] { closest_points(context, ClosestFinder(curve_of(curve)), points_mm, 1, u, distance_mm, gap_mm); });
}

sgrt_status sgrt_nurbs_curve_length(const sgrt_nurbs_curve* curve, double begin, double end, double* length_mm) {
  return guard([&] {
    const NurbsCurve& c = curve_of(curve);
    need(length_mm, "length_mm");
    *length_mm = arc_length(c, begin, end);
  });
}

sgrt_status sgrt_nurbs_curve_refine(const sgrt_nurbs_curve* curve, const sgrt_view* knots, sgrt_nurbs_curve** result) {
  return guard([&] {
    tool(curve, result, [&](const NurbsCurve& c) {
      check_view(knots, "knots", Kind::kReal, {kAny});
      check_limit(knots->shape[0], kMaxKnots, "knots");
      return refine(c, numbers_of(*knots, knots->shape[0]));
    });
  });
}

sgrt_status sgrt_nurbs_curve_bezier(const sgrt_nurbs_curve* curve, sgrt_nurbs_curve** result) {
  return guard([&] { tool(curve, result, [&](const NurbsCurve& c) { return to_bezier(c); }); });
}

sgrt_status sgrt_nurbs_curve_restrict(const sgrt_nurbs_curve* curve, double begin, double end,
                                      sgrt_nurbs_curve** result) {
  return guard([&] { tool(curve, result, [&](const NurbsCurve& c) { return restrict_to(c, begin, end); }); });
}

sgrt_status sgrt_nurbs_curve_elevate(const sgrt_nurbs_curve* curve, int32_t times, sgrt_nurbs_curve** result) {
  return guard([&] { tool(curve, result, [&](const NurbsCurve& c) { return elevate(c, times); }); });
}

sgrt_status sgrt_nurbs_curve_remove_knot(const sgrt_nurbs_curve* curve, double u, int32_t times, double tolerance_mm,
                                         sgrt_nurbs_curve** result, int32_t* count, double* bound_mm) {
  return guard([&] {
    approximating(curve, result, count, bound_mm,
                  [&](const NurbsCurve& c) { return remove_knot(c, u, times, tolerance_mm); });
  });
}

sgrt_status sgrt_nurbs_curve_reduce_degree(const sgrt_nurbs_curve* curve, double tolerance_mm,
                                           sgrt_nurbs_curve** result, int32_t* count, double* bound_mm) {
  return guard([&] {
    approximating(curve, result, count, bound_mm, [&](const NurbsCurve& c) { return reduce_degree(c, tolerance_mm); });
  });
}

sgrt_status sgrt_nurbs_curve_reparameterise(const sgrt_nurbs_curve* curve, double begin, double end,
                                            sgrt_nurbs_curve** result) {
  return guard([&] { tool(curve, result, [&](const NurbsCurve& c) { return reparameterise(c, begin, end); }); });
}
