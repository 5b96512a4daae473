// Reading borrowed images, see core/image.hpp.
#include "core/image.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.hpp"

namespace sgrt {
namespace {

template <class T>
T read(const char* p) {
  T value;
  std::memcpy(&value, p, sizeof value);
  return value;
}

float grey(std::uint8_t value) {
  return value;
}
float grey(std::uint16_t value) {
  return value;
}
float grey(float value) {
  return std::abs(value) <= 1e9F ? value : std::numeric_limits<float>::infinity();
}

const char* address(const ImageView& view, int y, int x) {
  return static_cast<const char*>(view.data) + y * view.row_stride + x * view.column_stride;
}

template <class T>
void copy(const ImageView& view, Image& out) {
  for (int y = 0; y < view.height; ++y) {
    const char* from = address(view, y, 0);
    float* to = out.row(y);
    if (view.column_stride == sizeof(T)) {  // the usual case, written so that it vectorises
      for (int x = 0; x < view.width; ++x) to[x] = grey(read<T>(from + x * sizeof(T)));
    } else {
      for (int x = 0; x < view.width; ++x) to[x] = grey(read<T>(from + x * view.column_stride));
    }
  }
}

}  // namespace

float ImageView::at(int y, int x) const {
  const char* p = address(*this, y, x);
  switch (type) {
    case Type::kU8:
      return grey(read<std::uint8_t>(p));
    case Type::kU16:
      return grey(read<std::uint16_t>(p));
    default:
      return grey(read<float>(p));
  }
}

float ImageView::clip() const {
  switch (type) {
    case Type::kU8:
      return 255;
    case Type::kU16:
      return 65535;
    default:
      return std::numeric_limits<float>::infinity();
  }
}

void load(const ImageView& view, Image& out) {
  require(view.data != nullptr, "image: expected data, got NULL");
  require(view.height > 0 && view.width > 0, "image: expected at least one pixel");
  out.resize(view.height, view.width);
  switch (view.type) {
    case ImageView::Type::kU8:
      return copy<std::uint8_t>(view, out);
    case ImageView::Type::kU16:
      return copy<std::uint16_t>(view, out);
    default:
      return copy<float>(view, out);
  }
}

}  // namespace sgrt
