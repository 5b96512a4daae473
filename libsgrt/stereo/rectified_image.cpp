#include "stereo/rectified_image.hpp"

#include <algorithm>

#include "core/parallel.hpp"
#include "stereo/spline.hpp"

namespace sgrt {

void prepare(const Run& run, RectifiedImage& image) {
  const int w = image.value.width, h = image.value.height;
  const std::size_t size = static_cast<std::size_t>(w) * h, spare = size + static_cast<std::size_t>(w) + 64;
  image.scratch = image.value;
  quintic_spline_rows(run, image.scratch);
  image.coefficient.assign(spare, 0.F);
  image.gradient.assign(spare, 0.F);
  std::copy_n(image.scratch.pixels.begin(), size, image.coefficient.begin());
  image.value.pixels.resize(spare, 0.F);
  parallel_for(
      run, h, 64,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t y = begin; y < end; ++y) {
          const float* c = image.coefficient.data() + y * w;
          float* g = image.gradient.data() + y * w;
          // Exact for the spline at its knots.
          for (int x = 2; x + 2 < w; ++x) g[x] = (50 * (c[x + 1] - c[x - 1]) + 5 * (c[x + 2] - c[x - 2])) / 120;
        }
      },
      "interpolating");
}

}  // namespace sgrt
