// Region of interest: a polygon seen from above, or a box.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

Doubles frozen_copy(const InView& source) {
  Doubles copy(py::array(source.keep.attr("astype")("f8")));
  copy.attr("setflags")(py::arg("write") = false);
  return copy;
}

Roi polygon(const ArrayLike& vertices_xy_mm) {
  const InView vertices(vertices_xy_mm, "vertices_xy_mm", Accept::kFloats);
  Roi roi;
  run([&] { return sgrt_roi_from_polygon(&vertices.view, out(roi.handle)); });
  roi.polygon_xy_mm = frozen_copy(vertices);
  return roi;
}

Roi box(const ArrayLike& min_mm, const ArrayLike& max_mm) {
  const Vec3 low(min_mm, "min_mm"), high(max_mm, "max_mm");
  Roi roi;
  run([&] { return sgrt_roi_from_box(low.v, high.v, out(roi.handle)); });
  const double both[6] = {low.v[0], low.v[1], low.v[2], high.v[0], high.v[1], high.v[2]};
  roi.box_mm = fixed_array(both, {2, 3});
  return roi;
}

Roi moved(const Roi& roi, const ArrayLike& pose) {
  const Mat4 motion(pose, "pose");
  Roi result;
  run([&] { return sgrt_roi_move(roi.handle.get(), motion.v, out(result.handle)); });
  const auto copy = [&](int32_t field, std::vector<py::ssize_t> shape) -> std::optional<Doubles> {
    sgrt_view view{};
    run([&] { return sgrt_roi_array(result.handle.get(), field, &view); });
    if (!view.data) return std::nullopt;
    shape[0] = view.shape[0];
    return fixed_array(static_cast<const double*>(view.data), shape);
  };
  result.polygon_xy_mm = copy(SGRT_ROI_POLYGON, {0, 2});
  result.box_mm = copy(SGRT_ROI_BOX, {0, 3});
  return result;
}

py::array_t<uint8_t> mask(const Roi& roi, const Surface& surface, const std::optional<py::array>& given) {
  py::array result = out_array(given, SGRT_U8, point_shape(surface.handle.get()));
  const sgrt_mut_view view = out_view(result, "out", SGRT_U8);
  run([&] { return sgrt_roi_mask(roi.handle.get(), surface.handle.get(), &view); });
  return py::reinterpret_borrow<py::array_t<uint8_t>>(result);
}

py::tuple state_of(const Roi& roi) {
  return py::make_tuple(roi.polygon_xy_mm, roi.box_mm);
}

Roi from_state(const py::tuple& state) {
  if (!state[0].is_none()) return polygon(py::reinterpret_borrow<ArrayLike>(state[0]));
  const py::object corners = state[1];
  return box(py::reinterpret_borrow<ArrayLike>(corners[py::int_(0)]),
             py::reinterpret_borrow<ArrayLike>(corners[py::int_(1)]));
}

}  // namespace

void register_roi(py::module_& m) {
  py::class_<Roi>(m, "Roi", "The part of the reference that counts: Roi.polygon(...) or Roi.box(...). Immutable.")
      .def_static("polygon", &polygon, py::arg("vertices_xy_mm"),
                  R"(A polygon in the room's X-Y plane, seen from above, closed by itself.

vertices_xy_mm: V x 2, mm, V >= 3. A reference point is inside by the even-odd rule if its normal has z > 0.

Raises InvalidArgument: fewer than 3 vertices, non-finite, no area. LimitError: more than 10,000 vertices.
C: sgrt_roi_from_polygon)")
      .def_static("box", &box, py::arg("min_mm"), py::arg("max_mm"),
                  R"(An axis-aligned box of the room; min_mm and max_mm: 3 numbers each, mm.

Raises InvalidArgument: non-finite, or min >= max.
C: sgrt_roi_from_box)")
      .def("mask", &mask, py::arg("surface"), py::kw_only(), py::arg("out") = py::none(),
           R"(uint8, N or H x W as the surface: 1 inside, 0 outside or absent. out: such an array to write into.

C: sgrt_roi_mask)")
      .def("moved", &moved, py::arg("pose"),
           R"(The region under a rigid motion (4 x 4, mm), as Surface.moved moves the reference that it was drawn on.

Raises InvalidArgument: a turn of a box, a turn of a polygon about anything but the vertical.
C: sgrt_roi_move, sgrt_roi_array)")
      .def_readonly("polygon_xy_mm", &Roi::polygon_xy_mm, "V x 2, mm, as given; None for a box.")
      .def_readonly("box_mm", &Roi::box_mm, "2 x 3, mm: min and max; None for a polygon.")
      .def("__repr__",
           [](const Roi& roi) {
             if (roi.polygon_xy_mm)
               return py::str("<sgrt.Roi polygon of {} vertices>").format(roi.polygon_xy_mm->shape(0));
             return py::str("<sgrt.Roi box {} mm>").format(roi.box_mm->attr("tolist")());
           })
      .def(py::pickle(&state_of, &from_state));
}

}  // namespace sgrt_py
