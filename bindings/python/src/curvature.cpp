// Curvature of curves and surfaces.
#include "nurbs.hpp"

namespace sgrt_py {
namespace {

struct Curvature {
  Owned<sgrt_curvature, sgrt_curvature_free> handle;
};

sgrt_curvature_info info_of(const Curvature& c) {
  sgrt_curvature_info info{};
  info.struct_size = sizeof info;
  run([&] { return sgrt_curvature_summary(c.handle.get(), &info); });
  return info;
}

template <class T>
py::array_t<T> array_of(const py::object& self, int32_t field) {
  sgrt_view view{};
  run([&] { return sgrt_curvature_array(self.cast<const Curvature&>().handle.get(), field, &view); });
  return *lend<T>(view, self);
}

Curvature compute(const Surface& surface, int32_t degree, double radius_mm, double max_radius_mm, double noise_mm,
                  double max_sigma_per_mm, Context* context) {
  auto options = defaults(sgrt_curvature_options_init);
  options.degree = degree;
  options.radius_mm = radius_mm;
  options.max_radius_mm = max_radius_mm;
  options.noise_mm = noise_mm;
  options.max_sigma_per_mm = max_sigma_per_mm;
  Curvature result;
  run(context,
      [&](sgrt_context* c) { return sgrt_curvature_compute(c, surface.handle.get(), &options, out(result.handle)); });
  return result;
}

py::dict features(const Surface& surface, const Curvature& curvature, double sigmas, Context* context) {
  py::array crest = out_array(std::nullopt, SGRT_U8, point_shape(surface.handle.get()));
  py::array persistence = out_array(std::nullopt, SGRT_F64, point_shape(surface.handle.get()));
  const sgrt_mut_view lines = out_view(crest, "crest", SGRT_U8);
  const sgrt_mut_view peaks = out_view(persistence, "persistence", SGRT_F64);
  run(context, [&](sgrt_context* c) {
    return sgrt_curvature_features(c, surface.handle.get(), curvature.handle.get(), sigmas, &lines, &peaks);
  });
  py::dict result;
  result["crest"] = crest;
  result["persistence"] = persistence;
  return result;
}

struct Plane {
  std::optional<Vec3> normal;
  explicit Plane(const MaybeArray& given) {
    if (given) normal.emplace(*given, "plane_normal");
  }
  const double* data() const { return normal ? normal->v : nullptr; }
};

py::dict of_points(const ArrayLike& points_mm, int32_t half_window, int32_t degree, bool closed, double sigma_mm,
                   const MaybeArray& plane_normal) {
  const InView points(points_mm, "points_mm", Accept::kFloats);
  const Plane plane(plane_normal);
  const py::ssize_t n = points.view.ndim > 0 ? points.view.shape[0] : 0;
  py::array curvature = out_array(std::nullopt, SGRT_F64, {n}), torsion = out_array(std::nullopt, SGRT_F64, {n});
  py::array sigma = out_array(std::nullopt, SGRT_F64, {n});
  const sgrt_mut_view views[] = {out_view(curvature, "curvature", SGRT_F64), out_view(torsion, "torsion", SGRT_F64),
                                 out_view(sigma, "sigma_curvature", SGRT_F64)};
  run([&] {
    return sgrt_curvature_points(&points.view, closed, half_window, degree, sigma_mm, plane.data(), &views[0],
                                 &views[1], &views[2]);
  });
  py::dict result;
  result["curvature"] = curvature;
  result["torsion"] = torsion;
  result["sigma_curvature"] = sigma;
  return result;
}

py::dict of_nurbs(const Nurbs& surface, const ArrayLike& uv, bool clamp, Context* context) {
  const InView in(uv, "uv", Accept::kFloats);
  const py::ssize_t n = in.view.ndim > 0 ? in.view.shape[0] : 0;
  auto samples = defaults(sgrt_curvature_samples_init);
  py::dict result;
  const auto want = [&](const char* name, sgrt_mut_view& view, int32_t dtype, const std::vector<py::ssize_t>& shape) {
    py::array array = out_array(std::nullopt, dtype, shape);
    view = out_view(array, name, dtype);
    result[name] = array;
  };
  want("k1", samples.k1, SGRT_F64, {n});
  want("k2", samples.k2, SGRT_F64, {n});
  want("mean", samples.mean, SGRT_F64, {n});
  want("gauss", samples.gauss, SGRT_F64, {n});
  want("shape_index", samples.shape_index, SGRT_F64, {n});
  want("curvedness", samples.curvedness, SGRT_F64, {n});
  want("normals", samples.normals, SGRT_F64, {n, 3});
  want("d1", samples.d1, SGRT_F64, {n, 3});
  want("d2", samples.d2, SGRT_F64, {n, 3});
  want("hk", samples.hk, SGRT_U8, {n});
  run(context, [&](sgrt_context* c) {
    return sgrt_curvature_nurbs_surface(c, surface.handle.get(), &in.view, outside_of(clamp), &samples);
  });
  return result;
}

py::dict of_nurbs_curve(const Curve& curve, const ArrayLike& u, const MaybeArray& plane_normal, bool clamp) {
  const InView in(u, "u", Accept::kFloats);
  const Plane plane(plane_normal);
  const py::ssize_t n = in.view.ndim > 0 ? in.view.shape[0] : 0;
  py::array curvature = out_array(std::nullopt, SGRT_F64, {n}), torsion = out_array(std::nullopt, SGRT_F64, {n});
  const sgrt_mut_view views[] = {out_view(curvature, "curvature", SGRT_F64), out_view(torsion, "torsion", SGRT_F64)};
  run([&] {
    return sgrt_curvature_nurbs_curve(curve.handle.get(), &in.view, outside_of(clamp), plane.data(), &views[0],
                                      &views[1]);
  });
  py::dict result;
  result["curvature"] = curvature;
  result["torsion"] = torsion;
  return result;
}

constexpr const char* kComputeDoc =
    R"(Curvature at every point of a surface (cloud, grid or mesh): a Curvature. 1/mm, normal outward, convex positive.

surface: with normals (estimate_normals; a mesh has them). degree: 2 to 4, of the local fit. radius_mm: of a point's neighbourhood; 0:
    chosen at each place where the predicted error is least, at most max_radius_mm. noise_mm: one sigma along the normal; 0: the
    surface's own, or measured. max_sigma_per_mm: where sigma of the mean curvature exceeds it, nothing is said.

Raises InvalidArgument: no normals, an option out of range. InsufficientData: not one point has curvature. Cancelled.
C: sgrt_curvature_compute)";

}  // namespace

