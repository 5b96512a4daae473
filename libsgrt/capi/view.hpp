// Views: the caller's arrays to and from the core's. Every view is checked before a byte of it is touched: dtype,
// shape, alignment, strides, overflow; for outputs overlap too.
#pragma once

#include <sgrt.h>

#include <cstdint>
#include <initializer_list>

#include "core/image.hpp"
#include "core/surface.hpp"

namespace sgrt {

enum class Kind { kReal, kIndex, kImage, kVoxels, kTaps };  // f32 f64 | i32 | u8 u16 f32 | i16 u16 u8 f32 | u16 i16 f32

constexpr std::int64_t kAny = -1;  // a side of any length

// An absent array: no view, or one without data.
inline bool absent(const sgrt_view* v) {
  return !v || !v->data;
}
inline bool absent(const sgrt_mut_view* v) {
  return !v || !v->data;
}

// Throws kInvalidArgument unless the view is sound and of this kind and shape.
void check_view(const sgrt_view* view, const char* name, Kind kind, std::initializer_list<std::int64_t> shape);
// The same for an output: exactly this dtype and shape, and no element twice.
void check_output(const sgrt_mut_view* view, const char* name, std::int32_t dtype,
                  std::initializer_list<std::int64_t> shape);
// An output of one number a point: N, or H x W of a grid (height > 0).
void check_output_beside(const sgrt_mut_view* view, const char* name, std::int32_t dtype, std::int64_t size,
                         std::int64_t height);
// Refuses memory that the two share.
void check_apart(const sgrt_mut_view* output, const char* output_name, const sgrt_view* other, const char* other_name);
void check_apart(const sgrt_mut_view* output, const char* output_name, const sgrt_mut_view* other,
                 const char* other_name);
// kLimit above `most`.
void check_limit(std::int64_t count, std::int64_t most, const char* name);

// Copies a checked view in row-major order.
void read_view(const sgrt_view& view, double* out);
void read_view(const sgrt_view& view, std::int32_t* out);
void write_view(const sgrt_mut_view& view, const double* values);
void write_view(const sgrt_mut_view& view, const std::uint8_t* values);

Points read_points(const sgrt_view* view, const char* name);  // N x 3, at most kMaxPoints
ImageView image_of(const sgrt_view* view, const char* name);  // H x W, sides up to 32,768

// Lends contiguous memory; a NULL pointer gives an absent array.
sgrt_view lend(const void* data, std::int32_t dtype, std::initializer_list<std::int64_t> shape);

}  // namespace sgrt
