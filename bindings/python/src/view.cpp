// numpy arrays as views (sgrt_view, sgrt_mut_view) and back. What the ABI cannot take is an error that names the
// argument, what it was and what is accepted: never a conversion behind the caller's back, never a copy of an output.
#include "bindings.hpp"

namespace sgrt_py {
namespace {

constexpr int kMaxDimensions = 6;

struct Dtype {
  char kind;
  int size;
  int32_t code;
  const char* name;
};
constexpr Dtype kDtypes[] = {{'f', 4, SGRT_F32, "float32"}, {'f', 8, SGRT_F64, "float64"}, {'u', 1, SGRT_U8, "uint8"},
                             {'i', 2, SGRT_I16, "int16"},   {'u', 2, SGRT_U16, "uint16"},  {'i', 4, SGRT_I32, "int32"}};

const char* accepted_names(Accept accept) {
  switch (accept) {
    case Accept::kFloats:
      return "float32 or float64";
    case Accept::kImages:
      return "uint8, uint16 or float32";
    case Accept::kIndices:
      return "int32";
    case Accept::kVoxels:
      return "int16, uint16, uint8 or float32";
    case Accept::kTaps:
      return "uint16, int16 or float32";
  }
  return "";
}

bool accepted(int32_t code, Accept accept) {
  switch (accept) {
    case Accept::kFloats:
      return code == SGRT_F32 || code == SGRT_F64;
    case Accept::kImages:
      return code == SGRT_U8 || code == SGRT_U16 || code == SGRT_F32;
    case Accept::kIndices:
      return code == SGRT_I32;
    case Accept::kVoxels:
      return code == SGRT_I16 || code == SGRT_U16 || code == SGRT_U8 || code == SGRT_F32;
    case Accept::kTaps:
      return code == SGRT_U16 || code == SGRT_I16 || code == SGRT_F32;
  }
  return false;
}

bool native(const py::dtype& dtype) {
  return py::cast<bool>(dtype.attr("isnative"));
}

// 0: no dtype of the ABI.
int32_t code_of(const py::dtype& dtype) {
  if (!native(dtype)) return 0;
  for (const Dtype& d : kDtypes) {
    if (d.kind == dtype.kind() && d.size == dtype.itemsize()) return d.code;
  }
  return 0;
}

py::dtype dtype_of(int32_t code) {
  for (const Dtype& d : kDtypes) {
    if (d.code == code) return py::dtype(d.name);
  }
  invalid("a dtype without a numpy twin");
}

std::string describe(const py::dtype& dtype) {
  return std::string(py::str(dtype)) + (native(dtype) ? "" : " (bytes swapped)");
}

bool aligned(const py::array& array) {
  return (array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) != 0;
}

// An array as it is; a list or tuple becomes one, of float64 where numbers are meant.
py::array as_array(const py::object& source, const char* name, Accept accept) {
  if (py::hasattr(source, "mask") && py::hasattr(source, "filled")) {
    invalid(std::string(name) + ": a masked array is not accepted; fill it (a point that is absent is NaN)");
  }
  if (py::isinstance<py::array>(source)) return py::reinterpret_borrow<py::array>(source);
  const py::module_ numpy = py::module_::import("numpy");
  py::array array;
  try {
    array = py::array(numpy.attr("asarray")(source));
  } catch (py::error_already_set& error) {
    if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_TypeError)) throw;
    invalid(std::string(name) + ": not an array: " + std::string(py::str(error.value())));
  }
  const bool plain = py::isinstance<py::list>(source) || py::isinstance<py::tuple>(source);
  const char kind = array.dtype().kind();
  if (plain && accept == Accept::kFloats && (kind == 'i' || kind == 'u')) array = py::array(array.attr("astype")("f8"));
  return array;
}

template <class View>
void set_layout(View& view, const py::array& array, int32_t code, const char* name) {
  if (array.ndim() < 1 || array.ndim() > kMaxDimensions) {
    invalid(std::string(name) + ": " + std::to_string(array.ndim()) + " dimensions; expected 1 to 6");
  }
  view.dtype = code;
  view.ndim = static_cast<int32_t>(array.ndim());
  for (int i = 0; i < view.ndim; ++i) {
    view.shape[i] = array.shape(i);
    view.strides[i] = array.strides(i);
  }
}

std::string text_of(const std::vector<py::ssize_t>& shape) {
  std::string text;
  for (const py::ssize_t n : shape) text += (text.empty() ? "" : " x ") + std::to_string(n);
  return text;
}

void freeze(py::array& array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
}

}  // namespace

InView::InView(const py::object& source, const char* name, Accept accept) : keep(as_array(source, name, accept)) {
  const int32_t code = code_of(keep.dtype());
  if (!accepted(code, accept)) {
    invalid(std::string(name) + ": dtype " + describe(keep.dtype()) + " is not accepted; expected " +
            accepted_names(accept) + " in native byte order");
  }
  if (!aligned(keep)) keep = py::array(keep.attr("copy")());
  set_layout(view, keep, code, name);
  view.data = keep.data();
}

sgrt_mut_view out_view(py::array& array, const char* name, int32_t dtype) {
  if (code_of(array.dtype()) != dtype) {
    invalid(std::string(name) + ": dtype " + describe(array.dtype()) + "; an output must be " +
            std::string(py::str(dtype_of(dtype))) + " in native byte order");
  }
  if (!array.writeable()) invalid(std::string(name) + ": the array is read-only");
  if (!aligned(array)) invalid(std::string(name) + ": the array's memory is not aligned to its dtype");
  sgrt_mut_view view{};
  set_layout(view, array, dtype, name);
  view.data = array.mutable_data();
  return view;
}

py::array out_array(const std::optional<py::array>& given, int32_t dtype, const std::vector<py::ssize_t>& shape) {
  return given ? *given : py::array(dtype_of(dtype), shape);
}

void read_numbers(const py::object& source, const char* name, const std::vector<py::ssize_t>& shape, double* numbers) {
  const std::string expected = "expected " + text_of(shape) + " numbers";
  if (source.is_none()) invalid(std::string(name) + ": None; " + expected);
  const py::array array = as_array(source, name, Accept::kFloats);
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u') {
    invalid(std::string(name) + ": dtype " + describe(array.dtype()) + "; " + expected);
  }
  const std::vector<py::ssize_t> actual(array.shape(), array.shape() + array.ndim());
  if (actual != shape) invalid(std::string(name) + ": shape (" + text_of(actual) + "); " + expected);
  const auto doubles = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!doubles) throw py::error_already_set();
  std::copy(doubles.data(), doubles.data() + doubles.size(), numbers);
}

Doubles fixed_array(const double* numbers, const std::vector<py::ssize_t>& shape) {
  Doubles array(shape);
  std::copy(numbers, numbers + array.size(), array.mutable_data());
  freeze(array);
  return array;
}

}  // namespace sgrt_py
