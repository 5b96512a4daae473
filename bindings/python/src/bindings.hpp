// What all binding files share: statuses as exceptions, the context of a call, numpy arrays as views, handles with an
// owner. Of the project it sees sgrt.h alone, so that Python reaches nothing that a vendor in C does not.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <sgrt.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace sgrt_py {

namespace py = pybind11;

// ------------------------------------------------------------------------------------------------------------ errors

// Raises the exception class of a status (sgrt/errors.py) with its message and, for 10-19, the result handle.
[[noreturn]] void raise(sgrt_status status, const std::string& message, const py::object& result = py::none());

[[noreturn]] inline void invalid(const std::string& message) {
  raise(SGRT_E_INVALID_ARGUMENT, message);
}

// ----------------------------------------------------------------------------------------------------------- handles

template <class T, void (*free)(T*)>
struct Freed {
  void operator()(T* handle) const { free(handle); }
};
template <class T, void (*free)(T*)>
using Owned = std::unique_ptr<T, Freed<T, free>>;

// The T** of a C function that writes a handle: `out(owner)` takes what was written when the expression ends.
template <class Owner>
class Out {
 public:
  explicit Out(Owner& owner) : owner_(owner) {}
  ~Out() { owner_.reset(raw_); }
  operator typename Owner::pointer *() { return &raw_; }

 private:
  Owner& owner_;
  typename Owner::pointer raw_ = nullptr;
};
template <class Owner>
Out<Owner> out(Owner& owner) {
  return Out<Owner>(owner);
}

struct Surface {
  Owned<sgrt_surface, sgrt_surface_free> handle;
};
// What the ROI was made from stays with it, so that it pickles and can be written to roi.json.
struct Roi {
  Owned<sgrt_roi, sgrt_roi_free> handle;
  std::optional<py::array_t<double>> polygon_xy_mm, box_mm;
};
struct Rig {
  Owned<sgrt_rig, sgrt_rig_free> handle;
};
struct Curve {
  Owned<sgrt_nurbs_curve, sgrt_nurbs_curve_free> handle;
};
struct Nurbs {  // a surface
  Owned<sgrt_nurbs_surface, sgrt_nurbs_surface_free> handle;
};

// ------------------------------------------------------------------------------------------------------------- calls

// The Python side of a context. Its callbacks reach the running Call through a thread-local pointer: the library calls
// them on the calling thread only.
struct Context {
  py::object progress = py::none();
  py::object log = py::none();
  int32_t threads = 1;
  Owned<sgrt_context, sgrt_context_free> handle;

  Context() = default;
  Context(int32_t threads, const std::string& max_isa, py::object progress, py::object log);
};

// One C call that takes a context: the caller's, or one of its own so that Ctrl-C can cancel. Keeps what a callback
// raised.
class Call {
 public:
  explicit Call(Context* context);
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  sgrt_context* context() const { return context_->handle.get(); }
  void rethrow();  // what a callback raised, unchanged; needs the GIL

  static int32_t on_progress(void*, double fraction, const char* stage);
  static void on_log(void*, int32_t level, const char* message);

 private:
  template <class F>
  int32_t guarded(F&& callback);

  Context* context_;
  std::optional<Context> own_;
  Call* outer_;
  std::exception_ptr pending_;
};

struct Outcome {
  sgrt_status status;
  std::string message;
};

// Runs f(sgrt_context*) with the GIL released. Raises what a callback raised; the status is the caller's to look at.
template <class F>
Outcome attempt(Context* context, F&& f) {
  Call call(context);
  Outcome outcome{};
  {
    py::gil_scoped_release nogil;
    outcome.status = f(call.context());
    if (outcome.status != SGRT_OK) outcome.message = sgrt_last_error();
  }
  call.rethrow();
  return outcome;
}

// The same, and any status but OK is raised.
template <class F>
void run(Context* context, F&& f) {
  const Outcome outcome = attempt(context, f);
  if (outcome.status != SGRT_OK) raise(outcome.status, outcome.message);
}

