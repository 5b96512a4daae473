#include "stereo/dense.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

using kernels::RowMatch;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kTorn = 0.5F;  // px between what two neighbouring nodes say of each other

bool solved(const MatchField& field, std::int64_t k) {
  return field.reason[k] == Reason::kNone;
}

// The shift of one row, from the nodes above and below it.
void shift_row(const Grid& nodes, const MatchField& field, const std::vector<Cell>& cells, int y, int width,
               float* shift) {
  const int step = nodes.stride;
  const int above = std::clamp((y - nodes.offset) / step, 0, std::max(0, nodes.height - 2));
  const int nearest_row = std::clamp((y - nodes.offset + step / 2) / step, 0, nodes.height - 1);
  const bool between = y >= nodes.offset && above + 1 < nodes.height && y < nodes.offset + (above + 1) * step;
  const float v = static_cast<float>(y - nodes.offset - above * step) / static_cast<float>(step);
  for (int column = -1; column < nodes.width; ++column) {
    const int from = std::max(0, nodes.offset + column * step);
    const int to = column + 1 == nodes.width ? width : std::min(width, nodes.offset + (column + 1) * step);
    const std::int64_t k = static_cast<std::int64_t>(above) * nodes.width + column;
    if (between && column >= 0 && column + 1 < nodes.width && cells[k] == Cell::kSmooth) {
      const RowMatch *p = &field.matches[k], *q = p + nodes.width;
      const float d = p[0].d + v * (q[0].d - p[0].d), next = p[1].d + v * (q[1].d - p[1].d);
      const float slope = (next - d) / static_cast<float>(step);
      for (int x = from; x < to; ++x) shift[x] = d + slope * static_cast<float>(x - from);
      continue;
    }
    for (int side = 0; side < 2; ++side) {  // the half nearer to the node on the left, then the other
      const int middle = std::clamp(nodes.offset + column * step + (step + 1) / 2, from, std::max(from, to));
      const int node = std::clamp(column + side, 0, nodes.width - 1);
      const std::int64_t n = static_cast<std::int64_t>(nearest_row) * nodes.width + node;
      const RowMatch& m = field.matches[n];
      const bool good = solved(field, n);
      const float dy = static_cast<float>(y - nodes.y(n));
      for (int x = side == 0 ? from : middle; x < (side == 0 ? std::min(middle, to) : to); ++x)
        shift[x] = good ? m.d + m.a * static_cast<float>(x - nodes.x(n)) + m.b * dy : kNan;
    }
  }
}

}  // namespace

void tear(const Grid& nodes, const MatchField& field, std::vector<Cell>& cells) {
  cells.assign(nodes.size(), Cell::kOpen);
  const auto step = static_cast<float>(nodes.stride);
  for (int j = 0; j + 1 < nodes.height; ++j)
    for (int i = 0; i + 1 < nodes.width; ++i) {
      const std::int64_t k = static_cast<std::int64_t>(j) * nodes.width + i;
      const std::int64_t corner[4] = {k, k + 1, k + nodes.width + 1, k + nodes.width};
      int count = 0;
      bool torn = false;
      for (int c = 0; c < 4; ++c) {
        count += solved(field, corner[c]);
        const std::int64_t p = std::min(corner[c], corner[(c + 1) % 4]), q = std::max(corner[c], corner[(c + 1) % 4]);
        if (!solved(field, p) || !solved(field, q)) continue;
        const RowMatch &m = field.matches[p], &n = field.matches[q];
        const float slope = c % 2 == 0 ? m.a + n.a : m.b + n.b;
        torn = torn || !(std::abs(n.d - m.d - step * slope / 2) <= kTorn);
      }
      cells[k] = torn ? Cell::kTorn : count == 4 ? Cell::kSmooth : Cell::kOpen;
    }
}

void warp(const Run& run, const RectifiedImage& left, const RectifiedImage& right, const Grid& nodes,
          const MatchField& field, const std::vector<Cell>& cells, WarpWork& work) {
  const kernels::Plane l = left.plane(), r = right.plane();
  work.stride = (l.width + 7) / 8 * 8;
  const std::size_t size = static_cast<std::size_t>(work.stride) * l.height + 8;
  work.g.resize(size), work.d.resize(size), work.keep.resize(size);
  double sum = 0;
  std::int64_t count = 0;
  for (std::int64_t k = 0; k < nodes.size(); k += 7)
    if (solved(field, k)) sum += field.matches[k].d, ++count;
  work.origin = static_cast<float>(std::round(count > 0 ? sum / static_cast<double>(count) : 0));
  const auto kernel = run.isa == Isa::kAvx2 ? kernels::warp_row_avx2 : kernels::warp_row_baseline;
  parallel_for(
      run, l.height, 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (int y = static_cast<int>(begin); y < end; ++y) {
          const std::size_t at = static_cast<std::size_t>(y) * work.stride;
          float* d = &work.d[at];
          shift_row(nodes, field, cells, y, l.width, d);
          std::fill(d + l.width, d + work.stride, kNan);
          const std::size_t from = static_cast<std::size_t>(y) * r.width;
          kernel({r.coefficient + from, r.mask + from, l.mask + static_cast<std::size_t>(y) * l.width, d, &work.g[at],
                  d, &work.keep[at], l.width, r.width, work.origin});
        }
      },
      "warping");
}

void dense_step(const Run& run, const RectifiedImage& left, const WarpWork& warped, const Grid& grid,
                const DenseStep& step, std::vector<RowMatch>& matches) {
  const kernels::Plane l = left.plane();
  const kernels::DensePlanes planes{l.value, l.gradient, warped.g.data(), warped.d.data(), warped.keep.data(),
                                    l.width, l.height,   warped.stride};
  const auto kernel = run.isa == Isa::kAvx2 ? kernels::dense_row_avx2 : kernels::dense_row_baseline;
  matches.resize(grid.size());
  parallel_for(
      run, grid.height, 4,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t j = begin; j < end; ++j) {
          const std::int64_t at = j * grid.width;
          const std::uint8_t* wanted = step.wanted ? step.wanted + at : nullptr;
          kernel(planes, grid.y(at), grid.offset, grid.stride, grid.width, {step.window / 2, step.min_variance, wanted},
                 &matches[at]);
          for (std::int64_t k = at; k < at + grid.width; ++k) {
            RowMatch& m = matches[k];
            m.d += warped.origin, m.texture /= step.damping;
            m.window = step.window;
            m.gain = 1, m.bias2 = m.c20 = m.c11 = m.c02 = 0;
          }
        }
      },
      "refining");
}

}  // namespace sgrt
