// Views; see view.hpp.
#include "capi/view.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <string>

#include "capi/check.hpp"
#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kMaxSide = 32768;  // px
// Where a program's memory ends at the latest: 2^56 on 64 bits (x86-64 with five levels of pages).
constexpr std::uintptr_t kAddresses = std::numeric_limits<std::uintptr_t>::max() >> (sizeof(void*) == 8 ? 8 : 0);

const char* dtype_name(std::int32_t dtype) {
  switch (dtype) {
    case SGRT_F32:
      return "float32";
    case SGRT_F64:
      return "float64";
    case SGRT_U8:
      return "uint8";
    case SGRT_I16:
      return "int16";
    case SGRT_U16:
      return "uint16";
    case SGRT_I32:
      return "int32";
    default:
      return nullptr;
  }
}

std::string dtype_text(std::int32_t dtype) {
  const char* name = dtype_name(dtype);
  return name ? name : "dtype " + std::to_string(dtype);
}

bool is_kind(std::int32_t dtype, Kind kind) {
  switch (kind) {
    case Kind::kReal:
      return dtype == SGRT_F32 || dtype == SGRT_F64;
    case Kind::kIndex:
      return dtype == SGRT_I32;
    case Kind::kImage:
      return dtype == SGRT_U8 || dtype == SGRT_U16 || dtype == SGRT_F32;
    case Kind::kVoxels:
      return dtype == SGRT_I16 || dtype == SGRT_U16 || dtype == SGRT_U8 || dtype == SGRT_F32;
    case Kind::kTaps:
      return dtype == SGRT_U16 || dtype == SGRT_I16 || dtype == SGRT_F32;
  }
  return false;
}

const char* kind_text(Kind kind) {
  switch (kind) {
    case Kind::kReal:
      return "float32 or float64";
    case Kind::kIndex:
      return "int32";
    case Kind::kImage:
      return "uint8, uint16 or float32";
    case Kind::kVoxels:
      return "int16, uint16, uint8 or float32";
    case Kind::kTaps:
      return "uint16, int16 or float32";
  }
  return "";
}

std::string shape_text(const std::int64_t* shape, std::size_t n) {
  std::string text;
  for (std::size_t i = 0; i < n; ++i) {
    if (i > 0) text += " x ";
    text += shape[i] == kAny ? std::string("any") : std::to_string(shape[i]);
  }
  return text;
}

void check_shape(const sgrt_view& v, const char* name, std::initializer_list<std::int64_t> shape) {
  if (v.ndim < 1 || v.ndim > 6) refuse(name, std::to_string(v.ndim) + " dimensions", "1 to 6");
  bool same = static_cast<std::size_t>(v.ndim) == shape.size();
  for (int i = 0; i < v.ndim; ++i) {
    // The text of a side that stands for "any" must not be confused with a negative one.
    if (v.shape[i] < 0) refuse(name, "a side of " + std::to_string(v.shape[i]), "0 or more");
    same = same && (shape.begin()[i] == kAny || shape.begin()[i] == v.shape[i]);
  }
  if (!same)
    refuse(name, "shape " + shape_text(v.shape, static_cast<std::size_t>(v.ndim)),
           shape_text(shape.begin(), shape.size()));
}

// Bytes of the view from its data pointer: [low, high).
struct Extent {
  std::uintptr_t low = 0, high = 0;
};

[[noreturn]] void refuse_extent(const char* name) {
  refuse(name, "shape and strides beyond memory", "an array in memory");
}

