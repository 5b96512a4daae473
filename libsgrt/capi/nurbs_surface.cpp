// NURBS surfaces: made, evaluated, meshed, and made anew by the tools.
#include "capi/nurbs.hpp"
#include "nurbs/conics.hpp"
#include "nurbs/knots.hpp"
#include "nurbs/mesh.hpp"
#include "nurbs/nurbs_json.hpp"

namespace sgrt {
namespace {

sgrt_nurbs_surface_data data_defaults() {
  sgrt_nurbs_surface_data d{};
  d.struct_size = sizeof d;
  d.degree_u = d.degree_v = 3;
  return d;
}

// NU x NV x 3 as N x 3.
Points read_grid(const sgrt_view* view, const char* name) {
  check_view(view, name, Kind::kReal, {kAny, kAny, 3});
  for (int i = 0; i < 2; ++i) check_limit(view->shape[i], kMaxKnots / 2, name);
  check_limit(view->shape[0] * view->shape[1], kMaxPoints, name);
  Points points(view->shape[0] * view->shape[1], 3);
  read_view(*view, points.data());
  return points;
}

NurbsSurface from_c(const sgrt_nurbs_surface_data& d) {
  check_reserved(d.reserved, "data.reserved");
  NurbsSurface s;
  s.points = read_grid(&d.control_points, "data.control_points");
  const std::int64_t nu = d.control_points.shape[0], nv = d.control_points.shape[1];
  s.basis[0] = basis_of(d.knots_u, d.degree_u, nu, "data.knots_u");
  s.basis[1] = basis_of(d.knots_v, d.degree_v, nv, "data.knots_v");
  if (!absent(&d.weights)) {
    check_view(&d.weights, "data.weights", Kind::kReal, {nu, nv});
    s.weights.resize(nu * nv);
    read_view(d.weights, s.weights.data());
  }
  return make_nurbs_surface(std::move(s));
}

sgrt_view array_of(const NurbsSurface& s, std::int32_t field) {
  switch (field) {
    case SGRT_NURBS_KNOTS_U:
    case SGRT_NURBS_KNOTS_V: {
      const std::vector<double>& knots = s.basis[field - SGRT_NURBS_KNOTS_U].knots;
      return lend(knots.data(), SGRT_F64, {static_cast<std::int64_t>(knots.size())});
    }
    case SGRT_NURBS_CONTROL_POINTS:
      return lend(s.points.data(), SGRT_F64, {s.nu(), s.nv(), 3});
    case SGRT_NURBS_WEIGHTS:
      return s.rational() ? lend(s.weights.data(), SGRT_F64, {s.nu(), s.nv()}) : sgrt_view{};
    default:
      refuse("field", std::to_string(field), "SGRT_NURBS_KNOTS_U (1) to SGRT_NURBS_WEIGHTS (4)");
  }
}

const NurbsSurface& surface_of(const sgrt_nurbs_surface* surface) {
  need(surface, "surface");
  return surface->evaluator.surface();
}

// One that is made from other things.
template <class Make>
void making(sgrt_nurbs_surface** surface, const char* name, Make&& make) {
  need(surface, name);
  *surface = std::make_unique<sgrt_nurbs_surface>(make()).release();
}

// A tool: one surface to another.
template <class Tool>
void tool(const sgrt_nurbs_surface* surface, sgrt_nurbs_surface** result, Tool&& make) {
  making(result, "result", [&] { return make(surface_of(surface)); });
}

template <class Tool>
void approximating(const sgrt_nurbs_surface* surface, sgrt_nurbs_surface** result, std::int32_t* count,
                   double* bound_mm, Tool&& make) {
  need(result, "result");
  Approximated<NurbsSurface> a = make(surface_of(surface));
  *result = std::make_unique<sgrt_nurbs_surface>(std::move(a.shape)).release();
  if (count) *count = a.count;
  if (bound_mm) *bound_mm = a.bound_mm;
}

// The pairs (u, v) of a call that has checked its output.
}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_nurbs_surface_data_init(sgrt_nurbs_surface_data* data, size_t size) {
  return guard([&] { init_struct(data, size, data_defaults(), "data"); });
}

sgrt_status sgrt_nurbs_surface_create(const sgrt_nurbs_surface_data* data, sgrt_nurbs_surface** surface) {
  return guard([&] {
    making(surface, "surface", [&] {
      need(data, "data");
      return from_c(read_struct(data, data_defaults(), "data.struct_size"));
    });
  });
}

sgrt_status sgrt_nurbs_surface_from_json(const char* text, size_t size, sgrt_nurbs_surface** surface) {
  return guard([&] {
    making(surface, "surface", [&] {
      need(text, "text");
      return surface_from_json(text, size);
    });
  });
}

sgrt_status sgrt_nurbs_surface_chapter(const sgrt_surface* surface, int32_t degree_u, int32_t degree_v,
                                       sgrt_nurbs_surface** result) {
  return guard([&] {
    making(result, "result", [&] {
      need(surface, "surface");
      return chapter_surface(*surface->surface, degree_u, degree_v);
    });
  });
}

sgrt_status sgrt_nurbs_surface_interpolate(const sgrt_view* points_mm, const int32_t degree[2], const int32_t count[2],
                                           int32_t parameters, sgrt_nurbs_surface** surface) {
  return guard([&] {
    making(surface, "surface", [&] {
      const Points points = read_grid(points_mm, "points_mm");
      need(degree, "degree");
      need(count, "count");
      const int n[2] = {static_cast<int>(points_mm->shape[0]), static_cast<int>(points_mm->shape[1])};
      const int wanted[2] = {count[0] == 0 ? n[0] : count[0], count[1] == 0 ? n[1] : count[1]};
      return fit_grid(points, n[0], n[1], degree, wanted, parameters_kind(parameters));
    });
  });
}

sgrt_status sgrt_nurbs_surface_revolve(const sgrt_nurbs_curve* curve, const double axis_point_mm[3],
                                       const double axis_direction[3], double angle_rad, sgrt_nurbs_surface** surface) {
  return guard([&] {
    making(surface, "surface", [&] {
      need(curve, "curve");
      return revolve(curve->curve, place(axis_point_mm, "axis_point_mm"), place(axis_direction, "axis_direction"),
                     angle_rad);
    });
  });
}

sgrt_status sgrt_nurbs_surface_sphere(const double centre_mm[3], double radius_mm, sgrt_nurbs_surface** surface) {
  return guard(
      [&] { making(surface, "surface", [&] { return make_sphere(place(centre_mm, "centre_mm"), radius_mm); }); });
}

sgrt_status sgrt_nurbs_surface_cylinder(const double base_mm[3], const double axis_mm[3], double radius_mm,
                                        sgrt_nurbs_surface** surface) {
  return guard([&] {
    making(surface, "surface",
           [&] { return make_cylinder(place(base_mm, "base_mm"), place(axis_mm, "axis_mm"), radius_mm); });
  });
}

sgrt_status sgrt_nurbs_surface_torus(const double centre_mm[3], const double axis[3], double radius_mm,
                                     double tube_radius_mm, sgrt_nurbs_surface** surface) {
  return guard([&] {
    making(surface, "surface",
           [&] { return make_torus(place(centre_mm, "centre_mm"), place(axis, "axis"), radius_mm, tube_radius_mm); });
  });
}

void sgrt_nurbs_surface_free(sgrt_nurbs_surface* surface) {
  guard([&] { delete surface; });
}

sgrt_status sgrt_nurbs_surface_summary(const sgrt_nurbs_surface* surface, sgrt_nurbs_surface_info* info) {
  return guard([&] {
    const NurbsSurface& s = surface_of(surface);
    need(info, "info");
    check_result(info, "info.struct_size");
    sgrt_nurbs_surface_info r{};
    r.rational = s.rational();
    for (int d = 0; d < 2; ++d) {
      r.degree[d] = s.basis[d].degree;
      r.count[d] = s.basis[d].size();
      double* domain = d == 0 ? r.domain_u : r.domain_v;
      domain[0] = s.basis[d].begin();
      domain[1] = s.basis[d].end();
    }
    write_struct(info, r);
  });
}

sgrt_status sgrt_nurbs_surface_array(const sgrt_nurbs_surface* surface, int32_t field, sgrt_view* view) {
  return guard([&] {
    const NurbsSurface& s = surface_of(surface);
    need(view, "view");
    *view = array_of(s, field);
  });
}

const char* sgrt_nurbs_surface_text(const sgrt_nurbs_surface* surface, int32_t field) {
  return guard_text([&]() -> const char* {
    if (!surface || field != SGRT_NURBS_JSON) return nullptr;
    return surface->json.get([&] { return to_json(surface->evaluator.surface()); }).c_str();
  });
}

sgrt_status sgrt_nurbs_surface_evaluate(sgrt_context* context, const sgrt_nurbs_surface* surface, const sgrt_view* uv,
                                        int32_t order, int32_t outside, const sgrt_mut_view* derivatives) {
  return guard([&] {
    const NurbsSurface& s = surface_of(surface);
    check_view(uv, "uv", Kind::kReal, {kAny, 2});
    check_order(order);
    const std::int64_t n = uv->shape[0];
    check_output(derivatives, "derivatives", SGRT_F64, {n, derivative_count(order), 3});
    check_apart(derivatives, "derivatives", uv, "uv");
    const ParameterView<2> at(*uv, "uv", s.basis, outside);
    const Run run = run_of(context);
    fill_output(*derivatives, [&](double* out) { evaluate_points(run, surface->evaluator, at.data(), n, order, out); });
  });
}

sgrt_status sgrt_nurbs_surface_grid(sgrt_context* context, const sgrt_nurbs_surface* surface, const sgrt_view* u,
                                    const sgrt_view* v, int32_t order, int32_t outside,
                                    const sgrt_mut_view* derivatives) {
  return guard([&] {
    const NurbsSurface& s = surface_of(surface);
    check_view(u, "u", Kind::kReal, {kAny});
    check_view(v, "v", Kind::kReal, {kAny});
    check_order(order);
    const std::int64_t nu = u->shape[0], nv = v->shape[0];
    check_limit(nu, kMaxPoints, "u");
    check_limit(nv, kMaxPoints, "v");
    check_limit(nu * nv, kMaxPoints, "u x v");
    check_output(derivatives, "derivatives", SGRT_F64, {nu, nv, derivative_count(order), 3});
    check_apart(derivatives, "derivatives", u, "u");
    check_apart(derivatives, "derivatives", v, "v");
    const ParameterView<1> at_u(*u, "u", &s.basis[0], outside);
    const ParameterView<1> at_v(*v, "v", &s.basis[1], outside);
    const Run run = run_of(context);
    fill_output(*derivatives, [&](double* out) {
      evaluate_grid(run, surface->evaluator, at_u.data(), nu, at_v.data(), nv, order, out);
    });
  });
}

sgrt_status sgrt_nurbs_surface_normals(sgrt_context* context, const sgrt_nurbs_surface* surface, const sgrt_view* uv,
                                       int32_t outside, const sgrt_mut_view* normals) {
  return guard([&] {
    const NurbsSurface& s = surface_of(surface);
    check_view(uv, "uv", Kind::kReal, {kAny, 2});
    const std::int64_t n = uv->shape[0];
    check_output(normals, "normals", SGRT_F64, {n, 3});
    check_apart(normals, "normals", uv, "uv");
    const ParameterView<2> at(*uv, "uv", s.basis, outside);
    const Run run = run_of(context);
    fill_output(*normals, [&](double* out) { evaluate_normals(run, surface->evaluator, at.data(), n, out); });
  });
}

sgrt_status sgrt_nurbs_surface_closest(sgrt_context* context, const sgrt_nurbs_surface* surface,
                                       const sgrt_view* points_mm, const sgrt_mut_view* uv,
                                       const sgrt_mut_view* distance_mm, const sgrt_mut_view* gap_mm) {
  return guard(
      [&] { closest_points(context, ClosestFinder(surface_of(surface)), points_mm, 2, uv, distance_mm, gap_mm); });
}

sgrt_status sgrt_nurbs_surface_mesh(sgrt_context* context, const sgrt_nurbs_surface* surface, double chord_error_mm,
                                    sgrt_surface** mesh) {
  return guard([&] {
    need(surface, "surface");
    need(mesh, "mesh");
    *mesh = handle_of(mesh_of(run_of(context), surface->evaluator, chord_error_mm)).release();
  });
}

sgrt_status sgrt_nurbs_surface_refine(const sgrt_nurbs_surface* surface, int32_t direction, const sgrt_view* knots,
                                      sgrt_nurbs_surface** result) {
  return guard([&] {
    tool(surface, result, [&](const NurbsSurface& s) {
      check_view(knots, "knots", Kind::kReal, {kAny});
      check_limit(knots->shape[0], kMaxKnots, "knots");
      return refine(s, direction, numbers_of(*knots, knots->shape[0]));
    });
  });
}

sgrt_status sgrt_nurbs_surface_bezier(const sgrt_nurbs_surface* surface, int32_t direction,
                                      sgrt_nurbs_surface** result) {
  return guard([&] { tool(surface, result, [&](const NurbsSurface& s) { return to_bezier(s, direction); }); });
}

sgrt_status sgrt_nurbs_surface_restrict(const sgrt_nurbs_surface* surface, int32_t direction, double begin, double end,
                                        sgrt_nurbs_surface** result) {
  return guard(
      [&] { tool(surface, result, [&](const NurbsSurface& s) { return restrict_to(s, direction, begin, end); }); });
}

sgrt_status sgrt_nurbs_surface_elevate(const sgrt_nurbs_surface* surface, int32_t direction, int32_t times,
                                       sgrt_nurbs_surface** result) {
  return guard([&] { tool(surface, result, [&](const NurbsSurface& s) { return elevate(s, direction, times); }); });
}

sgrt_status sgrt_nurbs_surface_remove_knot(const sgrt_nurbs_surface* surface, int32_t direction, double u,
                                           int32_t times, double tolerance_mm, sgrt_nurbs_surface** result,
                                           int32_t* count, double* bound_mm) {
  return guard([&] {
    approximating(surface, result, count, bound_mm,
                  [&](const NurbsSurface& s) { return remove_knot(s, direction, u, times, tolerance_mm); });
  });
}

sgrt_status sgrt_nurbs_surface_reduce_degree(const sgrt_nurbs_surface* surface, int32_t direction, double tolerance_mm,
                                             sgrt_nurbs_surface** result, int32_t* count, double* bound_mm) {
  return guard([&] {
    approximating(surface, result, count, bound_mm,
                  [&](const NurbsSurface& s) { return reduce_degree(s, direction, tolerance_mm); });
  });
}

sgrt_status sgrt_nurbs_surface_reparameterise(const sgrt_nurbs_surface* surface, int32_t direction, double begin,
                                              double end, sgrt_nurbs_surface** result) {
  return guard(
      [&] { tool(surface, result, [&](const NurbsSurface& s) { return reparameterise(s, direction, begin, end); }); });
}
