#include "stereo/nodes.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

using kernels::RowMatch;
constexpr int kBlock = 512;      // nodes: about 2 ms
constexpr float kSharp = 0.04F;  // px of bending: the slopes of the larger window no longer follow the surface

// A plane at every node that the coarse map reaches; the others wait for growth.
void seed(const CoarseMap& coarse, const Grid& nodes, MatchField& field) {
  const float centre = static_cast<float>(coarse.scale - 1) / 2;
  field.matches.assign(nodes.size(), kNoMatch);
  field.reason.assign(nodes.size(), Reason::kNoMatch);
  for (std::int64_t k = 0; k < nodes.size(); ++k) {
    const int x = nodes.x(k), y = nodes.y(k);
    const CoarseMatch& c = coarse.at_pixel(x, y);
    if (!(c.d == c.d)) continue;
    const float dx = static_cast<float>(x % coarse.scale) - centre, dy = static_cast<float>(y % coarse.scale) - centre;
    RowMatch& match = field.matches[k];
    match.d = c.d + c.a * dx + c.b * dy, match.a = c.a, match.b = c.b;
    field.reason[k] = Reason::kNone;
  }
}

// The solved neighbour with the best correlation, -1 if none.
std::int64_t best_neighbour(const Grid& grid, const MatchField& field, std::int64_t k) {
  const int column = static_cast<int>(k % grid.width), row = static_cast<int>(k / grid.width);
  std::int64_t best = -1;
  for (int j = std::max(row - 1, 0); j <= std::min(row + 1, grid.height - 1); ++j)
    for (int i = std::max(column - 1, 0); i <= std::min(column + 1, grid.width - 1); ++i) {
      const std::int64_t n = static_cast<std::int64_t>(j) * grid.width + i;
      if (field.reason[n] != Reason::kNone) continue;
      if (best < 0 || field.matches[n].correlation > field.matches[best].correlation) best = n;
    }
  return best;
}

// Nodes that the coarse map does not reach, at the images' rims and on slopes, are tried with the plane of a neighbour.
void extend(MatchWork& work) {
  const Grid& nodes = work.nodes;
  std::vector<std::int64_t>& wave = work.field.wave;
  for (int ring = 0; ring < 4; ++ring) {
    wave.clear();
    for (std::int64_t k = 0; k < nodes.size(); ++k) {
      if (work.field.reason[k] == Reason::kNone) continue;
      const std::int64_t from = best_neighbour(nodes, work.field, k);
      if (from < 0) continue;
      work.field.matches[k] =
          extrapolate(work.field.matches[from], nodes.x(k) - nodes.x(from), nodes.y(k) - nodes.y(from));
      wave.push_back(k);
    }
    for (const std::int64_t k : wave) work.field.reason[k] = Reason::kNone;
  }
}

// A step of all nodes. One that does not correlate, or moves further than the step is good for, is refined alone.
void step_nodes(const Run& run, const Matcher& matcher, const RectifiedImage& left, const RectifiedImage& right,
                float max_move, float min_correlation, MatchWork& work) {
  const Grid& nodes = work.nodes;
  tear(nodes, work.field, work.cells);
  warp(run, left, right, nodes, work.field, work.cells, work.warp);
  dense_step(run, left, work.warp, nodes, {matcher.options.window, matcher.min_variance, matcher.damping, nullptr},
             work.fresh);
  parallel_for(
      run, nodes.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          if (work.field.reason[k] != Reason::kNone) continue;
          RowMatch &old = work.field.matches[k], &fresh = work.fresh[k];
          if (fresh.outcome == kernels::kConverged && fresh.correlation >= min_correlation &&
              std::abs(fresh.d - old.d) <= max_move && std::abs(fresh.a) < 0.7F && std::abs(fresh.b) < 2) {
            old = fresh;
            continue;
          }
          RowMatch match = kNoMatch;
          match.d = old.d, match.a = old.a, match.b = old.b;
          work.field.reason[k] = matcher.solve(nodes.x(k), nodes.y(k), match, 6);
          old = match;
        }
      },
      "refining");
}

