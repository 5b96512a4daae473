// Surface: made from arrays, its arrays lent read-only, normals, fusion, signed distance.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

sgrt_surface_info info_of(const Surface& surface) {
  sgrt_surface_info info{};
  info.struct_size = sizeof info;
  run([&] { return sgrt_surface_summary(surface.handle.get(), &info); });
  return info;
}

template <class T>
std::optional<py::array_t<T>> array_of(const py::object& self, int32_t field) {
  const auto& surface = self.cast<const Surface&>();
  sgrt_view view{};
  run([&] { return sgrt_surface_array(surface.handle.get(), field, &view); });
  return lend<T>(view, self);
}

Surface from_arrays(const ArrayLike& points, const MaybeArray& normals, const MaybeArray& sigma_mm,
                    const MaybeArray& covariance, const MaybeArray& faces, const MaybeArray& modes,
                    double correlation_points, Context* context) {
  const InView views[] = {{points, "points", Accept::kFloats},     {normals, "normals", Accept::kFloats},
                          {sigma_mm, "sigma_mm", Accept::kFloats}, {covariance, "covariance", Accept::kFloats},
                          {faces, "faces", Accept::kIndices},      {modes, "modes", Accept::kFloats}};
  auto data = defaults(sgrt_surface_data_init);
  data.points = views[0].view;
  data.normals = views[1].view;
  data.sigma_mm = views[2].view;
  data.covariance = views[3].view;
  data.faces = views[4].view;
  data.modes = views[5].view;
  data.correlation_points = correlation_points;
  Surface surface;
  run(context, [&](sgrt_context* c) { return sgrt_surface_create(c, &data, out(surface.handle)); });
  return surface;
}

Surface from_height_field(const ArrayLike& z_mm, const ArrayLike& origin_mm, const ArrayLike& spacing_mm,
                          Context* context) {
  const InView z(z_mm, "z_mm", Accept::kFloats);
  double origin[2], spacing[2];
  read_numbers(origin_mm, "origin_mm", {2}, origin);
  read_numbers(spacing_mm, "spacing_mm", {2}, spacing);
  Surface surface;
  run(context, [&](sgrt_context* c) {
    return sgrt_surface_from_height_field(c, &z.view, origin, spacing, out(surface.handle));
  });
  return surface;
}

Surface estimate_normals(const Surface& surface, int32_t neighbours, const ArrayLike& viewpoint_mm, double radius_mm,
                         Context* context) {
  auto options = defaults(sgrt_surface_normals_options_init);
  options.neighbours = neighbours;
  read_numbers(viewpoint_mm, "viewpoint_mm", {3}, options.viewpoint_mm);
  options.radius_mm = radius_mm;
  Surface result;
  run(context, [&](sgrt_context* c) {
    return sgrt_surface_estimate_normals(c, surface.handle.get(), &options, out(result.handle));
  });
  return result;
}

Surface moved(const Surface& surface, const ArrayLike& pose, Context* context) {
  const Mat4 motion(pose, "pose");
  Surface result;
  run(context,
      [&](sgrt_context* c) { return sgrt_surface_move(c, surface.handle.get(), motion.v, out(result.handle)); });
  return result;
}

struct FuseInfo {
  int32_t surface_count;
  int64_t point_count, overlap_count;
  double disagreement_mean_mm, disagreement_rms_mm, disagreement_expected_mm;
};

std::pair<Surface, FuseInfo> fuse(const std::vector<const Surface*>& surfaces, double max_distance_mm,
                                  double max_angle_deg, Context* context) {
  std::vector<const sgrt_surface*> handles;
  for (const Surface* surface : surfaces) handles.push_back(surface ? surface->handle.get() : nullptr);
  auto options = defaults(sgrt_surface_fuse_options_init);
  options.max_distance_mm = max_distance_mm;
  options.max_angle_deg = max_angle_deg;
  sgrt_surface_fuse_info info{};
  info.struct_size = sizeof info;
  Surface result;
  run(context, [&](sgrt_context* c) {
    return sgrt_surface_fuse(c, handles.data(), static_cast<int32_t>(handles.size()), &options, out(result.handle),
                             &info);
  });
  return {std::move(result),
          FuseInfo{info.surface_count, info.point_count, info.overlap_count, info.disagreement_mean_mm,
                   info.disagreement_rms_mm, info.disagreement_expected_mm}};
}

