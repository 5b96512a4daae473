#include "stereo/coarse.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "stereo/kernels.hpp"

namespace sgrt {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr int kBandRows = 24;
constexpr float kAmbiguous = 0.9F;

// Means of scale x scale pixels; a cell with a masked pixel gets NaN.
void reduce(const Image& image, const std::vector<std::uint8_t>& mask, int scale, Image& out) {
  out.resize(image.height / scale, image.width / scale);
  const float share = 1.F / static_cast<float>(scale * scale);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      float sum = 0;
      bool good = true;
      for (int j = 0; j < scale; ++j) {
        const std::size_t i = static_cast<std::size_t>(y * scale + j) * image.width + x * scale;
        for (int k = 0; k < scale; ++k) {
          sum += image.pixels[i + k];
          good = good && mask[i + k] != 1;  // clipped pixels still tell something here
        }
      }
      out.row(y)[x] = good ? sum * share : kNan;
    }
}

// Window mean and 1/|window - mean|, 0 where the window leaves the image. Subtracts the image's mean so that float sums
// hold.
void window_statistics(Image& image, int half, Image& mean, Image& norm, CoarseWork& work) {
  double total = 0;
  std::int64_t count = 0;
  for (float g : image.pixels)
    if (g == g) total += g, ++count;
  const float offset = count > 0 ? static_cast<float>(total / static_cast<double>(count)) : 0;
  mean.resize(image.height, image.width);
  norm.resize(image.height, image.width);
  std::fill(mean.pixels.begin(), mean.pixels.end(), 0.F);
  std::fill(norm.pixels.begin(), norm.pixels.end(), 0.F);
  // Column sums slide down; a bad pixel counts in `bad`.
  std::vector<double>&sum = work.sum, &square = work.square;
  std::vector<int>& bad = work.bad;
  sum.assign(image.width, 0);
  square.assign(image.width, 0);
  bad.assign(image.width, 0);
  const auto add = [&](int y, int sign) {
    float* row = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      const bool good = row[x] == row[x];
      const double g = good ? row[x] - offset : 0;
      sum[x] += sign * g, square[x] += sign * g * g, bad[x] += good ? 0 : sign;
    }
  };
  const int side = 2 * half + 1;
  for (int y = 0; y < std::min(side - 1, image.height); ++y) add(y, 1);
  for (int y = half; y + half < image.height; ++y) {
    add(y + half, 1);
    if (y > half) add(y - half - 1, -1);
    double s = 0, q = 0;
    int b = 0;
    for (int x = 0; x < image.width; ++x) {
      s += sum[x], q += square[x], b += bad[x];
      if (x >= side) s -= sum[x - side], q -= square[x - side], b -= bad[x - side];
      if (x < side - 1) continue;
      const double m = s / (side * side), spread = q - s * m;
      mean.row(y)[x - half] = static_cast<float>(m);
      norm.row(y)[x - half] = b == 0 && spread > 1e-10 * q ? static_cast<float>(1 / std::sqrt(spread)) : 0.F;
    }
  }
  for (float& g : image.pixels) g = g == g ? g - offset : 0;
}

// Least-squares plane through the consistent disparities of the 5 x 5 cells round (x, y) that lie within one cell of
// the centre's.
CoarseMatch fit_plane(const CoarseWork& work, int width, int height, int x, int y, int scale) {
  const float centre = work.consistent[static_cast<std::size_t>(y) * width + x];
  if (!(centre == centre)) return {kNan, 0, 0};
  double n = 0, sx = 0, sy = 0, sd = 0, sxx = 0, sxy = 0, syy = 0, sxd = 0, syd = 0;
  for (int j = -2; j <= 2; ++j)
    for (int i = -2; i <= 2; ++i) {
      if (x + i < 0 || x + i >= width || y + j < 0 || y + j >= height) continue;
      const double d = work.consistent[static_cast<std::size_t>(y + j) * width + x + i];
      if (!(std::abs(d - centre) <= 1.5)) continue;
      n += 1, sx += i, sy += j, sd += d, sxx += i * i, sxy += i * j, syy += j * j, sxd += i * d, syd += j * d;
    }
  if (n < 6) return {kNan, 0, 0};  // a lone agreement is chance
  const double mx = sx / n, my = sy / n, md = sd / n;
  const double xx = sxx - n * mx * mx, xy = sxy - n * mx * my, yy = syy - n * my * my;
  const double xd = sxd - n * mx * md, yd = syd - n * my * md, det = xx * yy - xy * xy;
  if (!(det > 1)) return {kNan, 0, 0};
  const double a = (yy * xd - xy * yd) / det, b = (xx * yd - xy * xd) / det;
  const float at_centre = static_cast<float>((md - a * mx - b * my) * scale);
  return {at_centre, static_cast<float>(a), static_cast<float>(b)};
}

}  // namespace