// Waves: every unsolved point beside a solved one is tried from its best neighbour's plane; what is solved feeds the
// next wave. A wave reads only what earlier waves wrote, so the result does not depend on the threads.
void grow(const Run& run, const Matcher& matcher, const Grid& grid, MatchField& field) {
  field.tried.assign(grid.size(), -1);  // the neighbour tried last
  std::vector<RowMatch>& matches = field.matches;
  for (bool grew = true; grew;) {
    field.wave.clear();
    for (std::int64_t k = 0; k < grid.size(); ++k) {
      if (field.reason[k] == Reason::kNone || field.reason[k] == Reason::kSaturated) continue;
      const std::int64_t from = best_neighbour(grid, field, k);
      if (from < 0 || from == field.tried[k]) continue;
      field.tried[k] = from;
      field.wave.push_back(k);
    }
    field.labels.assign(field.wave.size(), 0);
    parallel_for(
        run, static_cast<std::int64_t>(field.wave.size()), kBlock / 2,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t w = begin; w < end; ++w) {
            const std::int64_t k = field.wave[w], from = field.tried[k];
            RowMatch match = extrapolate(matches[from], grid.x(k) - grid.x(from), grid.y(k) - grid.y(from));
            Reason reason = matcher.solve(grid.x(k), grid.y(k), match, 2);
            if (reason == Reason::kNoTexture || reason == Reason::kNoMatch) {  // weak: what a larger window holds
              RowMatch wide = extrapolate(matches[from], grid.x(k) - grid.x(from), grid.y(k) - grid.y(from));
              const Reason r = matcher.solve(grid.x(k), grid.y(k), wide, 2, large_window(matcher.options.window));
              if (r == Reason::kNone) reason = r, match = wide;
            }
            field.labels[w] = static_cast<std::int64_t>(reason);
            // Written where no other point of this wave reads: points of a wave are unsolved.
            matches[k] = match;
          }
        },
        "growing");
    grew = false;
    for (std::size_t w = 0; w < field.wave.size(); ++w) {
      const auto reason = static_cast<Reason>(field.labels[w]);
      field.reason[field.wave[w]] = reason;
      grew = grew || reason == Reason::kNone;
    }
  }
}

// The curvature of the nodes' neighbourhoods, from their slopes. What could as well be noise is taken back, so that a
// flat surface does not pay for it (eq. 15).
void bend(const Run& run, MatchWork& work) {
  parallel_for(
      run, work.nodes.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          RowMatch& m = work.field.matches[k];
          m.c20 = m.c11 = m.c02 = 0, m.gain = 1;
          const BendingNoise& noise = m.window == work.window ? work.noise_of_bend : work.noise_of_small;
          const double m2 = second_moment(m.window), m4 = m2 * m2;
          if (work.field.reason[k] != Reason::kNone || !curvature_at(work.nodes, work.field, k, m)) continue;
          const double size2 = m4 * (m.c20 * m.c20 + m.c02 * m.c02 + m.c11 * m.c11 / 2);
          const double chance2 = 6 * noise.correction * variance_of_noise(m);
          const double share = size2 * size2 / (size2 * size2 + chance2 * chance2 + 1e-30);
          const auto s = static_cast<float>(share);
          m.c20 *= s, m.c11 *= s, m.c02 *= s;
          m.gain = static_cast<float>(1 + (noise.gain - 1) * share);
        }
      },
      "refining");
}

// A torn cell, or one that has a surface on one side and none on the other: there a window shows the object's outline.
std::uint8_t border_of(const MatchWork& work, std::int64_t cell) {
  if (work.cells[cell] != Cell::kOpen) return work.cells[cell] == Cell::kTorn ? kTornEdge : 0;
  const std::int64_t corner[4] = {cell, cell + 1, cell + work.nodes.width, cell + work.nodes.width + 1};
  bool some = false, none = false;
  for (const std::int64_t k : corner) {
    some = some || work.field.reason[k] == Reason::kNone;
    none = none || (work.field.reason[k] != Reason::kNone && work.field.reason[k] != Reason::kOutOfView);
  }
  return some && none ? kOutline : 0;
}

