// NURBS curves.
#include "nurbs.hpp"

namespace sgrt_py {
namespace {

Curve curve_from_arrays(const ArrayLike& control_points, int32_t degree, const MaybeArray& knots,
                        const MaybeArray& weights) {
  const InView p(control_points, "control_points", Accept::kFloats), k(knots, "knots", Accept::kFloats),
      w(weights, "weights", Accept::kFloats);
  auto data = defaults(sgrt_nurbs_curve_data_init);
  data.degree = degree;
  data.control_points = p.view;
  data.knots = k.view;
  data.weights = w.view;
  Curve curve;
  run([&] { return sgrt_nurbs_curve_create(&data, out(curve.handle)); });
  return curve;
}

Curve curve_from_json(const std::string& json) {
  Curve curve;
  run([&] { return sgrt_nurbs_curve_from_json(json.data(), json.size(), out(curve.handle)); });
  return curve;
}

std::string text_of(const Curve& curve) {
  return sgrt_nurbs_curve_text(curve.handle.get(), SGRT_NURBS_JSON);
}

Curve arc(const ArrayLike& centre_mm, const ArrayLike& x_mm, const ArrayLike& y_mm, double begin_rad, double end_rad) {
  const Vec3 centre(centre_mm, "centre_mm"), x(x_mm, "x_mm"), y(y_mm, "y_mm");
  Curve curve;
  run([&] { return sgrt_nurbs_curve_arc(centre.v, x.v, y.v, begin_rad, end_rad, out(curve.handle)); });
  return curve;
}

Curve interpolate_curve(const ArrayLike& points_mm, int32_t degree, std::optional<int32_t> count,
                        const std::string& parameters) {
  const InView points(points_mm, "points_mm", Accept::kFloats);
  const int32_t kind = kind_of(parameters);
  Curve curve;
  run([&] { return sgrt_nurbs_curve_interpolate(&points.view, degree, count.value_or(0), kind, out(curve.handle)); });
  return curve;
}

sgrt_nurbs_curve_info info_of(const Curve& curve) {
  sgrt_nurbs_curve_info info{};
  info.struct_size = sizeof info;
  run([&] { return sgrt_nurbs_curve_summary(curve.handle.get(), &info); });
  return info;
}

std::optional<Doubles> curve_array(const py::object& self, int32_t field) {
  sgrt_view view{};
  run([&] { return sgrt_nurbs_curve_array(self.cast<const Curve&>().handle.get(), field, &view); });
  return lend<double>(view, self);
}

Doubles curve_derivatives(const Curve& curve, const ArrayLike& u, int32_t order, bool clamp, Context* context) {
  const ParameterArray at({u}, "u");
  const Shape tail = order > 0 ? Shape{order + 1, 3} : Shape{1, 3};
  return filled(at.count(), tail, at.shape, [&](const sgrt_mut_view& view) {
    run(context, [&](sgrt_context* c) {
      return sgrt_nurbs_curve_evaluate(c, curve.handle.get(), &at.flat.view, order, outside_of(clamp), &view);
    });
  });
}

Doubles curve_points(const Curve& curve, const ArrayLike& u, bool clamp, Context* context) {
  const Doubles all = curve_derivatives(curve, u, 0, clamp, context);
  return py::reinterpret_borrow<Doubles>(all[py::make_tuple(py::ellipsis(), 0, py::slice(0, 3, 1))]);
}

Closest curve_closest(const Curve& curve, const ArrayLike& points_mm, Context* context) {
  const InView points(points_mm, "points_mm", Accept::kFloats);
  const py::ssize_t n = points.view.shape[0];
  Doubles u(n), distance(n), gap(n);
  const sgrt_mut_view a = out_view(u, "u", SGRT_F64), b = out_view(distance, "distance", SGRT_F64),
                      c = out_view(gap, "gap", SGRT_F64);
  run(context,
      [&](sgrt_context* x) { return sgrt_nurbs_curve_closest(x, curve.handle.get(), &points.view, &a, &b, &c); });
  return {u, distance, gap};
}

double length(const Curve& curve, std::optional<double> begin, std::optional<double> end) {
  const auto info = info_of(curve);
  double mm = 0;
  run([&] {
    return sgrt_nurbs_curve_length(curve.handle.get(), begin.value_or(info.domain[0]), end.value_or(info.domain[1]),
                                   &mm);
  });
  return mm;
}

// A tool of the library: f(handle, handle of the result).
template <class F>
Curve tool(const Curve& curve, F&& f) {
  Curve result;
  run([&] { return f(curve.handle.get(), static_cast<sgrt_nurbs_curve**>(out(result.handle))); });
  return result;
}

Curve refine_curve(const Curve& curve, const ArrayLike& knots) {
  const InView k(knots, "knots", Accept::kFloats);
  return tool(curve, [&](auto* c, auto** r) { return sgrt_nurbs_curve_refine(c, &k.view, r); });
}

Curve restrict_curve(const Curve& curve, double begin, double end) {
  return tool(curve, [&](auto* c, auto** r) { return sgrt_nurbs_curve_restrict(c, begin, end, r); });
}

constexpr const char* kCurveDoc =
    R"(A non-uniform rational B-spline curve (eq. 10.4 to 10.10). Immutable; pickles.

control_points: N x 3, mm. degree: 1 to 24. knots: N + degree + 1, not decreasing; None: uniform, clamped, on [0, 1]. weights: N, above 0.

Raises InvalidArgument: knots that decrease or whose number does not fit (the message says the required one), a weight
    that is not above 0, too few control points, non-finite. LimitError: degree above 24.
C: sgrt_nurbs_curve_create)";

using CurveBound = std::tuple<Curve, int32_t, double>;

}  // namespace

