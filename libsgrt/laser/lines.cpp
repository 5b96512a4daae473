#include "laser/lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace sgrt {
namespace {

ImageView turned(ImageView v) {
  std::swap(v.height, v.width);
  std::swap(v.row_stride, v.column_stride);
  return v;
}

template <class T>
void read_line(const ImageView& v, float clip, int line, int from, int n, float* out) {
  const char* p = static_cast<const char*>(v.data) + line * v.row_stride + from * v.column_stride;
  const auto read = [&](std::int64_t stride) {
    for (int i = 0; i < n; ++i) {
      const float value = static_cast<float>(*reinterpret_cast<const T*>(p + i * stride));
      out[i] = value < clip && value < Lines::kClipped ? value : Lines::kClipped;  // NaN counts as clipped
    }
  };
  constexpr std::int64_t kDense = sizeof(T);  // a constant, so that the loop becomes vectors
  v.column_stride == kDense ? read(kDense) : read(v.column_stride);
}

void read_any(const ImageView& v, float clip, int line, int from, int n, float* out) {
  if (v.type == ImageView::Type::kU8) return read_line<std::uint8_t>(v, clip, line, from, n, out);
  if (v.type == ImageView::Type::kU16) return read_line<std::uint16_t>(v, clip, line, from, n, out);
  read_line<float>(v, clip, line, from, n, out);
}

// Sum of the `kept` smallest.
double sum_least(std::vector<float>& values, std::size_t kept) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kept - 1), values.end());
  double sum = 0;
  for (std::size_t i = 0; i < kept; ++i) sum += values[i];
  return sum;
}

// The same of second differences of bytes, which are whole numbers, by counting.
double sum_least_whole(const std::vector<float>& values, std::size_t kept) {
  constexpr std::size_t kMost = 4 * 255;  // with a dark frame too
  std::array<std::size_t, 2 * kMost + 1> count{};
  for (const float v : values) ++count[static_cast<std::size_t>(v)];
  double sum = 0;
  for (std::size_t v = 0; kept > 0; ++v) {
    const std::size_t n = std::min(kept, count[v]);
    sum += static_cast<double>(n * v);
    kept -= n;
  }
  return sum;
}

}  // namespace

Lines::Lines(const ImageView& view, const ImageView* dark_view, bool columns, double saturation)
    : image(columns ? turned(view) : view), clip(saturation > 0 ? static_cast<float>(saturation) : view.clip()) {
  if (dark_view) dark = columns ? turned(*dark_view) : *dark_view;
}

const unsigned char* Lines::bytes(int line) const {
  if (dark || image.type != ImageView::Type::kU8 || image.column_stride != 1) return nullptr;
  return static_cast<const unsigned char*>(image.data) + line * image.row_stride;
}

void Lines::read(int line, int from, int n, float* out) const {
  read_any(image, clip, line, from, n, out);
  if (!dark) return;
  std::vector<float> below(static_cast<std::size_t>(n));
  read_any(*dark, clip, line, from, n, below.data());
  for (int i = 0; i < n; ++i) {
    if (out[i] < kClipped) out[i] = below[i] < kClipped ? out[i] - below[i] : kClipped;
  }
}

void level(float* v, int n, float clip) {
  float top = clip;
  if (!(clip < Lines::kClipped)) {
    top = 0;
    for (int i = 0; i < n; ++i) top = v[i] < Lines::kClipped ? std::max(top, v[i]) : top;
  }
  for (int i = 0; i < n; ++i) v[i] = std::min(v[i], top);
}

double noise_of(const Lines& lines) {
  constexpr int kLines = 32, kRun = 128;
  constexpr double kTrimmedMean = 0.6573;  // of |x| of a normal variable without its largest tenth
  const int n = std::min(kRun, lines.width());
  if (n < 3) return 0;
  std::vector<float> values(static_cast<std::size_t>(n)), second;
  second.reserve(static_cast<std::size_t>(kLines) * n);
  for (int k = 0; k < kLines; ++k) {
    const int line = static_cast<int>(static_cast<std::int64_t>(lines.count()) * k / kLines);
    const int from = static_cast<int>(static_cast<std::int64_t>(lines.width() - n) * ((k * 7) % kLines) / kLines);
    lines.read(line, from, n, values.data());
    for (int i = 1; i + 1 < n; ++i) {
      const float d = values[i - 1] - 2 * values[i] + values[i + 1];
      if (std::abs(d) < 0.1F * Lines::kClipped) second.push_back(std::abs(d));
    }
  }
  const bool whole = lines.image.type != ImageView::Type::kF32;
  const double rounding = whole ? (lines.dark ? 1.0 / 6 : 1.0 / 12) : 0;
  if (second.empty()) return std::sqrt(rounding);
  const std::size_t kept = std::min(second.size(), second.size() * 9 / 10 + 1);
  const double sum = lines.image.type == ImageView::Type::kU8 ? sum_least_whole(second, kept) : sum_least(second, kept);
  const double sigma = sum / static_cast<double>(kept) / kTrimmedMean / std::sqrt(6.0);
  return std::sqrt(std::max(sigma * sigma, rounding));
}

}  // namespace sgrt
