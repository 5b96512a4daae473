// A grey image in memory: float pixels, row-major. Pixel (0,0) is the centre of the top-left pixel.
#pragma once

#include <cstdint>
#include <vector>

namespace sgrt {

// A borrowed image as the caller has it: any stride, u8, u16 or f32.
struct ImageView {
  enum class Type { kU8, kU16, kF32 };
  const void* data = nullptr;
  Type type = Type::kU8;
  int height = 0, width = 0;
  std::int64_t row_stride = 0, column_stride = 0;  // bytes

  float at(int y, int x) const;  // as load gives it
  // The value at which a pixel of this type is clipped: 255, 65535, or infinity for float.
  float clip() const;
};

struct Image {
  int height = 0, width = 0;
  std::vector<float> pixels;

  void resize(int h, int w) {
    height = h;
    width = w;
    pixels.resize(static_cast<std::size_t>(h) * w);
  }
  float* row(int y) { return pixels.data() + static_cast<std::size_t>(y) * width; }
  const float* row(int y) const { return pixels.data() + static_cast<std::size_t>(y) * width; }
};

// Copies into a float image. In a float image NaN and whatever lies beyond 1e9 become +infinity, which counts as
// clipped.
void load(const ImageView& view, Image& out);

}  // namespace sgrt
