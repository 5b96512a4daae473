// The fit: a smooth surface through scattered points, with its posterior.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

constexpr const char* kCharts[] = {"auto", "plane", "cylinder", "sphere", "grid"};
constexpr const char* kSmoothings[] = {"reml", "gcv", "given"};

struct NurbsFit {
  std::shared_ptr<sgrt_nurbs_fit> handle;
  sgrt_nurbs_fit_info info{};
};

struct Samples {
  Doubles points, normals, sigma_mm, support, covariance, normal_covariance, derivatives, derivative_covariance;
};

template <size_t N>
int32_t index_of(const char* const (&words)[N], const std::string& word, const char* name) {
  std::string known;
  for (size_t i = 0; i < N; ++i) {
    if (word == words[i]) return static_cast<int32_t>(i);
    known += (i ? ", '" : "'") + std::string(words[i]) + "'";
  }
  invalid(std::string(name) + ": '" + word + "', expected one of " + known);
}

NurbsFit fit_of(sgrt_nurbs_fit* raw) {
  NurbsFit result{std::shared_ptr<sgrt_nurbs_fit>(raw, sgrt_nurbs_fit_free)};
  result.info.struct_size = sizeof result.info;
  run([&] { return sgrt_nurbs_fit_summary(raw, &result.info); });
  return result;
}

NurbsFit fit(const Surface& surface, const std::string& chart, const MaybeArray& axis, bool robust,
             const std::string& smoothing, double lambda, std::pair<int32_t, int32_t> control_points,
             int32_t max_control_points, double tukey, Context* context) {
  auto o = defaults(sgrt_nurbs_fit_options_init);
  o.chart = index_of(kCharts, chart, "chart");
  o.smoothing = index_of(kSmoothings, smoothing, "smoothing");
  o.robust = robust;
  if (axis) {
    read_numbers(*axis, "axis", {3}, o.axis);
    if (o.axis[0] == 0 && o.axis[1] == 0 && o.axis[2] == 0) invalid("axis: 0 0 0, expected a direction, or None");
  }
  o.control_points[0] = control_points.first;
  o.control_points[1] = control_points.second;
  o.max_control_points = max_control_points;
  o.lambda = lambda;
  o.tukey = tukey;
  sgrt_nurbs_fit* raw = nullptr;
  run(context, [&](sgrt_context* c) { return sgrt_nurbs_fit_create(c, surface.handle.get(), &o, &raw); });
  return fit_of(raw);
}

// The arrays keep the fit alive.
Doubles array_of(const NurbsFit& f, int32_t field) {
  sgrt_view view{};
  run([&] { return sgrt_nurbs_fit_array(f.handle.get(), field, &view); });
  const py::capsule base(new std::shared_ptr<sgrt_nurbs_fit>(f.handle),
                         [](void* raw) { delete static_cast<std::shared_ptr<sgrt_nurbs_fit>*>(raw); });
  return lend<double>(view, base).value();
}

Nurbs surface_of(const NurbsFit& f) {
  Nurbs surface;
  run([&] { return sgrt_nurbs_fit_surface(f.handle.get(), out(surface.handle)); });
  return surface;
}

Doubles state_of(const NurbsFit& f) {
  int64_t count = 0;
  run([&] { return sgrt_nurbs_fit_state(f.handle.get(), nullptr, &count); });
  Doubles numbers(static_cast<py::ssize_t>(count));
  const sgrt_mut_view view = out_view(numbers, "numbers", SGRT_F64);
  run([&] { return sgrt_nurbs_fit_state(f.handle.get(), &view, nullptr); });
  return numbers;
}

NurbsFit from_state(const Doubles& numbers) {
  const InView in(numbers, "numbers", Accept::kFloats);
  sgrt_nurbs_fit* raw = nullptr;
  run([&] { return sgrt_nurbs_fit_from_state(&in.view, &raw); });
  return fit_of(raw);
}