void coarse_match(const Run& run, const Image& left, const std::vector<std::uint8_t>& left_mask, const Image& right,
                  const std::vector<std::uint8_t>& right_mask, const CoarseOptions& options, CoarseWork& work,
                  CoarseMap& map) {
  const int scale = options.scale, half = options.half;
  reduce(left, left_mask, scale, work.left);
  reduce(right, right_mask, scale, work.right);
  window_statistics(work.left, half, work.left_mean, work.left_norm, work);
  window_statistics(work.right, half, work.right_mean, work.right_norm, work);
  const int width = work.left.width, height = work.left.height, right_width = work.right.width;
  map.scale = scale;
  map.width = (left.width + scale - 1) / scale;
  map.height = (left.height + scale - 1) / scale;
  map.matches.assign(static_cast<std::size_t>(map.width) * map.height, {kNan, 0, 0});

  map.ambiguous.assign(map.matches.size(), 0);
  work.best_left.assign(work.left.pixels.size(), -2.F);
  work.second_left.assign(work.left.pixels.size(), -2.F);
  work.disparity_left.assign(work.left.pixels.size(), 0.F);
  work.best_right.assign(work.right.pixels.size(), -2.F);
  work.disparity_right.assign(work.right.pixels.size(), 0);
  work.consistent.assign(work.left.pixels.size(), kNan);
  // Only disparities that meet the other image: -right_width < d < left_width.
  const int d_min = static_cast<int>(std::max(std::floor(options.disparity_min / scale) - 1, 1.0 - right_width));
  const int d_max = static_cast<int>(std::min(std::ceil(options.disparity_max / scale) + 1, width - 1.0));
  if (d_max < d_min || height <= 2 * half) return;
  const int d_count = (d_max - d_min + 1 + 7) / 8 * 8;

  const int rows = height - 2 * half, bands = (rows + kBandRows - 1) / kBandRows;
  const std::size_t columns = static_cast<std::size_t>(width) * d_count;
  const std::size_t slice =
      columns + 6 * static_cast<std::size_t>(width + d_count) + 2 * static_cast<std::size_t>(d_count);
  work.scratch.resize(slice * bands);
  const auto kernel = run.isa == Isa::kAvx2 ? kernels::coarse_band_avx2 : kernels::coarse_band_baseline;
  parallel_for(
      run, bands, 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          float* scratch = work.scratch.data() + slice * i;
          kernels::CoarseBand band{};
          band.left = work.left.row(0), band.right = work.right.row(0);
          band.left_mean = work.left_mean.row(0), band.left_norm = work.left_norm.row(0);
          band.right_mean = work.right_mean.row(0), band.right_norm = work.right_norm.row(0);
          band.left_width = width, band.right_width = right_width, band.height = height;
          band.half = half, band.d_min = d_min, band.d_count = d_count;
          band.row_begin = half + static_cast<int>(i) * kBandRows;
          band.row_end = std::min(band.row_begin + kBandRows, height - half);
          band.columns = scratch;
          band.reversed = scratch + columns;
          band.sums = band.reversed + 6 * static_cast<std::size_t>(width + d_count);
          band.best_left = work.best_left.data(), band.second_left = work.second_left.data(),
          band.disparity_left = work.disparity_left.data();
          band.best_right = work.best_right.data(), band.disparity_right = work.disparity_right.data();
          kernel(band);
        }
      },
      "matching");

  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * width + x;
      if (work.best_left[i] < options.min_correlation) continue;
      if (work.second_left[i] > kAmbiguous * work.best_left[i]) {  // a repeated pattern: either may be true
        map.ambiguous[static_cast<std::size_t>(y) * map.width + x] = 1;
        continue;
      }
      const float d = work.disparity_left[i];
      const int x_right = static_cast<int>(std::lround(static_cast<float>(x) - d));
      if (x_right < 0 || x_right >= right_width) continue;
      const std::size_t r = static_cast<std::size_t>(y) * right_width + x_right;
      if (std::abs(static_cast<float>(work.disparity_right[r]) - d) <= 1.5F) work.consistent[i] = d;
    }
  parallel_for(
      run, height, 32,
      [&](std::int64_t begin, std::int64_t end) {
        for (int y = static_cast<int>(begin); y < end; ++y)
          for (int x = 0; x < width; ++x)
            map.matches[static_cast<std::size_t>(y) * map.width + x] = fit_plane(work, width, height, x, y, scale);
      },
      "matching");
}

}  // namespace sgrt