void register_curvature(py::module_& m) {
  const auto o = defaults(sgrt_curvature_options_init);
  const auto none = py::none();
  py::class_<Curvature> cls(m, "Curvature",
                            R"(Result of surface_curvature. Arrays are N, or H x W as the surface; NaN where not known.

C: sgrt_curvature_summary, sgrt_curvature_array)");
  const auto number = [&cls](const char* name, int32_t field, const char* doc) {
    cls.def_property_readonly(
        name, [field](const py::object& self) { return array_of<double>(self, field); }, doc);
  };
  number("k1", SGRT_CURVATURE_K1, "Larger principal curvature, 1/mm, convex positive.");
  number("k2", SGRT_CURVATURE_K2, "Smaller principal curvature, 1/mm.");
  number("mean", SGRT_CURVATURE_MEAN, "H = (k1 + k2) / 2, 1/mm.");
  number("gauss", SGRT_CURVATURE_GAUSS, "K = k1 k2, 1/mm2.");
  number("shape_index", SGRT_CURVATURE_SHAPE_INDEX,
         "2/pi atan2(k1 + k2, k1 - k2): +1 a cap, -1 a cup; NaN on a plane.");
  number("curvedness", SGRT_CURVATURE_CURVEDNESS, "sqrt((k1^2 + k2^2) / 2), 1/mm.");
  number("sigma_k1", SGRT_CURVATURE_SIGMA_K1, "One sigma, noise and expected bias.");
  number("sigma_k2", SGRT_CURVATURE_SIGMA_K2, "One sigma, noise and expected bias.");
  number("sigma_mean", SGRT_CURVATURE_SIGMA_MEAN, "One sigma, noise and expected bias.");
  number("sigma_gauss", SGRT_CURVATURE_SIGMA_GAUSS, "One sigma, noise and expected bias.");
  number("sigma_shape_index", SGRT_CURVATURE_SIGMA_SHAPE_INDEX, "One sigma, noise and expected bias.");
  number("radius_mm", SGRT_CURVATURE_RADIUS, "Of the neighbourhood.");
  number("normals", SGRT_CURVATURE_NORMALS, "... x 3: of the fitted surface, outward.");
  number("d1", SGRT_CURVATURE_D1, "... x 3: direction of k1.");
  number("d2", SGRT_CURVATURE_D2, "... x 3: direction of k2.");
  cls.def_property_readonly(
         "hk", [](const py::object& self) { return array_of<uint8_t>(self, SGRT_CURVATURE_HK); },
         "uint8: signs of H and K: 1 flat, 2 peak, 3 pit, 4 ridge, 5 valley, 6 saddle ridge, 7 saddle valley, "
         "8 minimal, 0 unknown.")
      .def_property_readonly(
          "reason", [](const py::object& self) { return array_of<uint8_t>(self, SGRT_CURVATURE_REASON); },
          "uint8: 0 known, else why not: 1 absent, 2 no normal, 3 too few neighbours, 4 border or hole, 5 normals "
          "disagree, 6 not a sheet, 7 too noisy.")
      .def_property_readonly(
          "counts",
          [](const Curvature& c) {
            const auto i = info_of(c);
            py::dict d;
            for (int32_t k = 0; k < 8; ++k) d[sgrt_curvature_reason_word(k)] = i.reason_count[k];
            return d;
          },
          "Points by the word of their reason.\n\nC: sgrt_curvature_reason_word")
      .def_property_readonly(
          "known_count", [](const Curvature& c) { return info_of(c).known_count; }, "Points with curvature.")
      .def_property_readonly(
          "duplicate_count", [](const Curvature& c) { return info_of(c).duplicate_count; },
          "Points at the place of another.")
      .def_property_readonly(
          "spacing_mm", [](const Curvature& c) { return info_of(c).spacing_mm; }, "A point stands for its square.")
      .def_property_readonly(
          "noise_mm", [](const Curvature& c) { return info_of(c).noise_mm; },
          "One sigma along the normal that was used, the median.")
      .def("__repr__", [](const Curvature& c) {
        const auto i = info_of(c);
        return py::str("<sgrt.Curvature of {} points, {} known, noise {:.3g} mm>")
            .format(i.point_count, i.known_count, i.noise_mm);
      });

  m.def("surface_curvature", &compute, py::arg("surface"), py::kw_only(), py::arg("degree") = o.degree,
        py::arg("radius_mm") = o.radius_mm, py::arg("max_radius_mm") = o.max_radius_mm,
        py::arg("noise_mm") = o.noise_mm, py::arg("max_sigma_per_mm") = o.max_sigma_per_mm, py::arg("context") = none,
        kComputeDoc);
  m.def("curvature_features", &features, py::arg("surface"), py::arg("curvature"), py::kw_only(),
        py::arg("sigmas") = 3.0, py::arg("context") = none,
        R"(What stands out of the curvature of a surface: a dict of crest and persistence, N or H x W.

crest: uint8, 1 on a ridge, 2 in a valley. persistence: 1/mm, at maxima of H above 0 how far H falls before a higher one is reached, at
minima below 0 minus that, NaN elsewhere. sigmas: by how many of its own sigma a feature must stand out.

Raises InvalidArgument: curvature of another surface.
C: sgrt_curvature_features)");
  m.def(
      "nurbs_curvature", &of_nurbs, py::arg("surface"), py::arg("uv"), py::kw_only(), py::arg("clamp") = false,
      py::arg("context") = none,
      R"(Exact curvature of a NurbsSurface at N x 2 parameters: a dict of k1, k2, mean, gauss, shape_index, curvedness (N), normals, d1,
d2 (N x 3) and hk (uint8). 1/mm, normal S_u x S_v, convex positive; NaN at a pole.

Raises InvalidArgument: a parameter outside the domain.
C: sgrt_curvature_nurbs_surface)");
  m.def("curve_curvature", &of_nurbs_curve, py::arg("curve"), py::arg("u"), py::kw_only(),
        py::arg("plane_normal") = none, py::arg("clamp") = false,
        R"(Curvature and torsion of a NurbsCurve at N parameters: a dict of curvature and torsion, 1/mm.

plane_normal: signs the curvature, positive where the curve turns left as seen from its tip.

Raises InvalidArgument: a parameter outside the domain.
C: sgrt_curvature_nurbs_curve)");
  m.def(
      "points_curvature", &of_points, py::arg("points_mm"), py::kw_only(), py::arg("half_window") = 4,
      py::arg("degree") = 4, py::arg("closed") = false, py::arg("sigma_mm") = 0.0, py::arg("plane_normal") = none,
      R"(Curvature and torsion of N x 3 points sampled along a curve: a dict of curvature, torsion and sigma_curvature, 1/mm.

half_window: neighbours on each side that the polynomial of `degree` (3 to 6) is fitted to. sigma_mm: of each coordinate.

Raises InvalidArgument: fewer samples than unknowns. InsufficientData: fewer than degree + 1 points.
C: sgrt_curvature_points)");
}

}  // namespace sgrt_py
