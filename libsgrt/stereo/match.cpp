#include "stereo/match.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/parallel.hpp"
#include "stereo/nodes.hpp"
#include "stereo/screen.hpp"

namespace sgrt {
namespace {

using kernels::RowMatch;
constexpr int kBlock = 512;  // grid points: about 2 ms

// The four nodes round a pixel, the nearest first.
void nodes_round(const Grid& nodes, int x, int y, std::int64_t out[4]) {
  const auto split = [](int at, int offset, int step, int count, int& near, int& far) {
    const int cell = std::clamp((at - offset) / step, 0, count - 1), next = std::min(cell + 1, count - 1);
    const bool lower = at - offset - cell * step <= step / 2;
    near = lower ? cell : next, far = lower ? next : cell;
  };
  int i[2], j[2];
  split(x, nodes.offset, nodes.stride, nodes.width, i[0], i[1]);
  split(y, nodes.offset, nodes.stride, nodes.height, j[0], j[1]);
  for (int k = 0; k < 4; ++k) out[k] = static_cast<std::int64_t>(j[k / 2]) * nodes.width + i[k % 2];
}

// The curvature at a pixel: between the four nodes of a smooth cell, else the nearest node's.
RowMatch shape_at(const MatchWork& work, int x, int y, std::int64_t near) {
  const Grid& n = work.nodes;
  const int i = (x - n.offset) / n.stride, j = (y - n.offset) / n.stride;
  const std::int64_t k = static_cast<std::int64_t>(j) * n.width + i;
  RowMatch shape = work.field.matches[near];
  if (x < n.offset || y < n.offset || i >= n.width || j >= n.height || work.cells[k] != Cell::kSmooth) return shape;
  const RowMatch *p = &work.field.matches[k], *q = p + n.width;
  const float u = static_cast<float>(x - n.x(k)) / static_cast<float>(n.stride);
  const float v = static_cast<float>(y - n.y(k)) / static_cast<float>(n.stride);
  const auto blend = [&](float RowMatch::*c) {
    return (1 - v) * ((1 - u) * p[0].*c + u * p[1].*c) + v * ((1 - u) * q[0].*c + u * q[1].*c);
  };
  shape.c20 = blend(&RowMatch::c20), shape.c11 = blend(&RowMatch::c11), shape.c02 = blend(&RowMatch::c02);
  shape.gain = blend(&RowMatch::gain);
  return shape;
}

// What a window near an edge or a hole needs: a refinement of its own, from the planes of the nodes round it.
Reason refine_alone(const Matcher& matcher, const MatchWork& work, int x, int y, RowMatch& match) {
  std::int64_t round[4];
  nodes_round(work.nodes, x, y, round);
  Reason reason = Reason::kNoMatch;
  RowMatch best = kNoMatch;
  for (int t = 0; t < 4; ++t) {
    const std::int64_t n = round[t];
    if (work.field.reason[n] != Reason::kNone || std::find(round, round + t, n) != round + t) continue;
    const RowMatch& node = work.field.matches[n];
    RowMatch tried = extrapolate(node, x - work.nodes.x(n), y - work.nodes.y(n));
    if (best.d == best.d && std::abs(tried.d - best.d) < 0.5F) continue;  // the same surface again
    tried.c20 = node.c20, tried.c11 = node.c11, tried.c02 = node.c02, tried.gain = node.gain;
    const bool small = work.near_edge[n] != 0 || bending_of(work.window, node) > 1.5F * kBent;
    const RowMatch start = tried;
    Reason r = matcher.solve(x, y, tried, 2, small ? small_window(work.window) : node.window);
    if (small && work.near_edge[n] != kTornEdge && r != Reason::kNone) {
      tried = start;
      r = matcher.solve(x, y, tried, 2, node.window);
    }
    if (r == Reason::kNone && (reason != Reason::kNone || tried.correlation > best.correlation)) {
      reason = r, best = tried;
    } else if (reason == Reason::kNoMatch) {
      reason = r;
      if (!(best.d == best.d)) best = tried;
    }
  }
  match = best;
  return reason == Reason::kNone && !matcher.returns(x, y, match) ? Reason::kLeftRight : reason;
}

// The grid points that a smaller window must serve.
bool want_small(const Run& run, const Grid& grid, MatchWork& work) {
  work.bent.resize(grid.size());
  std::atomic<bool> any{false};
  parallel_for(
      run, grid.size(), kBlock * 8,
      [&](std::int64_t begin, std::int64_t end) {
        bool some = false;
        for (std::int64_t k = begin; k < end; ++k) {
          std::int64_t round[4];
          nodes_round(work.nodes, grid.x(k), grid.y(k), round);
          work.bent[k] = work.field.reason[round[0]] == Reason::kNone && work.near_edge[round[0]] == 0 &&
                         bending_of(work.window, shape_at(work, grid.x(k), grid.y(k), round[0])) > kBent;
          some = some || work.bent[k] != 0;
        }
        if (some) any = true;
      },
      "refining");
  return any;
}

void unbend(const RowMatch& shape, RowMatch& m) {
  m.c20 = shape.c20, m.c11 = shape.c11, m.c02 = shape.c02, m.gain = shape.gain;
  m.d -= m.w20 * m.c20 + m.w11 * m.c11 + m.w02 * m.c02;
}

// The mean of both windows' answers. The larger one holds the smaller one's pixels: their covariance is its variance.
void mix(float share, const RowMatch& small, RowMatch& m) {
  const float rest = 1 - share;
  m.d = rest * m.d + share * small.d, m.a = rest * m.a + share * small.a, m.b = rest * m.b + share * small.b;
  m.texture = (rest * rest + 2 * rest * share) * m.texture + share * share * small.texture;
  m.spread = std::min(m.spread, small.spread);
  m.window = share > 0.5F ? small.window : m.window;
  m.noise = rest * m.noise + share * small.noise, m.correlation = rest * m.correlation + share * small.correlation;
}

bool served_by_nodes(const MatchWork& work, const Grid& grid, std::int64_t k, std::int64_t& near) {
  std::int64_t round[4];
  nodes_round(work.nodes, grid.x(k), grid.y(k), round);
  near = round[0];
  return work.field.reason[near] == Reason::kNone && work.near_edge[near] == 0;
}

// Takes the curvature off the answers of both windows.
void bend_grid(const Run& run, const Grid& grid, MatchWork& work, MatchField& field) {
  parallel_for(
      run, grid.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          std::int64_t near;
          if (!served_by_nodes(work, grid, k, near)) continue;
          const RowMatch shape = shape_at(work, grid.x(k), grid.y(k), near);
          if (field.matches[k].outcome == kernels::kConverged) unbend(shape, field.matches[k]);
          if (work.bent[k] != 0 && work.small[k].outcome == kernels::kConverged) unbend(shape, work.small[k]);
        }
      },
      "refining");
}

