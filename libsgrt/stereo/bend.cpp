#include "stereo/bend.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr int kReach = 8;  // px round a window in which its curvature is sought

int reach_of(int stride) {
  return std::max(1, (kReach + stride / 2) / stride);
}

// The mean of the field over the window round k less its value there, in units of (c20 + c02); false where some of it
// is missing.
bool bend_of_field(const Grid& grid, const MatchField& field, std::int64_t k, int half, double& bend) {
  const int reach = std::max(1, half / grid.stride), column = static_cast<int>(k % grid.width);
  const int row = static_cast<int>(k / grid.width);
  if (column < reach || row < reach || column + reach >= grid.width || row + reach >= grid.height) return false;
  const kernels::RowMatch& own = field.matches[k];
  double sum = 0, moment = 0;
  int n = 0;
  for (int j = -reach; j <= reach; ++j)
    for (int i = -reach; i <= reach; ++i) {
      const std::int64_t q = k + static_cast<std::int64_t>(j) * grid.width + i;
      const double off = field.matches[q].d - own.d;
      const double plane = (own.a * i + own.b * j) * grid.stride;
      if (field.reason[q] != Reason::kNone || std::abs(off - plane) > 1) return false;
      sum += off, moment += i * i, ++n;
    }
  bend = sum / (moment * grid.stride * grid.stride);
  return true;
}

}  // namespace

void unsmooth(const Run& run, const Grid& grid, const std::vector<std::uint8_t>& bent, std::vector<float>& shift,
              MatchField& field) {
  shift.assign(static_cast<std::size_t>(grid.size()), 0.F);
  parallel_for(
      run, grid.size(), 1024,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          if (bent[k] == 0 || field.reason[k] != Reason::kNone) continue;
          const kernels::RowMatch& m = field.matches[k];
          double bend;
          if (!bend_of_field(grid, field, k, m.window / 2, bend)) continue;
          const double missing = second_moment(m.window) * (m.c20 + m.c02 - bend), missing2 = missing * missing;
          const double chance2 = variance_of_noise(m);
          shift[k] = static_cast<float>(missing * missing2 * missing2 / (missing2 * missing2 + chance2 * chance2));
        }
      },
      "refining");
  for (std::int64_t k = 0; k < grid.size(); ++k)
    field.matches[k].d += shift[k], field.matches[k].bias2 += 0.25F * shift[k] * shift[k];
}

bool curvature_at(const Grid& grid, const MatchField& field, std::int64_t k, kernels::RowMatch& match) {
  const int reach = reach_of(grid.stride);
  const int column = static_cast<int>(k % grid.width), row = static_cast<int>(k / grid.width);
  const kernels::RowMatch& own = field.matches[k];
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sa = 0, sb = 0, sax = 0, say = 0, sbx = 0, sby = 0;
  for (int j = std::max(row - reach, 0); j <= std::min(row + reach, grid.height - 1); ++j)
    for (int i = std::max(column - reach, 0); i <= std::min(column + reach, grid.width - 1); ++i) {
      const std::int64_t q = static_cast<std::int64_t>(j) * grid.width + i;
      if (field.reason[q] != Reason::kNone) continue;
      const kernels::RowMatch& m = field.matches[q];
      const double x = (i - column) * grid.stride, y = (j - row) * grid.stride;
      if (std::abs(own.d + own.a * x + own.b * y - m.d) > 1) continue;  // another surface
      n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y, syy += y * y;
      sa += m.a, sb += m.b, sax += m.a * x, say += m.a * y, sbx += m.b * x, sby += m.b * y;
    }
  if (n < 6) return false;
  const double xx = sxx - sx * sx / n, xy = sxy - sx * sy / n, yy = syy - sy * sy / n, det = xx * yy - xy * xy;
  if (!(det > 0.1 * xx * yy)) return false;
  const double ax = sax - sa * sx / n, ay = say - sa * sy / n, bx = sbx - sb * sx / n, by = sby - sb * sy / n;
  const double a_x = (yy * ax - xy * ay) / det, a_y = (xx * ay - xy * ax) / det;
  const double b_x = (yy * bx - xy * by) / det, b_y = (xx * by - xy * bx) / det;
  match.c20 = static_cast<float>(a_x / 2), match.c02 = static_cast<float>(b_y / 2);
  match.c11 = static_cast<float>((a_y + b_x) / 2);
  return true;
}

BendingNoise bending_noise(int window, int stride) {
  const int half = window / 2, reach = reach_of(stride), rim = reach * stride + half, side = 2 * rim + 1;
  const double n = window * window;
  double sxx = 0;
  for (int u = -reach; u <= reach; ++u) sxx += (2 * reach + 1) * static_cast<double>(u * stride) * (u * stride);
  // The weight of each pixel's noise in d - m2 (c20 + c02): its own window's mean, and the slopes of all around.
  std::vector<double> weight(static_cast<std::size_t>(side) * side, 0.0);
  for (int v = -reach; v <= reach; ++v)
    for (int u = -reach; u <= reach; ++u)
      for (int j = -half; j <= half; ++j)
        for (int i = -half; i <= half; ++i) {
          double& w = weight[static_cast<std::size_t>(v * stride + j + rim) * side + u * stride + i + rim];
          w -= (u * i + v * j) * stride / (2 * sxx * n);
        }
  BendingNoise noise;
  noise.gain = 0;
  for (int v = -rim; v <= rim; ++v)
    for (int u = -rim; u <= rim; ++u) {
      const double w = weight[static_cast<std::size_t>(v + rim) * side + u + rim];
      const double own = std::abs(u) <= half && std::abs(v) <= half ? 1 / n : 0;
      noise.correction += w * w * n;
      noise.gain += (w + own) * (w + own) * n;
    }
  return noise;
}

}  // namespace sgrt
