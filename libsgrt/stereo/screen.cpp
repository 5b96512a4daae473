#include "stereo/screen.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/median.hpp"
#include "core/parallel.hpp"
#include "stereo/bend.hpp"

namespace sgrt {
namespace {

using kernels::RowMatch;
constexpr int kBlock = 2048;  // grid points

Reason explain(const kernels::Plane& image, int x0, int y0, int half, double noise) {
  if (x0 < half || y0 < half || x0 + half >= image.width || y0 + half >= image.height) return Reason::kOutOfView;
  double n = 0, sum = 0, square = 0, clipped = 0, outside = 0;
  for (int y = y0 - half; y <= y0 + half; ++y)
    for (int x = x0 - half; x <= x0 + half; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * image.width + x;
      const auto mask = static_cast<Reason>(image.mask[i]);
      const double g = image.value[i];
      n += 1, sum += g, square += g * g;
      clipped += mask == Reason::kSaturated, outside += mask == Reason::kOutOfView;
    }
  if (outside > 0) return Reason::kOutOfView;
  if (clipped > 0.4 * n) return Reason::kSaturated;
  // Contrast of less than twice the noise is no texture; without any match there is no noise to compare with.
  const double variance = (square - sum * sum / n) / n;
  return variance <= 4 * noise || !(variance > 1e-9 * square / n) ? Reason::kNoTexture : Reason::kNoMatch;
}

}  // namespace

void judge_neighbourhood(const Run& run, const Grid& grid, const StereoOptions& options, MatchField& field) {
  field.labels.assign(grid.size(), 0);
  parallel_for(
      run, grid.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          if (field.reason[k] != Reason::kNone) continue;
          RowMatch& own = field.matches[k];
          const int column = static_cast<int>(k % grid.width), row = static_cast<int>(k / grid.width);
          int asked = 0, solved = 0, blank = 0;
          double sum = 0, sum2 = 0, expected = 0;
          const double side = own.window, moment = second_moment(own.window);
          const int reach = std::max(1, (own.window / 2 + grid.stride / 2) / grid.stride);
          const int step = reach > 2 ? 2 : 1;  // the windows of direct neighbours are nearly the same
          for (int j = row - reach; j <= row + reach; j += step)
            for (int i = column - reach; i <= column + reach; i += step) {
              if (i < 0 || j < 0 || i >= grid.width || j >= grid.height) continue;
              ++asked;
              const std::int64_t q = static_cast<std::int64_t>(j) * grid.width + i;
              blank += field.reason[q] == Reason::kNoTexture ? 1 : 0;
              if (field.reason[q] != Reason::kNone) continue;
              const RowMatch& m = field.matches[q];
              const double x = (i - column) * grid.stride, y = (j - row) * grid.stride;
              const double off =
                  own.d + own.a * x + own.b * y + own.c20 * x * x + own.c11 * x * y + own.c02 * y * y - m.d;
              if (std::abs(off) > 1) continue;
              ++solved;
              // Noise alone: windows that overlap by rho share it, and the slopes carry theirs outwards (eq. 16).
              const double rho = std::max(0.0, 1 - std::abs(x) / side) * std::max(0.0, 1 - std::abs(y) / side);
              sum += off, sum2 += off * off;
              expected += variance_of_noise(m) * (1 - rho) * (2 + (x * x + y * y) / moment);
            }
          // What has no texture pulls at nothing, but must not be most of it.
          if (3 * solved < 2 * (asked - blank) || 3 * solved < asked) field.labels[k] = 1;
          // No other point reads this member.
          // A window's match is about the mean of what it shows: the mean excess moves it, the scatter a little.
          const double n = std::max(1, solved), mean = sum / n;
          own.bias2 += static_cast<float>(std::max(0.0, mean * mean - expected / n) +
                                          0.25 * std::max(0.0, (sum2 - 2 * expected) / n));
        }
      },
      "checking");
  for (std::int64_t k = 0; k < grid.size(); ++k) {
    if (field.reason[k] != Reason::kNone) continue;
    if (field.labels[k] != 0 || !(sigma_of(field.matches[k]) <= options.max_sigma)) field.reason[k] = Reason::kEdge;
  }
}

