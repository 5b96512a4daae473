// What the bindings of NURBS curves and surfaces share. Parameters are arrays of any shape; results have that shape and
// the coordinates after it.
#pragma once

#include <algorithm>
#include <tuple>

#include "bindings.hpp"

namespace sgrt_py {

using Shape = std::vector<py::ssize_t>;
using Domain = std::pair<double, double>;
using Closest = std::tuple<Doubles, Doubles, Doubles>;

inline Shape operator+(Shape shape, const Shape& tail) {
  shape.insert(shape.end(), tail.begin(), tail.end());
  return shape;
}

// Parameters of any shape as N x columns; whole numbers become floats.
struct ParameterArray {
  Shape shape;
  InView flat;

  ParameterArray(const std::vector<py::object>& sources, const char* name) {
    if (sources.size() == 2 && side_by_side(sources[0], sources[1], name)) return;
    const py::module_ np = py::module_::import("numpy");
    py::object all;
    try {
      all = sources.size() == 1
                ? py::object(np.attr("asarray")(sources[0]))
                : py::object(np.attr("stack")(np.attr("broadcast_arrays")(*py::cast(sources)), py::arg("axis") = -1));
    } catch (py::error_already_set& error) {
      if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_TypeError)) throw;
      invalid(std::string(name) + ": " + std::string(py::str(error.value())));
    }
    py::array array(all);
    const char kind = array.dtype().kind();
    if (kind == 'i' || kind == 'u') array = py::array(array.attr("astype")("f8"));
    const py::ssize_t columns = static_cast<py::ssize_t>(sources.size()), sides = array.ndim() - (columns > 1);
    shape.assign(array.shape(), array.shape() + sides);
    py::ssize_t n = 1;
    for (const py::ssize_t side : shape) n *= side;
    flat = InView(columns > 1 ? py::object(array.attr("reshape")(n, columns)) : py::object(array.attr("reshape")(n)),
                  name, Accept::kFloats);
  }
  py::ssize_t count() const { return flat.view.shape[0]; }

 private:
  // The common case without numpy's: float64 u and v of one shape, without gaps.
  bool side_by_side(const py::object& a, const py::object& b, const char* name) {
    using Dense = py::array_t<double, py::array::c_style>;
    if (!py::isinstance<Dense>(a) || !py::isinstance<Dense>(b)) return false;
    const Dense u(a), v(b);
    shape.assign(u.shape(), u.shape() + u.ndim());
    if (shape != Shape(v.shape(), v.shape() + v.ndim())) return false;
    Dense pairs(Shape{u.size(), 2});
    double* to = pairs.mutable_data();
    for (py::ssize_t i = 0; i < u.size(); ++i) to[2 * i] = u.data()[i], to[2 * i + 1] = v.data()[i];
    flat = InView(pairs, name, Accept::kFloats);
    return true;
  }
};

inline int32_t outside_of(bool clamp) {
  return clamp ? SGRT_OUTSIDE_CLAMP : SGRT_OUTSIDE_REFUSE;
}

inline int32_t kind_of(const std::string& word) {
  if (word == "uniform") return SGRT_PARAMETERS_UNIFORM;
  if (word == "chord") return SGRT_PARAMETERS_CHORD;
  if (word == "centripetal") return SGRT_PARAMETERS_CENTRIPETAL;
  invalid("parameters: '" + word + "', expected 'uniform', 'chord' or 'centripetal'");
}

// An array for n rows of `tail`, the library's view of it, and the array in the shape the caller asked for.
template <class Fill>
Doubles filled(py::ssize_t n, const Shape& tail, const Shape& shape, Fill&& fill) {
  py::array flat = out_array(std::nullopt, SGRT_F64, Shape{n} + tail);
  fill(out_view(flat, "out", SGRT_F64));
  return py::reinterpret_borrow<Doubles>(flat.attr("reshape")(py::cast(shape + tail)));
}

// The same knot several times.
inline ArrayLike repeated(double u, int32_t times) {
  return py::reinterpret_steal<ArrayLike>(Doubles(py::cast(std::vector<double>(std::max(times, 0), u))).release());
}

inline constexpr const char* kInterpolateDoc =
    R"(Through the points (A9.1, A9.4), or with `count` control points the least-squares one (A9.6, A9.7).

parameters: 'chord', 'centripetal' or 'uniform'.
Raises InsufficientData: fewer than degree + 1 points. Degenerate: points that coincide.
)";

inline constexpr const char* kClosestDoc =
    R"(The closest point to each of N x 3 points, over the whole shape: (parameters, distance_mm, gap_mm).

No point is nearer than distance_mm - gap_mm. Ask for many points at once: the shape is prepared at each call.
)";

}  // namespace sgrt_py
