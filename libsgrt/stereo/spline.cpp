// The recursive prefilters of B-splines: for each pole a causal and an anticausal first-order filter.
// Unser, Aldroubi, Eden, "B-spline signal processing: part II", IEEE TSP 41 (1993). docs/theory/stereo.md.
#include "stereo/spline.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr float kCubicPole = -0.26794919243112270647F;  // sqrt(3) - 2
constexpr float kQuinticPoles[2] = {-0.43057534709997379F, -0.043096288203264653F};
constexpr int kHorizon = 20;  // pole^20 < 5e-8: the mirrored start

// Filters `lanes` sequences side by side (they hide each other's latency): element n of lane l is at n * step + l *
// lane.
void prefilter(float* c, int n, std::ptrdiff_t step, int lanes, std::ptrdiff_t lane, float pole) {
  const float gain = (1 - pole) * (1 - 1 / pole);
  if (n < 2) return;
  constexpr int kMaxLanes = 64;
  float sum[kMaxLanes];
  for (int l = 0; l < lanes; ++l) sum[l] = c[l * lane];
  float power = pole;
  for (int k = 1; k < std::min(n, kHorizon); ++k, power *= pole)
    for (int l = 0; l < lanes; ++l) sum[l] += power * c[k * step + l * lane];
  for (int l = 0; l < lanes; ++l) c[l * lane] = gain * sum[l];
  for (int k = 1; k < n; ++k)
    for (int l = 0; l < lanes; ++l)
      c[k * step + l * lane] = gain * c[k * step + l * lane] + pole * c[(k - 1) * step + l * lane];
  const std::ptrdiff_t last = (n - 1) * step;
  for (int l = 0; l < lanes; ++l)
    c[last + l * lane] = pole / (pole * pole - 1) * (c[last + l * lane] + pole * c[last - step + l * lane]);
  for (int k = n - 2; k >= 0; --k)
    for (int l = 0; l < lanes; ++l)
      c[k * step + l * lane] = pole * (c[(k + 1) * step + l * lane] - c[k * step + l * lane]);
}

// Each row by each pole in turn.
void prefilter_rows(const Run& run, Image& image, std::initializer_list<float> poles) {
  constexpr int kLanes = 8;
  parallel_for(
      run, image.height, 8 * kLanes,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t y = begin; y < end; y += kLanes) {
          const int lanes = static_cast<int>(std::min<std::int64_t>(kLanes, end - y));
          for (const float pole : poles)
            prefilter(image.row(static_cast<int>(y)), image.width, 1, lanes, image.width, pole);
        }
      },
      "interpolating");
}

}  // namespace

void spline_rows(const Run& run, Image& image) {
  prefilter_rows(run, image, {kCubicPole});
}

void quintic_spline_rows(const Run& run, Image& image) {
  prefilter_rows(run, image, {kQuinticPoles[0], kQuinticPoles[1]});
}

void spline_columns(const Run& run, Image& image) {
  constexpr int kLanes = 64;
  parallel_for(
      run, image.width, kLanes,
      [&](std::int64_t begin, std::int64_t end) {
        prefilter(image.row(0) + begin, image.height, image.width, static_cast<int>(end - begin), 1, kCubicPole);
      },
      "interpolating");
}

}  // namespace sgrt