// The view's shape is checked. Throws where data, strides or size cannot be those of an array in memory.
Extent extent_of(const sgrt_view& v, const char* name) {
  const std::int64_t size = sgrt_dtype_size(v.dtype);
  const auto address = reinterpret_cast<std::uintptr_t>(v.data);
  if (address % static_cast<std::uintptr_t>(size) != 0) refuse(name, "misaligned data", "data aligned to the dtype");
  std::int64_t elements = 1, below = 0, above = size;
  for (int i = 0; i < v.ndim; ++i) {
    if (v.shape[i] == 0) return {address, address};
  }
  for (int i = 0; i < v.ndim; ++i) {
    const std::int64_t n = v.shape[i], stride = v.strides[i];
    if (elements > kMax / size / n) refuse_extent(name);
    elements *= n;
    if (n == 1) continue;
    if (stride % size != 0)
      refuse(name, "a stride of " + std::to_string(stride) + " bytes", "a multiple of " + std::to_string(size));
    if (stride > kMax / (n - 1) || stride < -kMax / (n - 1)) refuse_extent(name);
    std::int64_t& side = stride < 0 ? below : above;
    const std::int64_t reach = stride < 0 ? -stride * (n - 1) : stride * (n - 1);
    if (side > kMax - reach) refuse_extent(name);
    side += reach;
  }
  if (below > kMax - above || static_cast<std::uintptr_t>(below) > address) refuse_extent(name);
  if (static_cast<std::uintptr_t>(above) > kAddresses - std::min(address, kAddresses)) refuse_extent(name);
  return {address - static_cast<std::uintptr_t>(below), address + static_cast<std::uintptr_t>(above)};
}

// Dimensions nest, the smaller stride inside the larger: then no element is there twice.
void check_distinct(const sgrt_view& v, const char* name) {
  std::array<std::array<std::int64_t, 2>, 6> sides{};  // |stride|, last index; none of a side of 1
  for (int i = 0; i < v.ndim; ++i) {
    if (v.shape[i] == 0) return;
    if (v.shape[i] > 1) sides[i] = {v.strides[i] < 0 ? -v.strides[i] : v.strides[i], v.shape[i] - 1};
  }
  std::sort(sides.begin(), sides.end());
  std::int64_t inner = sgrt_dtype_size(v.dtype);
  for (const auto& [stride, last] : sides) {
    if (last == 0) continue;
    if (stride < inner)
      refuse(name, "a stride of " + std::to_string(stride) + " bytes", "an output whose elements do not overlap");
    inner += stride * last;  // within the extent, so no overflow
  }
}

sgrt_view read_only(const sgrt_mut_view& m) {
  sgrt_view v{};
  v.data = m.data;
  v.dtype = m.dtype;
  v.ndim = m.ndim;
  std::copy(m.shape, m.shape + 6, v.shape);
  std::copy(m.strides, m.strides + 6, v.strides);
  return v;
}

void check_apart(const sgrt_view& a, const char* a_name, const sgrt_view& b, const char* b_name) {
  const Extent x = extent_of(a, a_name), y = extent_of(b, b_name);
  if (x.low < y.high && y.low < x.high) refuse(a_name, std::string("overlaps ") + b_name, "memory of its own");
}

// Calls line(first element, stride in bytes, count) for each line along the last dimension, in row-major order.
template <class Line>
void for_lines(const sgrt_view& v, Line&& line) {
  const int last = v.ndim - 1;
  for (int i = 0; i < v.ndim; ++i) {
    if (v.shape[i] == 0) return;
  }
  std::array<std::int64_t, 6> index{};
  for (;;) {
    const char* at = static_cast<const char*>(v.data);
    for (int d = 0; d < last; ++d) at += index[d] * v.strides[d];
    line(at, v.strides[last], v.shape[last]);
    int d = last - 1;
    while (d >= 0 && ++index[d] == v.shape[d]) index[d--] = 0;
    if (d < 0) return;
  }
}

template <class In, class Out>
void read_as(const sgrt_view& v, Out* out) {
  for_lines(v, [&](const char* at, std::int64_t stride, std::int64_t n) {
    for (std::int64_t i = 0; i < n; ++i) *out++ = static_cast<Out>(*reinterpret_cast<const In*>(at + i * stride));
  });
}

template <class T>
void write_as(const sgrt_mut_view& m, const T* values) {
  for_lines(read_only(m), [&](const char* at, std::int64_t stride, std::int64_t n) {
    char* to = const_cast<char*>(at);  // the view's own data, which is writable
    for (std::int64_t i = 0; i < n; ++i) *reinterpret_cast<T*>(to + i * stride) = *values++;
  });
}

}  // namespace