Doubles distance(const Surface& reference, const Surface& live, const MaybeArray& reference_from_live,
                 double max_distance_mm, const std::optional<py::array>& given, Context* context) {
  std::optional<Mat4> pose;
  if (reference_from_live) pose.emplace(*reference_from_live, "reference_from_live");
  auto options = defaults(sgrt_surface_distance_options_init);
  options.max_distance_mm = max_distance_mm;
  py::array result = out_array(given, SGRT_F64, point_shape(live.handle.get()));
  const sgrt_mut_view view = out_view(result, "out", SGRT_F64);
  run(context, [&](sgrt_context* c) {
    return sgrt_surface_distance(c, reference.handle.get(), live.handle.get(), pose ? pose->v : nullptr, &options,
                                 &view);
  });
  return py::reinterpret_borrow<Doubles>(result);
}

std::string repr(const py::object& self) {
  const auto info = info_of(self.cast<const Surface&>());
  std::string text = "<sgrt.Surface ";
  if (info.height) text += "grid " + std::to_string(info.height) + " x " + std::to_string(info.width) + ", ";
  text += std::to_string(info.point_count) + " points";
  if (info.face_count) text += ", " + std::to_string(info.face_count) + " faces";
  for (const char* name : {"normals", "sigma_mm", "covariance", "modes"}) {
    if (!self.attr(name).is_none()) text += std::string(", ") + name;
  }
  return text + ">";
}

constexpr const char* kArrays[] = {"points", "normals", "sigma_mm", "covariance", "faces", "modes"};

py::dict state_of(const py::object& self) {
  py::dict state;
  for (const char* name : kArrays) state[name] = self.attr(name);
  state["correlation_points"] = self.attr("correlation_points");
  return state;
}

Surface from_state(const py::dict& state) {
  const auto array = [&](const char* name) -> MaybeArray {
    const py::object value = state[name];
    return value.is_none() ? MaybeArray() : MaybeArray(py::reinterpret_borrow<ArrayLike>(value));
  };
  return from_arrays(*array("points"), array("normals"), array("sigma_mm"), array("covariance"), array("faces"),
                     array("modes"), state["correlation_points"].cast<double>(), nullptr);
}

constexpr const char* kSurfaceDoc =
    R"(Points of a skin with what is known of each: a cloud, an organised grid or a triangle mesh. Immutable.

points: N x 3, or H x W x 3 as a sensor sees it, mm, room frame; in a grid an absent point is NaN in all three.
normals: like points, unit, outward (towards the sensor). A mesh without them gets area-weighted vertex normals.
sigma_mm: N or H x W, one sigma along the normal, > 0.
covariance: N x 6 or H x W x 6, xx xy xz yy yz zz, mm2, positive semi-definite.
faces: M x 3 int32, counter-clockwise seen from outside; only with N x 3 points.
modes: K x N x 3 or K x H x W x 3, K <= 8, shared error modes, mm at one sigma.
correlation_points: how many neighbouring points share one noise sample; 1: independent points.

Floats are float32 or float64 with any strides; they are copied once, into float64. The array properties are read-only
views of the surface's own memory, None where absent; they keep the surface alive. Surfaces pickle.

Raises InvalidArgument: shape, dtype; a NaN or Inf (absent grid points excepted); |coordinate| > 1e5 mm; sigma <= 0; a normal
    that is not unit within 1e-3; a face index out of range. InsufficientData: no point. LimitError: above 50 million points
    or 4 GiB.
C: sgrt_surface_create, sgrt_surface_array, sgrt_surface_summary)";

constexpr const char* kHeightFieldDoc =
    R"(A height field z(x, y) as an organised grid; normals point to +z.

