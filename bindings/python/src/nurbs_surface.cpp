// NURBS surfaces.
#include "nurbs.hpp"

namespace sgrt_py {
namespace {

py::ssize_t derivative_count(int order) {
  return static_cast<py::ssize_t>(order + 1) * (order + 2) / 2;
}

using Pair = std::pair<int32_t, int32_t>;

Nurbs surface_from_arrays(const ArrayLike& control_points, Pair degree,
                          const std::optional<std::pair<ArrayLike, ArrayLike>>& knots, const MaybeArray& weights) {
  const InView p(control_points, "control_points", Accept::kFloats), w(weights, "weights", Accept::kFloats);
  InView u, v;
  if (knots) {
    u = InView(knots->first, "knots[0]", Accept::kFloats);
    v = InView(knots->second, "knots[1]", Accept::kFloats);
  }
  auto data = defaults(sgrt_nurbs_surface_data_init);
  data.degree_u = degree.first;
  data.degree_v = degree.second;
  data.control_points = p.view;
  data.knots_u = u.view;
  data.knots_v = v.view;
  data.weights = w.view;
  Nurbs surface;
  run([&] { return sgrt_nurbs_surface_create(&data, out(surface.handle)); });
  return surface;
}

Nurbs surface_from_json(const std::string& json) {
  Nurbs surface;
  run([&] { return sgrt_nurbs_surface_from_json(json.data(), json.size(), out(surface.handle)); });
  return surface;
}

std::string text_of(const Nurbs& surface) {
  return sgrt_nurbs_surface_text(surface.handle.get(), SGRT_NURBS_JSON);
}

Nurbs chapter(const Surface& surface, Pair degree) {
  Nurbs result;
  run([&] {
    return sgrt_nurbs_surface_chapter(surface.handle.get(), degree.first, degree.second, out(result.handle));
  });
  return result;
}

Nurbs interpolate_surface(const ArrayLike& points_mm, Pair degree, std::optional<Pair> count,
                          const std::string& parameters) {
  const InView points(points_mm, "points_mm", Accept::kFloats);
  const int32_t d[2] = {degree.first, degree.second};
  const int32_t n[2] = {count ? count->first : 0, count ? count->second : 0}, kind = kind_of(parameters);
  Nurbs surface;
  run([&] { return sgrt_nurbs_surface_interpolate(&points.view, d, n, kind, out(surface.handle)); });
  return surface;
}

Nurbs revolve(const Curve& curve, const ArrayLike& axis_point_mm, const ArrayLike& axis_direction, double angle_rad) {
  const Vec3 point(axis_point_mm, "axis_point_mm"), direction(axis_direction, "axis_direction");
  Nurbs surface;
  run([&] {
    return sgrt_nurbs_surface_revolve(curve.handle.get(), point.v, direction.v, angle_rad, out(surface.handle));
  });
  return surface;
}

Nurbs sphere(const ArrayLike& centre_mm, double radius_mm) {
  const Vec3 centre(centre_mm, "centre_mm");
  Nurbs surface;
  run([&] { return sgrt_nurbs_surface_sphere(centre.v, radius_mm, out(surface.handle)); });
  return surface;
}

Nurbs cylinder(const ArrayLike& base_mm, const ArrayLike& axis_mm, double radius_mm) {
  const Vec3 base(base_mm, "base_mm"), axis(axis_mm, "axis_mm");
  Nurbs surface;
  run([&] { return sgrt_nurbs_surface_cylinder(base.v, axis.v, radius_mm, out(surface.handle)); });
  return surface;
}

Nurbs torus(const ArrayLike& centre_mm, const ArrayLike& axis, double radius_mm, double tube_radius_mm) {
  const Vec3 centre(centre_mm, "centre_mm"), a(axis, "axis");
  Nurbs surface;
  run([&] { return sgrt_nurbs_surface_torus(centre.v, a.v, radius_mm, tube_radius_mm, out(surface.handle)); });
  return surface;
}

sgrt_nurbs_surface_info info_of(const Nurbs& surface) {
  sgrt_nurbs_surface_info info{};
  info.struct_size = sizeof info;
  run([&] { return sgrt_nurbs_surface_summary(surface.handle.get(), &info); });
  return info;
}

std::optional<Doubles> surface_array(const py::object& self, int32_t field) {
  sgrt_view view{};
  run([&] { return sgrt_nurbs_surface_array(self.cast<const Nurbs&>().handle.get(), field, &view); });
  return lend<double>(view, self);
}

Doubles surface_derivatives(const Nurbs& surface, const ArrayLike& u, const ArrayLike& v, int32_t order, bool clamp,
                            const std::optional<py::array>& given, Context* context) {
  const ParameterArray at({u, v}, "u, v");
  const auto fill = [&](const sgrt_mut_view& view) {
    run(context, [&](sgrt_context* c) {
      return sgrt_nurbs_surface_evaluate(c, surface.handle.get(), &at.flat.view, order, outside_of(clamp), &view);
    });
  };
  if (!given) return filled(at.count(), {derivative_count(order), 3}, at.shape, fill);
  py::array mine = *given;
  fill(out_view(mine, "out", SGRT_F64));
  return py::reinterpret_borrow<Doubles>(mine);
}

Doubles surface_points(const Nurbs& surface, const ArrayLike& u, const ArrayLike& v, bool clamp, Context* context) {
  const Doubles all = surface_derivatives(surface, u, v, 0, clamp, std::nullopt, context);
  return py::reinterpret_borrow<Doubles>(all[py::make_tuple(py::ellipsis(), 0, py::slice(0, 3, 1))]);
}

Doubles surface_normals(const Nurbs& surface, const ArrayLike& u, const ArrayLike& v, bool clamp, Context* context) {
  const ParameterArray at({u, v}, "u, v");
  return filled(at.count(), {3}, at.shape, [&](const sgrt_mut_view& view) {
    run(context, [&](sgrt_context* c) {
      return sgrt_nurbs_surface_normals(c, surface.handle.get(), &at.flat.view, outside_of(clamp), &view);
    });
  });
}

// numpy's: n equal steps over a domain, its ends exactly.
Doubles steps(const double domain[2], py::ssize_t n, const char* name) {
  if (n < 2) invalid(std::string(name) + ": " + std::to_string(n) + ", expected at least 2");
  return Doubles(py::module_::import("numpy").attr("linspace")(domain[0], domain[1], n));
}

Doubles grid_at(const Nurbs& surface, const ArrayLike& u, const ArrayLike& v, int32_t order,
                const std::optional<py::array>& given, Context* context) {
  const InView at_u(u, "u", Accept::kFloats), at_v(v, "v", Accept::kFloats);
  const Shape shape{at_u.view.shape[0], at_v.view.shape[0]};
  py::array all = out_array(given, SGRT_F64, order > 0 ? shape + Shape{derivative_count(order), 3} : shape + Shape{3});
  sgrt_mut_view view = out_view(all, "out", SGRT_F64);
  if (order == 0 && view.ndim == 3) {  // for the library NU x NV x 1 x 3
    view.ndim = 4;
    view.shape[3] = view.shape[2];
    view.strides[3] = view.strides[2];
    view.shape[2] = 1;
    view.strides[2] = 3 * view.strides[3];
  }
  run(context, [&](sgrt_context* c) {
    return sgrt_nurbs_surface_grid(c, surface.handle.get(), &at_u.view, &at_v.view, order, SGRT_OUTSIDE_REFUSE, &view);
  });
  return py::reinterpret_borrow<Doubles>(all);
}

Doubles grid(const Nurbs& surface, py::ssize_t nu, py::ssize_t nv, int32_t order, const std::optional<py::array>& given,
             Context* context) {
  const auto info = info_of(surface);
  const Doubles u = steps(info.domain_u, nu, "nu"), v = steps(info.domain_v, nv, "nv");
  return grid_at(surface, py::reinterpret_borrow<ArrayLike>(u), py::reinterpret_borrow<ArrayLike>(v), order, given,
                 context);
}

Closest surface_closest(const Nurbs& surface, const ArrayLike& points_mm, Context* context) {
  const InView points(points_mm, "points_mm", Accept::kFloats);
  const py::ssize_t n = points.view.shape[0];
  Doubles uv({n, py::ssize_t(2)}), distance(n), gap(n);
  const sgrt_mut_view a = out_view(uv, "uv", SGRT_F64), b = out_view(distance, "distance", SGRT_F64),
                      c = out_view(gap, "gap", SGRT_F64);
  run(context,
      [&](sgrt_context* x) { return sgrt_nurbs_surface_closest(x, surface.handle.get(), &points.view, &a, &b, &c); });
  return {uv, distance, gap};
}

Surface mesh(const Nurbs& surface, double chord_error_mm, Context* context) {
  Surface result;
  run(context, [&](sgrt_context* c) {
    return sgrt_nurbs_surface_mesh(c, surface.handle.get(), chord_error_mm, out(result.handle));
  });
  return result;
}

template <class F>
Nurbs tool(const Nurbs& surface, F&& f) {
  Nurbs result;
  run([&] { return f(surface.handle.get(), static_cast<sgrt_nurbs_surface**>(out(result.handle))); });
  return result;
}

Nurbs refine_surface(const Nurbs& surface, int32_t direction, const ArrayLike& knots) {
  const InView k(knots, "knots", Accept::kFloats);
  return tool(surface, [&](auto* s, auto** r) { return sgrt_nurbs_surface_refine(s, direction, &k.view, r); });
}

Nurbs restrict_surface(const Nurbs& surface, int32_t direction, double begin, double end) {
  return tool(surface, [&](auto* s, auto** r) { return sgrt_nurbs_surface_restrict(s, direction, begin, end, r); });
}

constexpr const char* kSurfaceDoc =
    R"(A non-uniform rational B-spline surface (eq. 10.4). Immutable; pickles. Direction 0 is u, 1 is v.

control_points: NU x NV x 3, mm. degree: a pair. knots: a pair of arrays; None: uniform, clamped, on [0, 1]. weights: NU x NV, above 0.

Raises InvalidArgument: knots that decrease or whose number does not fit (the message says the required one), a weight
    that is not above 0, too few control points, non-finite. LimitError: degree above 24.
C: sgrt_nurbs_surface_create)";

constexpr const char* kGridDoc = R"(The points of an equally spaced grid over the domain: float64, nu x nv x 3.

order > 0: nu x nv x K x 3 with the derivatives up to it, as `derivatives` gives them. out: such an array to write into.
C: sgrt_nurbs_surface_grid)";

