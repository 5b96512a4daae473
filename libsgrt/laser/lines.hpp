// An image as lines of float grey levels, the dark frame subtracted, rows or columns alike.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "core/image.hpp"

namespace sgrt {

struct Lines {
  ImageView image;
  std::optional<ImageView> dark;
  float clip;  // grey level from which a pixel is clipped

  // saturation: 0 for the largest of the image's type.
  Lines(const ImageView& view, const ImageView* dark_view, bool columns, double saturation);
  int count() const { return image.height; }
  int width() const { return image.width; }
  // What is clipped reads as this or more, whatever the dark frame.
  static constexpr float kClipped = 1e9F;
  // Where the line is bytes in a row and there is no dark frame: they may be read where they lie. Else nullptr.
  const unsigned char* bytes(int line) const;
  // n grey levels of a line from pixel `from` on.
  void read(int line, int from, int n, float* out) const;
};

// The clipped ones of n grey levels as the level of the clip; where there is none, as the brightest of the others.
void level(float* v, int n, float clip);

// One sigma of a pixel's noise off the stripe, from second differences along sampled lines (eq. 4).
double noise_of(const Lines& lines);

}  // namespace sgrt