// For functions that take no context.
template <class F>
void run(F&& f) {
  sgrt_status status;
  {
    py::gil_scoped_release nogil;
    status = f();
  }
  if (status != SGRT_OK) raise(status, sgrt_last_error());
}

// A sized struct with the library's defaults.
template <class T>
T defaults(sgrt_status (*init)(T*, size_t)) {
  T value{};
  const sgrt_status status = init(&value, sizeof value);
  if (status != SGRT_OK) raise(status, sgrt_last_error());
  return value;
}

// ------------------------------------------------------------------------------------------------------------ arrays

inline bool anything(PyObject*) {
  return true;
}
// An argument that numpy can look at; InView says what is wrong with it.
class ArrayLike : public py::object {
 public:
  PYBIND11_OBJECT_DEFAULT(ArrayLike, py::object, anything)
};
using MaybeArray = std::optional<ArrayLike>;
using Doubles = py::array_t<double>;

enum class Accept { kFloats, kImages, kIndices, kVoxels, kTaps };

// An input as a view of its own memory: no copy but of lists and of memory that is not aligned. Absent: data NULL.
struct InView {
  py::array keep;
  sgrt_view view{};

  InView() = default;
  InView(const py::object& source, const char* name, Accept accept);
  InView(const MaybeArray& source, const char* name, Accept accept) {
    if (source) *this = InView(*source, name, accept);
  }
};

// An output that the caller owns: exactly this dtype, writable, aligned; never copied. Its shape is the library's to
// check.
sgrt_mut_view out_view(py::array& array, const char* name, int32_t dtype);

// The caller's `out` if given, else a new array.
py::array out_array(const std::optional<py::array>& given, int32_t dtype, const std::vector<py::ssize_t>& shape);

// N numbers of any real dtype, flat; the shape must match.
void read_numbers(const py::object& source, const char* name, const std::vector<py::ssize_t>& shape, double* numbers);

struct Vec3 {
  double v[3];
  Vec3(const py::object& source, const char* name) { read_numbers(source, name, {3}, v); }
};
struct Mat4 {
  double v[16];
  Mat4(const py::object& source, const char* name) { read_numbers(source, name, {4, 4}, v); }
};

// A read-only array of its own.
Doubles fixed_array(const double* numbers, const std::vector<py::ssize_t>& shape);

// Memory of a handle as a read-only array; `base` keeps the handle alive. None where the view is absent.
template <class T>
std::optional<py::array_t<T>> lend(const sgrt_view& view, const py::handle& base) {
  if (!view.data) return std::nullopt;
  const std::vector<py::ssize_t> shape(view.shape, view.shape + view.ndim);
  const std::vector<py::ssize_t> strides(view.strides, view.strides + view.ndim);
  py::array_t<T> array(shape, strides, static_cast<const T*>(view.data), base);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

// A text argument for C: a NUL inside would silently cut it short.
const char* c_text(const std::string& text, const char* name);

// ------------------------------------------------------------------------------------------------------------- parts

// N, or H x W: one entry a point.
std::vector<py::ssize_t> point_shape(const sgrt_surface* surface);

void register_library(py::module_& m);
void register_context(py::module_& m);
void register_surface(py::module_& m);
void register_filter(py::module_& m);
void register_roi(py::module_& m);
void register_frame(py::module_& m);
void register_rig(py::module_& m);
void register_stereo(py::module_& m);
void register_laser(py::module_& m);
void register_tof(py::module_& m);
void register_nurbs_curve(py::module_& m);
void register_nurbs_surface(py::module_& m);
void register_nurbs_fit(py::module_& m);
void register_curvature(py::module_& m);
void register_landmarks(py::module_& m);
void register_volume(py::module_& m);
void register_icp(py::module_& m);
void register_calibration(py::module_& m);
void register_advice(py::module_& m);
void register_coarse(py::module_& m);
void register_deform(py::module_& m);
void register_tracker(py::module_& m);

}  // namespace sgrt_py

template <>
struct pybind11::detail::handle_type_name<sgrt_py::ArrayLike> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike");
};