Samples evaluate(const NurbsFit& f, const ArrayLike& uv, Context* context) {
  const InView at(uv, "uv", Accept::kFloats);
  const py::ssize_t n = at.view.ndim > 0 ? static_cast<py::ssize_t>(at.view.shape[0]) : 0;
  auto s = defaults(sgrt_nurbs_fit_samples_init);
  Samples r;
  const auto wanted = [](Doubles& array, sgrt_mut_view& view, const std::vector<py::ssize_t>& shape) {
    array = Doubles(shape);
    view = out_view(array, "samples", SGRT_F64);
  };
  wanted(r.points, s.points, {n, 3});
  wanted(r.normals, s.normals, {n, 3});
  wanted(r.sigma_mm, s.sigma_mm, {n});
  wanted(r.support, s.support, {n});
  wanted(r.covariance, s.covariance, {n, 6});
  wanted(r.normal_covariance, s.normal_covariance, {n, 6});
  wanted(r.derivatives, s.derivatives, {n, 5, 3});
  wanted(r.derivative_covariance, s.derivative_covariance, {n, 5, 6});
  run(context, [&](sgrt_context* c) { return sgrt_nurbs_fit_evaluate(c, f.handle.get(), &at.view, &s); });
  return r;
}

Doubles nearest(const NurbsFit& f, const ArrayLike& points, Context* context) {
  const InView x(points, "points", Accept::kFloats);
  const py::ssize_t n = x.view.ndim > 0 ? static_cast<py::ssize_t>(x.view.shape[0]) : 0;
  Doubles uv({n, py::ssize_t{2}});
  const sgrt_mut_view view = out_view(uv, "uv", SGRT_F64);
  run(context, [&](sgrt_context* c) { return sgrt_nurbs_fit_nearest(c, f.handle.get(), &x.view, &view); });
  return uv;
}

constexpr const char* kFitDoc =
    R"(A smooth surface through scattered points with noise, holes and outliers, and how sure it is: a NurbsFit.

Cubic B-splines by penalised robust least squares: sum w (r / sigma)^2 + lambda_ * bending energy. surface: at least 16 points; its
sigma_mm or covariance weigh them, without them sigma is estimated.
chart: what u and v run over: 'plane' (a height field), 'cylinder' (a torso), 'sphere' (a head), 'grid' (an organised surface), 'auto'.
axis: 3 numbers, of the height field (outward) or the cylinder; None: estimated. robust: outliers do not count.
smoothing: 'reml', 'gcv', or 'given' by lambda_. control_points: in u and v; 0: from the density. max_control_points: where they are
    chosen. tukey: residuals beyond so many sigma do not count.

Raises InsufficientData: fewer than 16 points, or points over correlation_points fewer than 4. Degenerate: points on a line, unfit for
the chart, or a sigma less than a millionth of the usual one. InvalidArgument. LimitError. Cancelled.
C: sgrt_nurbs_fit_create)";

}  // namespace