using SurfaceBound = std::tuple<Nurbs, int32_t, double>;

void register_surface_makers(py::class_<Nurbs>& type) {
  const auto none = py::none();
  type.def(py::init(&surface_from_arrays), py::arg("control_points"), py::arg("degree") = Pair(3, 3), py::kw_only(),
           py::arg("knots") = none, py::arg("weights") = none)
      .def_static("from_json", &surface_from_json, py::arg("json"),
                  "From the text of a nurbs.json (schema \"sgrt-nurbs/1\").\n\nC: sgrt_nurbs_surface_from_json")
      .def("to_json", py::overload_cast<const Nurbs&>(&text_of),
           "The surface as JSON, all numbers to the last bit.\n\nC: sgrt_nurbs_surface_text")
      .def_static(
          "chapter", &chapter, py::arg("surface"), py::arg("degree") = Pair(3, 3),
          "The chapter's eight steps: the points of a grid without holes become the control points (it approximates, "
          "flattening a cap by h^2 / (3 R)).\n\nC: sgrt_nurbs_surface_chapter")
      .def_static("interpolate", &interpolate_surface, py::arg("points_mm"), py::arg("degree") = Pair(3, 3),
                  py::kw_only(), py::arg("count") = none, py::arg("parameters") = "chord",
                  (std::string(kInterpolateDoc) + "C: sgrt_nurbs_surface_interpolate").c_str())
      .def_static("revolve", &revolve, py::arg("curve"), py::arg("axis_point_mm"), py::arg("axis_direction"),
                  py::arg("angle_rad"),
                  "The curve turned about an axis: u turns counter-clockwise, v runs along the curve.\n\n"
                  "C: sgrt_nurbs_surface_revolve")
      .def_static("sphere", &sphere, py::arg("centre_mm"), py::arg("radius_mm"),
                  "Exact, normals outward.\n\nC: sgrt_nurbs_surface_sphere")
      .def_static("cylinder", &cylinder, py::arg("base_mm"), py::arg("axis_mm"), py::arg("radius_mm"),
                  "From base to base + axis, without caps.\n\nC: sgrt_nurbs_surface_cylinder")
      .def_static("torus", &torus, py::arg("centre_mm"), py::arg("axis"), py::arg("radius_mm"),
                  py::arg("tube_radius_mm"), "Exact, normals outward.\n\nC: sgrt_nurbs_surface_torus");
}