void remove_islands(const CoarseMap& coarse, const Grid& grid, const StereoOptions& options, MatchField& field) {
  field.labels.assign(grid.size(), 0);
  for (std::int64_t start = 0; start < grid.size(); ++start) {
    if (field.reason[start] != Reason::kNone || field.labels[start] != 0) continue;
    field.wave.assign(1, start);
    field.labels[start] = 1;
    for (std::size_t next = 0; next < field.wave.size(); ++next) {
      const std::int64_t k = field.wave[next];
      const int column = static_cast<int>(k % grid.width), row = static_cast<int>(k / grid.width);
      const auto visit = [&](int i, int j) {
        if (i < 0 || j < 0 || i >= grid.width || j >= grid.height) return;
        const std::int64_t n = static_cast<std::int64_t>(j) * grid.width + i;
        if (field.reason[n] != Reason::kNone || field.labels[n] != 0) return;
        const RowMatch carried = extrapolate(field.matches[k], grid.x(n) - grid.x(k), grid.y(n) - grid.y(k));
        if (std::abs(carried.d - field.matches[n].d) > 1) return;
        field.labels[n] = 1;
        field.wave.push_back(n);
      };
      visit(column - 1, row), visit(column + 1, row), visit(column, row - 1), visit(column, row + 1);
    }
    std::size_t doubtful = 0;
    for (const std::int64_t k : field.wave) doubtful += coarse.ambiguous_at(grid.x(k), grid.y(k)) ? 1 : 0;
    if (static_cast<int>(field.wave.size()) >= options.min_component && 2 * doubtful <= field.wave.size()) continue;
    for (std::int64_t k : field.wave) field.reason[k] = Reason::kAmbiguous;
  }
}

void explain_unmatched(const Run& run, const kernels::Plane& left, const CoarseMap& coarse, const Grid& grid,
                       const StereoOptions& options, std::vector<float>& noise, MatchField& field) {
  noise.clear();
  for (std::int64_t k = 0; k < grid.size(); ++k)
    if (field.reason[k] == Reason::kNone) noise.push_back(field.matches[k].noise);
  const double typical = noise.empty() ? 0 : median(noise) / 2;  // of one image
  parallel_for(
      run, grid.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k)
          if (field.reason[k] == Reason::kNoMatch && coarse.ambiguous_at(grid.x(k), grid.y(k)))
            field.reason[k] = Reason::kAmbiguous;
          else if (field.reason[k] == Reason::kNoMatch)
            field.reason[k] = explain(left, grid.x(k), grid.y(k), options.window / 2, typical);
      },
      "checking");
}

void tell_occluded(const Grid& grid, int right_width, std::vector<float>& front, MatchField& field) {
  const int columns = right_width / grid.stride + 1;
  const auto column_of = [&](float x) { return std::clamp(static_cast<int>(x) / grid.stride, 0, columns - 1); };
  for (int j = 0; j < grid.height; ++j) {
    const std::int64_t row = static_cast<std::int64_t>(j) * grid.width;
    front.assign(static_cast<std::size_t>(columns), -std::numeric_limits<float>::infinity());
    for (std::int64_t k = row; k < row + grid.width; ++k) {
      if (field.reason[k] != Reason::kNone) continue;
      float& nearest = front[column_of(static_cast<float>(grid.x(k)) - field.matches[k].d)];
      nearest = std::max(nearest, field.matches[k].d);
    }
    std::int64_t behind = -1;
    for (std::int64_t k = row; k < row + grid.width; ++k) {
      if (field.reason[k] == Reason::kNone) behind = k;
      if (field.reason[k] != Reason::kNoMatch || behind < 0) continue;
      const RowMatch& m = field.matches[behind];
      const float d = m.d + m.a * static_cast<float>(grid.x(k) - grid.x(behind));
      const int at = column_of(static_cast<float>(grid.x(k)) - d);
      for (int c = std::max(0, at - 1); c <= std::min(columns - 1, at + 1); ++c)
        if (front[c] > d + 2) field.reason[k] = Reason::kOccluded;
    }
  }
}

}  // namespace sgrt