// Nodes of which a torn cell lies within the reach of a window.
void find_edges(int window, MatchWork& work) {
  const Grid& n = work.nodes;
  const int reach = (window / 2 + n.stride - 1) / n.stride;
  work.near_edge.assign(n.size(), 0);
  for (int j = 0; j + 1 < n.height; ++j)
    for (int i = 0; i + 1 < n.width; ++i) {
      const std::uint8_t kind = border_of(work, static_cast<std::int64_t>(j) * n.width + i);
      if (kind == 0) continue;
      for (int v = std::max(0, j - reach + 1); v <= std::min(n.height - 1, j + reach); ++v)
        for (int u = std::max(0, i - reach + 1); u <= std::min(n.width - 1, i + reach); ++u)
          if (std::uint8_t& edge = work.near_edge[static_cast<std::size_t>(v) * n.width + u]; edge != kTornEdge)
            edge = kind;
    }
}

// Nodes near an edge, or where the surface bends strongly, are made again with a smaller window: their slopes then
// follow the surface more closely, and with them the curvature.
void sharpen(const Run& run, const Matcher& matcher, const RectifiedImage& left, MatchWork& work) {
  const Grid& nodes = work.nodes;
  const int window = small_window(work.window);
  work.sharp.assign(nodes.size(), 0);
  bool any = false;
  for (std::int64_t k = 0; k < nodes.size(); ++k) {
    if (work.field.reason[k] != Reason::kNone) continue;
    work.sharp[k] = work.near_edge[k] != 0 || bending_of(work.window, work.field.matches[k]) > kSharp;
    any = any || work.sharp[k] != 0;
  }
  if (!any) return;
  dense_step(run, left, work.warp, nodes, {window, matcher.min_variance, matcher.damping, work.sharp.data()},
             work.fresh);
  parallel_for(
      run, nodes.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          if (work.sharp[k] == 0) continue;
          RowMatch &m = work.field.matches[k], &fresh = work.fresh[k];
          bool sound = work.near_edge[k] != kTornEdge && fresh.outcome == kernels::kConverged &&
                       fresh.correlation >= matcher.options.min_correlation && std::abs(fresh.d - m.d) < kFar;
          if (!sound) {
            fresh = m;
            sound = matcher.solve(nodes.x(k), nodes.y(k), fresh, 1, window) == Reason::kNone;
          }
          if (sound) m = fresh;
        }
      },
      "refining");
  bend(run, work);
}

}  // namespace

Grid make_nodes(int width, int height, int window) {
  Grid nodes;
  nodes.stride = std::clamp(window / 4, 4, 8);
  nodes.offset = nodes.stride / 2;
  nodes.width = std::max(1, (width - nodes.offset - 1) / nodes.stride + 1);
  nodes.height = std::max(1, (height - nodes.offset - 1) / nodes.stride + 1);
  return nodes;
}

void solve_nodes(const Run& run, const Matcher& matcher, const RectifiedImage& left, const RectifiedImage& right,
                 const CoarseMap& coarse, MatchWork& work) {
  const StereoOptions& options = matcher.options;
  seed(coarse, work.nodes, work.field);
  step_nodes(run, matcher, left, right, static_cast<float>(coarse.scale), 0.3F, work);
  extend(work);
  step_nodes(run, matcher, left, right, 0.7F, static_cast<float>(options.min_correlation), work);
  grow(run, matcher, work.nodes, work.field);
  bend(run, work);
  tear(work.nodes, work.field, work.cells);
  find_edges(options.window, work);
  warp(run, left, right, work.nodes, work.field, work.cells, work.warp);
  sharpen(run, matcher, left, work);
}

}  // namespace sgrt