void register_surface_arrays(py::class_<Nurbs>& type) {
  type.def_property_readonly(
          "degree",
          [](const Nurbs& s) {
            const auto i = info_of(s);
            return Pair(i.degree[0], i.degree[1]);
          },
          "(in u, in v).")
      .def_property_readonly(
          "rational", [](const Nurbs& s) { return info_of(s).rational != 0; }, "Whether weights differ.")
      .def_property_readonly(
          "domain",
          [](const Nurbs& s) {
            const auto i = info_of(s);
            return std::pair(Domain(i.domain_u[0], i.domain_u[1]), Domain(i.domain_v[0], i.domain_v[1]));
          },
          "((begin, end) of u, (begin, end) of v).")
      .def_property_readonly(
          "knots",
          [](const py::object& s) {
            return std::pair(*surface_array(s, SGRT_NURBS_KNOTS_U), *surface_array(s, SGRT_NURBS_KNOTS_V));
          },
          "(of u, of v).")
      .def_property_readonly(
          "control_points", [](const py::object& s) { return surface_array(s, SGRT_NURBS_CONTROL_POINTS); },
          "NU x NV x 3, mm.")
      .def_property_readonly(
          "weights", [](const py::object& s) { return surface_array(s, SGRT_NURBS_WEIGHTS); },
          "NU x NV, or None: all 1.");
}