z_mm: H x W, mm, NaN where absent. origin_mm, spacing_mm: 2 numbers each, mm: column j lies at x = origin[0] + j spacing[0],
row i at y = origin[1] + i spacing[1].

Raises as Surface; InvalidArgument also for a spacing that is 0.
C: sgrt_surface_from_height_field)";

constexpr const char* kNormalsDoc =
    R"(The surface with normals from a local fit, the plane of the nearest neighbours and then a quadric over it; all other arrays
are kept.

neighbours: points of the fit, 6 to 200. viewpoint_mm: 3 numbers, room frame; the normals of a cloud turn towards it.
radius_mm: neighbours further than this do not count. A point whose neighbours fix no plane (fewer
than 6 in reach, or on a line) gets a NaN normal.

Raises InsufficientData: fewer than 6 points. InvalidArgument: an option out of range. Cancelled.
C: sgrt_surface_estimate_normals)";

constexpr const char* kFuseDoc =
    R"(Fuses surfaces of one frame (the pods of a room) into one cloud with normals: (surface, info).

surfaces: 1 to 64, each with normals. Where they overlap a point moves along its normal to the covariance-weighted mean, and
the doubled point of the later surface is dropped. max_distance_mm, max_angle_deg: beyond them two points are not the same skin.

Raises InvalidArgument: no surface, more than 64, one without normals. Cancelled.
C: sgrt_surface_fuse)";

constexpr const char* kDistanceDoc =
    R"(The signed distance map: each live point's distance to the reference along the reference's normal, mm, positive outside.

reference: needs normals. reference_from_live: 4 x 4, moves live first; None: where it is. max_distance_mm: beyond it there is
no correspondence. out: float64 array to write into, N or H x W as live; it is returned. NaN: no correspondence (too far, or
past the border of the reference).

Raises InvalidArgument: a pose that is not rigid, a reference without normals, an unfit `out`. Cancelled.
C: sgrt_surface_distance)";

}  // namespace

std::vector<py::ssize_t> point_shape(const sgrt_surface* surface) {
  sgrt_surface_info info{};
  info.struct_size = sizeof info;
  run([&] { return sgrt_surface_summary(surface, &info); });
  if (info.height) return {info.height, info.width};
  return {info.point_count};
}