void register_nurbs_curve(py::module_& m) {
  const auto none = py::none();
  py::class_<Curve>(m, "NurbsCurve", kCurveDoc)
      .def(py::init(&curve_from_arrays), py::arg("control_points"), py::arg("degree") = 3, py::kw_only(),
           py::arg("knots") = none, py::arg("weights") = none)
      .def_static("from_json", &curve_from_json, py::arg("json"),
                  "From the text of a nurbs.json (schema \"sgrt-nurbs/1\").\n\nC: sgrt_nurbs_curve_from_json")
      .def("to_json", py::overload_cast<const Curve&>(&text_of),
           "The curve as JSON, all numbers to the last bit.\n\nC: sgrt_nurbs_curve_text")
      .def_static("arc", &arc, py::arg("centre_mm"), py::arg("x_mm"), py::arg("y_mm"), py::arg("begin_rad"),
                  py::arg("end_rad"),
                  "centre + cos(t) x + sin(t) y, exactly, for t from begin to end, at most one turn; domain [0, 1].\n\n"
                  "C: sgrt_nurbs_curve_arc")
      .def_static("interpolate", &interpolate_curve, py::arg("points_mm"), py::arg("degree") = 3, py::kw_only(),
                  py::arg("count") = none, py::arg("parameters") = "chord",
                  (std::string(kInterpolateDoc) + "C: sgrt_nurbs_curve_interpolate").c_str())
      .def_property_readonly(
          "degree", [](const Curve& c) { return info_of(c).degree; }, "1 to 24.")
      .def_property_readonly(
          "rational", [](const Curve& c) { return info_of(c).rational != 0; }, "Whether weights differ.")
      .def_property_readonly(
          "domain",
          [](const Curve& c) {
            const auto i = info_of(c);
            return Domain(i.domain[0], i.domain[1]);
          },
          "(begin, end) of the parameter.")
      .def_property_readonly(
          "knots", [](const py::object& c) { return curve_array(c, SGRT_NURBS_KNOTS_U); }, "N + degree + 1.")
      .def_property_readonly(
          "control_points", [](const py::object& c) { return curve_array(c, SGRT_NURBS_CONTROL_POINTS); }, "N x 3, mm.")
      .def_property_readonly(
          "weights", [](const py::object& c) { return curve_array(c, SGRT_NURBS_WEIGHTS); }, "N, or None: all 1.")
      .def("evaluate", &curve_points, py::arg("u"), py::kw_only(), py::arg("clamp") = false, py::arg("context") = none,
           "Points at parameters of any shape: that shape x 3, mm. clamp: a parameter outside means the domain's end."
           "\n\nRaises InvalidArgument: outside the domain, NaN.\nC: sgrt_nurbs_curve_evaluate")
      .def("derivatives", &curve_derivatives, py::arg("u"), py::arg("order") = 2, py::kw_only(),
           py::arg("clamp") = false, py::arg("context") = none,
           "C, C', C'' ... up to `order`: shape of u x (order + 1) x 3.\n\nC: sgrt_nurbs_curve_evaluate")
      .def("closest_point", &curve_closest, py::arg("points_mm"), py::kw_only(), py::arg("context") = none,
           (std::string(kClosestDoc) + "C: sgrt_nurbs_curve_closest").c_str())
      .def("length", &length, py::arg("begin") = none, py::arg("end") = none,
           "Arc length, mm; all of it by default.\n\nC: sgrt_nurbs_curve_length")
      .def("refine", &refine_curve, py::arg("knots"),
           "With these knots added; the same shape.\n\nC: sgrt_nurbs_curve_refine")
      .def(
          "insert_knot", [](const Curve& c, double u, int32_t times) { return refine_curve(c, repeated(u, times)); },
          py::arg("u"), py::arg("times") = 1,
          "With knot u added `times` times; the same shape.\n\nC: sgrt_nurbs_curve_refine")
      .def(
          "bezier", [](const Curve& c) { return tool(c, sgrt_nurbs_curve_bezier); },
          "Every inner knot to multiplicity degree: control points i p to (i + 1) p are piece i.\n\nC: "
          "sgrt_nurbs_curve_bezier")
      .def("restrict", &restrict_curve, py::arg("begin"), py::arg("end"),
           "The part over [begin, end].\n\nC: sgrt_nurbs_curve_restrict")
      .def(
          "split",
          [](const Curve& c, double u) {
            const auto i = info_of(c);
            return std::pair(restrict_curve(c, i.domain[0], u), restrict_curve(c, u, i.domain[1]));
          },
          py::arg("u"), "(before u, after u).\n\nC: sgrt_nurbs_curve_restrict")
      .def(
          "elevate",
          [](const Curve& c, int32_t times) {
            return tool(c, [&](auto* x, auto** r) { return sgrt_nurbs_curve_elevate(x, times, r); });
          },
          py::arg("times") = 1, "The same shape with a higher degree.\n\nC: sgrt_nurbs_curve_elevate")
      .def(
          "remove_knot",
          [](const Curve& c, double u, int32_t times, double tolerance_mm) {
            int32_t count = 0;
            double bound = 0;
            Curve result = tool(c, [&](auto* x, auto** r) {
              return sgrt_nurbs_curve_remove_knot(x, u, times, tolerance_mm, r, &count, &bound);
            });
            return CurveBound(std::move(result), count, bound);
          },
          py::arg("u"), py::arg("times") = 1, py::kw_only(), py::arg("tolerance_mm") = 1e-9,
          "(curve, count, bound_mm): without knot u, as often as the curve moves by no more than tolerance_mm; it "
          "moved "
          "by no more than bound_mm.\n\nC: sgrt_nurbs_curve_remove_knot")
      .def(
          "reduce_degree",
          [](const Curve& c, double tolerance_mm) {
            int32_t count = 0;
            double bound = 0;
            Curve result = tool(c, [&](auto* x, auto** r) {
              return sgrt_nurbs_curve_reduce_degree(x, tolerance_mm, r, &count, &bound);
            });
            return CurveBound(std::move(result), count, bound);
          },
          py::kw_only(), py::arg("tolerance_mm") = 1e-9,
          "(curve, count, bound_mm): the degree one lower if the curve moves by no more than tolerance_mm, else count "
          "0.\n\nC: sgrt_nurbs_curve_reduce_degree")
      .def(
          "reparameterise",
          [](const Curve& c, double begin, double end) {
            return tool(c, [&](auto* x, auto** r) { return sgrt_nurbs_curve_reparameterise(x, begin, end, r); });
          },
          py::arg("begin"), py::arg("end"),
          "The same shape over [begin, end]; begin > end runs it backwards.\n\nC: sgrt_nurbs_curve_reparameterise")
      .def("__repr__",
           [](const Curve& c) {
             const auto i = info_of(c);
             return py::str("<sgrt.NurbsCurve degree {}, {} control points>").format(i.degree, i.count);
           })
      .def(py::pickle([](const Curve& c) { return text_of(c); }, &curve_from_json));
}

}  // namespace sgrt_py