void register_surface_evaluation(py::class_<Nurbs>& type) {
  const auto none = py::none();
  type.def("evaluate", &surface_points, py::arg("u"), py::arg("v"), py::kw_only(), py::arg("clamp") = false,
           py::arg("context") = none,
           "Points at parameters that broadcast to any shape: that shape x 3, mm. clamp: a parameter outside means the "
           "domain's edge.\n\nRaises InvalidArgument: outside the domain, NaN.\nC: sgrt_nurbs_surface_evaluate")
      .def("derivatives", &surface_derivatives, py::arg("u"), py::arg("v"), py::arg("order") = 2, py::kw_only(),
           py::arg("clamp") = false, py::arg("out") = none, py::arg("context") = none,
           "S, S_u, S_v, S_uu, S_uv, S_vv, S_uuu ... up to `order` in all: shape x K x 3. out: for N "
           "parameters, an N x K x 3 array to write into.\n\nC: "
           "sgrt_nurbs_surface_evaluate")
      .def("normals", &surface_normals, py::arg("u"), py::arg("v"), py::kw_only(), py::arg("clamp") = false,
           py::arg("context") = none,
           "Unit normals S_u x S_v; at a pole their limit, NaN where there is none.\n\nC: sgrt_nurbs_surface_normals")
      .def("grid", &grid, py::arg("nu"), py::arg("nv"), py::arg("order") = 0, py::kw_only(), py::arg("out") = none,
           py::arg("context") = none, kGridDoc)
      .def("grid_at", &grid_at, py::arg("u"), py::arg("v"), py::arg("order") = 0, py::kw_only(), py::arg("out") = none,
           py::arg("context") = none, "As grid, on the grid of these u and v.\n\nC: sgrt_nurbs_surface_grid")
      .def("closest_point", &surface_closest, py::arg("points_mm"), py::kw_only(), py::arg("context") = none,
           (std::string(kClosestDoc) + "C: sgrt_nurbs_surface_closest").c_str())
      .def("mesh", &mesh, py::arg("chord_error_mm"), py::kw_only(), py::arg("context") = none,
           "A Surface of triangles, with exact normals, within chord_error_mm of this one.\n\nRaises LimitError: above "
           "50 "
           "million points. Cancelled.\nC: sgrt_nurbs_surface_mesh");
}