// The share of the smaller window that balances its noise with what the larger one smooths away: the mean difference
// of the two over the neighbourhood, beyond noise (eq. 15b). Where the surface bends strongly that mean is smoothed,
// too.
float share_of_small(const Grid& grid, const MatchWork& work, const MatchField& field, std::int64_t k) {
  const RowMatch &large = field.matches[k], &small = work.small[k];
  if (small.outcome != kernels::kConverged) return 0;
  if (large.outcome != kernels::kConverged) return 1;
  const int reach = std::max(1, small.window / 4 / grid.stride);
  const int column = static_cast<int>(k % grid.width), row = static_cast<int>(k / grid.width);
  float n = 0, sum = 0;
  for (int j = std::max(0, row - reach); j <= std::min(grid.height - 1, row + reach); ++j)
    for (int i = std::max(0, column - reach); i <= std::min(grid.width - 1, column + reach); ++i) {
      const std::int64_t q = static_cast<std::int64_t>(j) * grid.width + i;
      if (work.bent[q] == 0 || work.small[q].outcome != kernels::kConverged) continue;
      if (field.matches[q].outcome != kernels::kConverged) continue;
      const float off = work.small[q].d - field.matches[q].d;
      if (std::abs(off) < kFar) n += 1, sum += off;
    }
  // Variance of the difference: of one window, and of the mean of what the neighbourhood holds of them.
  const auto noise = static_cast<float>(variance_of_noise(small) - variance_of_noise(large));
  if (!(n > 0) || !(noise > 0)) return 1;
  const float side = static_cast<float>((2 * reach + 1) * grid.stride) / static_cast<float>(small.window);
  const float bias2 = sum * sum / (n * n) - noise / (1 + side * side);
  const float strong = std::clamp(bending_of(work.window, small) / kStrong - 1, 0.F, 1.F);
  return std::max(strong, bias2 > 0 ? bias2 / (bias2 + noise) : 0);
}

