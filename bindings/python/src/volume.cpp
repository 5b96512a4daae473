// Volume: the closed body of a CT or of stacked contours, and its skin.
#include <algorithm>
#include <iterator>
#include <limits>

#include "bindings.hpp"

namespace sgrt_py {
namespace {

constexpr const char* kFlags[] = {"cut", "contact", "closed", "no_edge"};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

using VolumeHandle = Owned<sgrt_volume, sgrt_volume_free>;

struct Volume {
  VolumeHandle handle;
  sgrt_volume_info info{};
};

Volume with_info(VolumeHandle handle) {
  Volume v{std::move(handle), {}};
  v.info.struct_size = sizeof v.info;
  run([&] { return sgrt_volume_summary(v.handle.get(), &v.info); });
  return v;
}

template <class T>
std::optional<py::array_t<T>> array_of(const py::object& self, int32_t field) {
  sgrt_view view{};
  run([&] { return sgrt_volume_array(self.cast<const Volume&>().handle.get(), field, &view); });
  return lend<T>(view, self);
}

Volume skin(const ArrayLike& voxels, const ArrayLike& frame_from_voxel, double rescale_slope, double rescale_intercept,
            std::optional<double> threshold_hu, double body_threshold_hu, double closing_mm,
            std::optional<double> smoothing_mm, std::optional<double> padding_hu, const ArrayLike& down,
            Context* context) {
  const InView view(voxels, "voxels", Accept::kVoxels);
  const Mat4 frame(frame_from_voxel, "frame_from_voxel");
  auto o = defaults(sgrt_volume_options_init);
  o.rescale_slope = rescale_slope;
  o.rescale_intercept = rescale_intercept;
  o.threshold_hu = threshold_hu.value_or(kNan);
  o.body_threshold_hu = body_threshold_hu;
  o.closing_mm = closing_mm;
  o.smoothing_mm = smoothing_mm.value_or(kNan);
  o.padding_hu = padding_hu.value_or(kNan);
  read_numbers(down, "down", {3}, o.down);
  VolumeHandle handle;
  run(context, [&](sgrt_context* c) { return sgrt_volume_skin(c, &view.view, frame.v, &o, out(handle)); });
  return with_info(std::move(handle));
}

Volume close(const std::vector<ArrayLike>& contours, double pixel_mm, double smoothing_mm, Context* context) {
  std::vector<double> points;
  std::vector<int32_t> lengths;
  for (std::size_t i = 0; i < contours.size(); ++i) {
    const std::string name = "contours[" + std::to_string(i) + "]";
    const py::array_t<double, py::array::c_style | py::array::forcecast> rows =
        py::reinterpret_borrow<py::object>(contours[i]);
    if (!rows) throw py::error_already_set();
    if (rows.ndim() != 2 || rows.shape(1) != 3) invalid(name + ": expected points x 3 numbers, mm");
    lengths.push_back(static_cast<int32_t>(rows.shape(0)));
    points.insert(points.end(), rows.data(), rows.data() + rows.size());
  }
  const auto n = static_cast<int64_t>(points.size() / 3);
  const sgrt_view p = sgrt_view_of(points.data(), SGRT_F64, n, 3, 0);
  const sgrt_view l = sgrt_view_of(lengths.data(), SGRT_I32, static_cast<int64_t>(lengths.size()), 0, 0);
  if (n == 0) invalid("contours: none, expected contours on 2 slices or more");
  auto o = defaults(sgrt_contours_options_init);
  o.pixel_mm = pixel_mm;
  o.smoothing_mm = smoothing_mm;
  VolumeHandle handle;
  run(context, [&](sgrt_context* c) { return sgrt_contours_close(c, &p, &l, &o, out(handle)); });
  return with_info(std::move(handle));
}

Surface surface(const Volume& volume, const std::vector<std::string>& without) {
  int32_t flags = 0;
  for (const std::string& word : without) {
    const auto* found = std::find(std::begin(kFlags), std::end(kFlags), word);
    if (found == std::end(kFlags)) invalid("without: '" + word + "', expected words of SKIN_FLAGS");
    flags |= 1 << (found - std::begin(kFlags));
  }
  Surface result;
  run([&] { return sgrt_volume_surface(volume.handle.get(), flags, out(result.handle)); });
  return result;
}

py::dict counts(const Volume& v) {
  py::dict counts;
  for (std::size_t i = 0; i < std::size(kFlags); ++i) counts[kFlags[i]] = v.info.flag_count[i];
  return counts;
}

constexpr const char* kSkinDoc =
    R"(The skin of a CT volume: couch removed, the largest body, airways closed, sub-voxel by the profile across each place.

voxels: slices x rows x columns, int16, uint16, uint8 or float32; not copied. frame_from_voxel: 4 x 4, mm, maps (column, row,
slice) to the frame wanted. rescale_slope, rescale_intercept: value = slope * stored + intercept, HU.
threshold_hu: where the skin lies; None: at each place half-way between the air outside and the tissue inside.
body_threshold_hu: what finds the body. closing_mm: air that a ball of this radius cannot reach from outside is inside.
smoothing_mm: radius of the quadric that smooths without shrinking; None: 2.5 mm or twice the coarsest spacing; 0: none.
padding_hu: value of voxels that were not scanned; None: all below -1100. down: towards the couch in the volume's frame,
(0, 1, 0) in DICOM coordinates of a supine patient; zeros: no couch is searched for.

Raises InvalidArgument: dtype, shape, an unfit matrix, an option out of range, a voxel that is NaN. NotFound: no body, or it
meets air nowhere. LimitError. Cancelled.
Source: docs/theory/volume.md. C: sgrt_volume_skin)";

constexpr const char* kCloseDoc =
    R"(A closed surface through planar contours on parallel slices; legs and arms branch by themselves.

contours: arrays of points x 3, mm, each closed by itself; one within another on its slice is a hole (even-odd rule).
pixel_mm: of the distance maps. smoothing_mm: 0: the surface goes through the contours.

Raises InvalidArgument: a contour of fewer than 3 points, not planar or not parallel (named). InsufficientData: all on one
slice. LimitError: choose a larger pixel_mm. Cancelled.
Source: docs/theory/volume.md (Raya and Udupa 1990). C: sgrt_contours_close)";

}  // namespace