void check_view(const sgrt_view* view, const char* name, Kind kind, std::initializer_list<std::int64_t> shape) {
  if (absent(view)) refuse(name, "NULL", "an array");
  if (!is_kind(view->dtype, kind)) refuse(name, dtype_text(view->dtype), kind_text(kind));
  check_shape(*view, name, shape);
  extent_of(*view, name);
}

void check_output(const sgrt_mut_view* view, const char* name, std::int32_t dtype,
                  std::initializer_list<std::int64_t> shape) {
  if (absent(view)) refuse(name, "NULL", "an array to write");
  if (view->dtype != dtype) refuse(name, dtype_text(view->dtype), dtype_text(dtype));
  const sgrt_view v = read_only(*view);
  check_shape(v, name, shape);
  extent_of(v, name);
  check_distinct(v, name);
}

void check_output_beside(const sgrt_mut_view* view, const char* name, std::int32_t dtype, std::int64_t size,
                         std::int64_t height) {
  if (height > 0) return check_output(view, name, dtype, {height, size / height});
  check_output(view, name, dtype, {size});
}

void check_apart(const sgrt_mut_view* output, const char* output_name, const sgrt_view* other, const char* other_name) {
  check_apart(read_only(*output), output_name, *other, other_name);
}

void check_apart(const sgrt_mut_view* output, const char* output_name, const sgrt_mut_view* other,
                 const char* other_name) {
  check_apart(read_only(*output), output_name, read_only(*other), other_name);
}

void check_limit(std::int64_t count, std::int64_t most, const char* name) {
  if (count <= most) return;
  fail(Status::kLimit, std::string(name) + ": " + std::to_string(count) + ", expected at most " + std::to_string(most));
}

void read_view(const sgrt_view& view, double* out) {
  if (view.dtype == SGRT_F32) return read_as<float>(view, out);
  read_as<double>(view, out);
}

void read_view(const sgrt_view& view, std::int32_t* out) {
  read_as<std::int32_t>(view, out);
}

void write_view(const sgrt_mut_view& view, const double* values) {
  write_as(view, values);
}

void write_view(const sgrt_mut_view& view, const std::uint8_t* values) {
  write_as(view, values);
}

Points read_points(const sgrt_view* view, const char* name) {
  check_view(view, name, Kind::kReal, {kAny, 3});
  check_limit(view->shape[0], kMaxPoints, name);
  Points points(view->shape[0], 3);
  read_view(*view, points.data());
  return points;
}

ImageView image_of(const sgrt_view* view, const char* name) {
  check_view(view, name, Kind::kImage, {kAny, kAny});
  check_limit(std::max(view->shape[0], view->shape[1]), kMaxSide, name);
  if (view->shape[0] < 1 || view->shape[1] < 1) refuse(name, "an image without a pixel", "1 x 1 or more");
  ImageView image;
  image.data = view->data;
  image.type = view->dtype == SGRT_U8    ? ImageView::Type::kU8
               : view->dtype == SGRT_U16 ? ImageView::Type::kU16
                                         : ImageView::Type::kF32;
  image.height = static_cast<int>(view->shape[0]);
  image.width = static_cast<int>(view->shape[1]);
  image.row_stride = view->strides[0];
  image.column_stride = view->strides[1];
  return image;
}

sgrt_view lend(const void* data, std::int32_t dtype, std::initializer_list<std::int64_t> shape) {
  sgrt_view v{};
  if (!data) return v;
  v.data = data;
  v.dtype = dtype;
  v.ndim = static_cast<std::int32_t>(shape.size());
  std::copy(shape.begin(), shape.end(), v.shape);
  std::int64_t stride = sgrt_dtype_size(dtype);
  for (int i = v.ndim - 1; i >= 0; --i) {
    v.strides[i] = stride;
    stride *= v.shape[i];
  }
  return v;
}

}  // namespace sgrt