// Takes the dense answer of every grid point where it is sound; refines the others alone.
void finish(const Run& run, const Matcher& matcher, const Grid& grid, MatchWork& work, MatchField& field) {
  const StereoOptions& o = matcher.options;
  work.share.assign(grid.size(), 0.F);
  parallel_for(
      run, grid.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k)
          if (work.bent[k] != 0) work.share[k] = share_of_small(grid, work, field, k);
      },
      "refining");
  parallel_for(
      run, grid.size(), kBlock / 2,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          const int x = grid.x(k), y = grid.y(k);
          RowMatch& m = field.matches[k];
          std::int64_t near;
          if (served_by_nodes(work, grid, k, near)) {
            const RowMatch& node = work.field.matches[near];
            const float at_node = node.d + node.a * static_cast<float>(x - work.nodes.x(near)) +
                                  node.b * static_cast<float>(y - work.nodes.y(near));
            if (m.outcome != kernels::kConverged && work.share[k] > 0)
              m = work.small[k];
            else if (work.share[k] > 0)
              mix(work.share[k], work.small[k], m);
            m.noise = std::max(m.noise, matcher.rounding);
            if (m.outcome == kernels::kConverged && std::abs(m.d - at_node) < kFar &&
                m.correlation >= o.min_correlation && matcher.textured(m)) {
              field.reason[k] = Reason::kNone;
              continue;
            }
          }
          field.reason[k] = refine_alone(matcher, work, x, y, m);
        }
      },
      "refining");
}

// Two left pixels that claim one place of the right image cannot both be seen there: the better correlated stays.
void check_left_right(const Grid& grid, int right_width, float tolerance, std::vector<std::int64_t>& seen,
                      MatchField& field) {
  const int columns = right_width / grid.stride + 1;
  seen.assign(static_cast<std::size_t>(columns) * grid.height, -1);
  for (std::int64_t k = 0; k < grid.size(); ++k) {
    if (field.reason[k] != Reason::kNone) continue;
    const RowMatch& m = field.matches[k];
    const float at = static_cast<float>(grid.x(k)) - m.d;
    const int column = std::clamp(static_cast<int>(at) / grid.stride, 0, columns - 1);
    std::int64_t& other = seen[static_cast<std::size_t>(k / grid.width) * columns + column];
    if (other >= 0) {
      const RowMatch& o = field.matches[other];
      const float there = o.d + o.a * static_cast<float>(grid.x(k) - grid.x(other));
      if (std::abs(there - m.d) > tolerance + 0.1F * static_cast<float>(grid.stride)) {
        const bool worse = m.correlation < o.correlation;
        field.reason[worse ? k : other] = Reason::kLeftRight;
        if (worse) continue;
      }
    }
    other = k;
  }
}

}  // namespace

void match_grid(const Run& run, const RectifiedImage& left, const RectifiedImage& right, const CoarseMap& coarse,
                const Grid& grid, const StereoOptions& options, MatchWork& work, MatchField& field) {
  const Matcher matcher(run, left, right, options);
  work.nodes = make_nodes(left.value.width, left.value.height, options.window);
  if (work.window != options.window) {
    work.noise_of_bend = bending_noise(options.window, work.nodes.stride);
    work.noise_of_small = bending_noise(small_window(options.window), work.nodes.stride);
    work.window = options.window;  // last: where memory ends before, they are made again
  }
  solve_nodes(run, matcher, left, right, coarse, work);
  dense_step(run, left, work.warp, grid, {options.window, matcher.min_variance, matcher.damping, nullptr},
             field.matches);
  if (want_small(run, grid, work))
    dense_step(run, left, work.warp, grid,
               {small_window(options.window), matcher.min_variance, matcher.damping, work.bent.data()}, work.small);
  bend_grid(run, grid, work, field);
  field.reason.assign(grid.size(), Reason::kNoMatch);
  finish(run, matcher, grid, work, field);
  unsmooth(run, grid, work.bent, work.share, field);
  check_left_right(grid, right.value.width, static_cast<float>(options.max_left_right), work.seen, field);
  judge_neighbourhood(run, grid, options, field);
  remove_islands(coarse, grid, options, field);
  work.epipolar =
      check_epipolar(run, left, work.warp, grid, options.window, matcher.damping, field, work.epipolar_work);
  explain_unmatched(run, matcher.left, coarse, grid, options, work.noise, field);
  tell_occluded(grid, right.value.width, work.share, field);
}

}  // namespace sgrt