void register_volume(py::module_& m) {
  const auto d = defaults(sgrt_volume_options_init);
  const auto c = defaults(sgrt_contours_options_init);
  py::tuple words(std::size(kFlags));
  for (std::size_t i = 0; i < std::size(kFlags); ++i) words[i] = kFlags[i];
  m.attr("SKIN_FLAGS") = words;

  py::class_<Volume>(m, "Volume",
                     R"(A closed body with the skin round it. Array properties are read-only views of its memory.

C: sgrt_volume_summary, sgrt_volume_array)")
      .def("surface", &surface, py::arg("without") = words,
           R"(The part of the mesh whose vertices have none of these flags (words of SKIN_FLAGS), as a Surface.

The default leaves measured skin alone; () gives the closed body. Raises NotFound: nothing is left.
C: sgrt_volume_surface)")
      .def_property_readonly(
          "points", [](const py::object& self) { return *array_of<double>(self, SGRT_VOLUME_POINTS); },
          "N x 3: vertices of the closed mesh, mm.")
      .def_property_readonly(
          "normals", [](const py::object& self) { return *array_of<double>(self, SGRT_VOLUME_NORMALS); },
          "N x 3: unit, outward.")
      .def_property_readonly(
          "faces", [](const py::object& self) { return *array_of<int32_t>(self, SGRT_VOLUME_FACES); },
          "M x 3: vertex indices, counter-clockwise seen from outside.")
      .def_property_readonly(
          "sigma_mm", [](const py::object& self) { return array_of<double>(self, SGRT_VOLUME_SIGMA); },
          "N: one sigma along the normal, mm, NaN where flagged; None without smoothing and for contours.")
      .def_property_readonly(
          "bias_mm", [](const py::object& self) { return *array_of<double>(self, SGRT_VOLUME_BIAS); },
          "N: expected distance of the vertex outside (+) the true skin, mm.")
      .def_property_readonly(
          "flags", [](const py::object& self) { return *array_of<uint8_t>(self, SGRT_VOLUME_FLAGS); },
          "N: bit i is set where SKIN_FLAGS[i] holds; 0: measured skin.")
      .def_property_readonly("counts", &counts, "Vertices by the words of SKIN_FLAGS.")
      .def_property_readonly(
          "couch_found", [](const Volume& v) { return v.info.couch_found != 0; }, "A couch was found and cut away.")
      .def_property_readonly(
          "volume_mm3", [](const Volume& v) { return v.info.volume_mm3; }, "Of the closed mesh.")
      .def_property_readonly(
          "mean_bias_mm", [](const Volume& v) { return v.info.bias_mm; }, "Mean of bias_mm where unflagged.")
      .def_property_readonly(
          "median_sigma_mm", [](const Volume& v) { return v.info.sigma_mm; }, "Median of sigma_mm where unflagged.")
      .def_property_readonly(
          "contrast_hu", [](const Volume& v) { return v.info.contrast_hu; },
          "Median of tissue minus air, HU; NaN for contours.")
      .def_property_readonly(
          "slice_count", [](const Volume& v) { return v.info.slice_count; }, "Slices that went in.")
      .def_property_readonly(
          "slice_spacing_mm", [](const Volume& v) { return v.info.slice_spacing_mm; }, "Median distance of slices.")
      .def_property_readonly(
          "largest_gap_mm", [](const Volume& v) { return v.info.largest_gap_mm; }, "Largest distance of two slices.")
      .def("__repr__", [](const Volume& v) {
        return py::str("<sgrt.Volume {} vertices, {} faces, {:.1f} litres>")
            .format(v.info.vertex_count, v.info.face_count, v.info.volume_mm3 * 1e-6);
      });

  m.def("volume_skin", &skin, py::arg("voxels"), py::arg("frame_from_voxel"), py::kw_only(),
        py::arg("rescale_slope") = d.rescale_slope, py::arg("rescale_intercept") = d.rescale_intercept,
        py::arg("threshold_hu") = py::none(), py::arg("body_threshold_hu") = d.body_threshold_hu,
        py::arg("closing_mm") = d.closing_mm, py::arg("smoothing_mm") = py::none(), py::arg("padding_hu") = py::none(),
        py::arg("down") = py::make_tuple(d.down[0], d.down[1], d.down[2]), py::arg("context") = py::none(), kSkinDoc);
  m.def("contours_close", &close, py::arg("contours"), py::kw_only(), py::arg("pixel_mm") = c.pixel_mm,
        py::arg("smoothing_mm") = c.smoothing_mm, py::arg("context") = py::none(), kCloseDoc);
}

}  // namespace sgrt_py