void register_nurbs_fit(py::module_& m) {
  const auto d = defaults(sgrt_nurbs_fit_options_init);
  const auto none = py::none();

  py::class_<Samples>(m, "NurbsFitSamples",
                      R"(A fitted surface and its posterior at N places, float64.

C: sgrt_nurbs_fit_samples)")
      .def_readonly("points", &Samples::points, "N x 3, mm.")
      .def_readonly("normals", &Samples::normals, "N x 3, unit, outward.")
      .def_readonly("sigma_mm", &Samples::sigma_mm,
                    "N: one sigma of the surface along its normal, bias by smoothing included.")
      .def_readonly("support", &Samples::support,
                    "N: 1 with points all round, 0 with none near; below 0.5 extrapolated.")
      .def_readonly("covariance", &Samples::covariance, "N x 6: of the point, xx xy xz yy yz zz, mm2.")
      .def_readonly("normal_covariance", &Samples::normal_covariance, "N x 6: of the normal.")
      .def_readonly("derivatives", &Samples::derivatives, "N x 5 x 3: S_u S_v S_uu S_uv S_vv, mm.")
      .def_readonly("derivative_covariance", &Samples::derivative_covariance, "N x 5 x 6, mm2.");

  py::class_<NurbsFit>(m, "NurbsFit",
                       R"(A fitted surface. Immutable; pickles.

C: sgrt_nurbs_fit_summary, sgrt_nurbs_fit_array, sgrt_nurbs_fit_surface, sgrt_nurbs_fit_state)")
      .def_property_readonly(
          "chart", [](const NurbsFit& f) { return std::string(kCharts[f.info.chart]); },
          "The chart that was used: 'plane', ...")
      .def_property_readonly(
          "closed", [](const NurbsFit& f) { return f.info.closed != 0; }, "Whether it goes all round in u.")
      .def_property_readonly(
          "point_count", [](const NurbsFit& f) { return f.info.point_count; }, "Points that were there.")
      .def_property_readonly(
          "inlier_count", [](const NurbsFit& f) { return f.info.inlier_count; }, "Points with a weight above 0.")
      .def_property_readonly(
          "iterations", [](const NurbsFit& f) { return f.info.iterations; }, "Solutions with new weights.")
      .def_property_readonly(
          "lambda_", [](const NurbsFit& f) { return f.info.lambda; }, "Weight of the bending energy.")
      .def_property_readonly(
          "effective_parameters", [](const NurbsFit& f) { return f.info.effective_parameters; },
          "Trace of the smoother.")
      .def_property_readonly(
          "noise", [](const NurbsFit& f) { return f.info.noise; },
          "Estimated sigma along the normal: in units of the points' own; mm where they have none.")
      .def_property_readonly(
          "rms_mm", [](const NurbsFit& f) { return f.info.rms_mm; }, "Of the inliers' distances along the normal.")
      .def_property_readonly(
          "conversion_error_mm", [](const NurbsFit& f) { return f.info.conversion_error_mm; },
          "Largest difference found between the surface and the model on its chart.")
      .def_property_readonly(
          "residual_mm", [](const NurbsFit& f) { return array_of(f, SGRT_NURBS_FIT_RESIDUAL); },
          "N or H x W: along the normal, positive outside; NaN where absent.")
      .def_property_readonly(
          "weight", [](const NurbsFit& f) { return array_of(f, SGRT_NURBS_FIT_WEIGHT); },
          "N or H x W: robust weight, 0 (outlier) to 1.")
      .def_property_readonly(
          "parameters", [](const NurbsFit& f) { return array_of(f, SGRT_NURBS_FIT_PARAMETERS); },
          "N x 2 or H x W x 2: u, v of each point.")
      .def_property_readonly("surface", &surface_of, "The fitted NurbsSurface, clamped on [0, 1] x [0, 1].")
      .def("evaluate", &evaluate, py::arg("uv"), py::kw_only(), py::arg("context") = none,
           R"(The surface and its posterior at parameters uv (N x 2, each in [0, 1]): NurbsFitSamples.

Raises InvalidArgument: a parameter outside or not finite. Cancelled.
C: sgrt_nurbs_fit_evaluate)")
      .def("nearest", &nearest, py::arg("points"), py::kw_only(), py::arg("context") = none,
           R"(Parameters (N x 2) of the surface points nearest to points (N x 3, mm) that lie near it.

Raises InvalidArgument: a point that is not finite. Cancelled.
C: sgrt_nurbs_fit_nearest)")
      .def("__repr__",
           [](const NurbsFit& f) {
             return "NurbsFit(" + std::string(kCharts[f.info.chart]) + ", " + std::to_string(f.info.control_points[0]) +
                    " x " + std::to_string(f.info.control_points[1]) + " control points)";
           })
      .def(py::pickle(&state_of, &from_state));

  m.def("nurbs_fit", &fit, kFitDoc, py::arg("surface"), py::kw_only(), py::arg("chart") = kCharts[d.chart],
        py::arg("axis") = none, py::arg("robust") = d.robust != 0, py::arg("smoothing") = kSmoothings[d.smoothing],
        py::arg("lambda_") = d.lambda,
        py::arg("control_points") = std::pair<int32_t, int32_t>(d.control_points[0], d.control_points[1]),
        py::arg("max_control_points") = d.max_control_points, py::arg("tukey") = d.tukey, py::arg("context") = none);
}

}  // namespace sgrt_py