void register_surface(py::module_& m) {
  const auto data = defaults(sgrt_surface_data_init);
  const auto normals = defaults(sgrt_surface_normals_options_init);
  const auto fusion = defaults(sgrt_surface_fuse_options_init);
  const auto map = defaults(sgrt_surface_distance_options_init);
  const double* eye = normals.viewpoint_mm;

  py::class_<Surface>(m, "Surface", kSurfaceDoc)
      .def(py::init(&from_arrays), py::arg("points"), py::kw_only(), py::arg("normals") = py::none(),
           py::arg("sigma_mm") = py::none(), py::arg("covariance") = py::none(), py::arg("faces") = py::none(),
           py::arg("modes") = py::none(), py::arg("correlation_points") = data.correlation_points,
           py::arg("context") = py::none())
      .def_static("from_height_field", &from_height_field, py::arg("z_mm"), py::kw_only(), py::arg("origin_mm"),
                  py::arg("spacing_mm"), py::arg("context") = py::none(), kHeightFieldDoc)
      .def("estimate_normals", &estimate_normals, py::kw_only(), py::arg("neighbours") = normals.neighbours,
           py::arg("viewpoint_mm") = py::make_tuple(eye[0], eye[1], eye[2]), py::arg("radius_mm") = normals.radius_mm,
           py::arg("context") = py::none(), kNormalsDoc)
      .def_property_readonly(
          "points", [](const py::object& self) { return *array_of<double>(self, SGRT_SURFACE_POINTS); },
          "N x 3 or H x W x 3, mm; NaN where a grid point is absent.")
      .def("moved", &moved, py::arg("pose"), py::kw_only(), py::arg("context") = py::none(),
           R"(The surface under a rigid motion x -> R x + t: points, normals, covariance and modes; all else is kept.

pose: 4 x 4, mm; for another couch angle frames.couch_turn.

Raises InvalidArgument: not a rigid motion within 1e-6.
C: sgrt_surface_move)")
      .def_property_readonly(
          "normals", [](const py::object& self) { return array_of<double>(self, SGRT_SURFACE_NORMALS); },
          "Like points: unit, outward; or None.")
      .def_property_readonly(
          "sigma_mm", [](const py::object& self) { return array_of<double>(self, SGRT_SURFACE_SIGMA); },
          "N or H x W: one sigma along the normal, mm; or None.")
      .def_property_readonly(
          "covariance", [](const py::object& self) { return array_of<double>(self, SGRT_SURFACE_COVARIANCE); },
          "N x 6 or H x W x 6: xx xy xz yy yz zz, mm2; or None.")
      .def_property_readonly(
          "faces", [](const py::object& self) { return array_of<int32_t>(self, SGRT_SURFACE_FACES); },
          "M x 3: vertex indices, counter-clockwise seen from outside; or None.")
      .def_property_readonly(
          "modes", [](const py::object& self) { return array_of<double>(self, SGRT_SURFACE_MODES); },
          "K x N x 3 or K x H x W x 3: shared error modes, mm at one sigma; or None.")
      .def_property_readonly(
          "correlation_points", [](const Surface& s) { return info_of(s).correlation_points; },
          "How many neighbouring points share one noise sample.")
      .def_property_readonly(
          "point_count", [](const Surface& s) { return info_of(s).point_count; }, "Points present.")
      .def_property_readonly(
          "grid_shape",
          [](const Surface& s) -> std::optional<std::pair<int64_t, int64_t>> {
            const auto info = info_of(s);
            if (!info.height) return std::nullopt;
            return std::make_pair(info.height, info.width);
          },
          "(H, W) of an organised grid, None for a cloud or a mesh.")
      .def_property_readonly(
          "bounds_mm",
          [](const Surface& s) {
            const auto info = info_of(s);
            return std::make_pair(fixed_array(info.bounds_min_mm, {3}), fixed_array(info.bounds_max_mm, {3}));
          },
          "(min, max), 3 numbers each, mm.")
      .def("__repr__", &repr)
      .def(py::pickle(&state_of, &from_state));

  py::class_<FuseInfo>(m, "FuseInfo", "What a fusion found.\n\nC: sgrt_surface_fuse_info")
      .def_readonly("surface_count", &FuseInfo::surface_count, "Surfaces that went in.")
      .def_readonly("point_count", &FuseInfo::point_count, "Points of the fused surface.")
      .def_readonly("overlap_count", &FuseInfo::overlap_count, "Points seen by more than one surface.")
      .def_readonly(
          "disagreement_mean_mm", &FuseInfo::disagreement_mean_mm,
          "Mean signed distance along the normal in the overlap, later surface minus first; NaN without overlap.")
      .def_readonly("disagreement_rms_mm", &FuseInfo::disagreement_rms_mm,
                    "Its RMS: the daily check of a room; NaN without overlap.")
      .def_readonly("disagreement_expected_mm", &FuseInfo::disagreement_expected_mm,
                    "The RMS that the points' own sigma predict; NaN without sigma.")
      .def("__repr__", [](const FuseInfo& f) {
        return py::str("<sgrt.FuseInfo {} surfaces, {} points, {} in the overlap, disagreement {:.3f} mm RMS>")
            .format(f.surface_count, f.point_count, f.overlap_count, f.disagreement_rms_mm);
      });

  m.def("surface_fuse", &fuse, py::arg("surfaces"), py::kw_only(), py::arg("max_distance_mm") = fusion.max_distance_mm,
        py::arg("max_angle_deg") = fusion.max_angle_deg, py::arg("context") = py::none(), kFuseDoc);
  m.def("surface_distance", &distance, py::arg("reference"), py::arg("live"),
        py::arg("reference_from_live") = py::none(), py::kw_only(), py::arg("max_distance_mm") = map.max_distance_mm,
        py::arg("out") = py::none(), py::arg("context") = py::none(), kDistanceDoc);
}

}  // namespace sgrt_py