void register_surface_tools(py::class_<Nurbs>& type) {
  type.def("refine", &refine_surface, py::arg("direction"), py::arg("knots"),
           "With these knots added; the same shape.\n\nC: sgrt_nurbs_surface_refine")
      .def(
          "insert_knot",
          [](const Nurbs& s, int32_t direction, double u, int32_t times) {
            return refine_surface(s, direction, repeated(u, times));
          },
          py::arg("direction"), py::arg("u"), py::arg("times") = 1,
          "With knot u added `times` times; the same shape.\n\nC: sgrt_nurbs_surface_refine")
      .def(
          "bezier",
          [](const Nurbs& s, int32_t direction) {
            return tool(s, [&](auto* x, auto** r) { return sgrt_nurbs_surface_bezier(x, direction, r); });
          },
          py::arg("direction"), "Every inner knot to multiplicity degree.\n\nC: sgrt_nurbs_surface_bezier")
      .def("restrict", &restrict_surface, py::arg("direction"), py::arg("begin"), py::arg("end"),
           "The part over [begin, end].\n\nC: sgrt_nurbs_surface_restrict")
      .def(
          "split",
          [](const Nurbs& s, int32_t direction, double u) {
            const auto i = info_of(s);
            const double* domain = direction == 0 ? i.domain_u : i.domain_v;
            return std::pair(restrict_surface(s, direction, domain[0], u),
                             restrict_surface(s, direction, u, domain[1]));
          },
          py::arg("direction"), py::arg("u"), "(before u, after u).\n\nC: sgrt_nurbs_surface_restrict")
      .def(
          "elevate",
          [](const Nurbs& s, int32_t direction, int32_t times) {
            return tool(s, [&](auto* x, auto** r) { return sgrt_nurbs_surface_elevate(x, direction, times, r); });
          },
          py::arg("direction"), py::arg("times") = 1,
          "The same shape with a higher degree.\n\nC: sgrt_nurbs_surface_elevate")
      .def(
          "remove_knot",
          [](const Nurbs& s, int32_t direction, double u, int32_t times, double tolerance_mm) {
            int32_t count = 0;
            double bound = 0;
            Nurbs result = tool(s, [&](auto* x, auto** r) {
              return sgrt_nurbs_surface_remove_knot(x, direction, u, times, tolerance_mm, r, &count, &bound);
            });
            return SurfaceBound(std::move(result), count, bound);
          },
          py::arg("direction"), py::arg("u"), py::arg("times") = 1, py::kw_only(), py::arg("tolerance_mm") = 1e-9,
          "(surface, count, bound_mm), as NurbsCurve.remove_knot.\n\nC: sgrt_nurbs_surface_remove_knot")
      .def(
          "reduce_degree",
          [](const Nurbs& s, int32_t direction, double tolerance_mm) {
            int32_t count = 0;
            double bound = 0;
            Nurbs result = tool(s, [&](auto* x, auto** r) {
              return sgrt_nurbs_surface_reduce_degree(x, direction, tolerance_mm, r, &count, &bound);
            });
            return SurfaceBound(std::move(result), count, bound);
          },
          py::arg("direction"), py::kw_only(), py::arg("tolerance_mm") = 1e-9,
          "(surface, count, bound_mm), as NurbsCurve.reduce_degree.\n\nC: sgrt_nurbs_surface_reduce_degree")
      .def(
          "reparameterise",
          [](const Nurbs& s, int32_t direction, double begin, double end) {
            return tool(
                s, [&](auto* x, auto** r) { return sgrt_nurbs_surface_reparameterise(x, direction, begin, end, r); });
          },
          py::arg("direction"), py::arg("begin"), py::arg("end"),
          "The same shape over [begin, end]; begin > end runs it backwards, and turns the normals.\n\n"
          "C: sgrt_nurbs_surface_reparameterise");
}

}  // namespace

void register_nurbs_surface(py::module_& m) {
  py::class_<Nurbs> type(m, "NurbsSurface", kSurfaceDoc);
  register_surface_makers(type);
  register_surface_arrays(type);
  register_surface_evaluation(type);
  register_surface_tools(type);
  type.def("__repr__",
           [](const Nurbs& s) {
             const auto i = info_of(s);
             return py::str("<sgrt.NurbsSurface degree {} x {}, {} x {} control points>")
                 .format(i.degree[0], i.degree[1], i.count[0], i.count[1]);
           })
      .def(py::pickle([](const Nurbs& s) { return text_of(s); }, &surface_from_json));
}

}  // namespace sgrt_py
