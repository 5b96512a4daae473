#include "stereo/match.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "stereo/screen.hpp"

namespace sgrt {
namespace {

using kernels::RowMatch;
constexpr int kBlock = 512;      // grid points: about 2 ms
constexpr float kBent = 0.02F;   // px: a curvature that moves a match by so much has higher orders too
constexpr float kSharp = 0.04F;  // px: and the slopes of the larger window no longer follow it
constexpr float kMinSpread = 0.3F;
constexpr float kFar = 0.5F;  // px from the nodes' surface: no longer a small step
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr RowMatch kNoMatch{kNan, 0, 0, 0, 0, 0, kNan, kNan, kNan, 1, 0, 0, 0, 0, 0, 0, kernels::kDiverged};

Reason reason_of(int outcome) {
  switch (outcome) {
    case kernels::kLeftView:
    case kernels::kRightView:
      return Reason::kOutOfView;
    case kernels::kClipped:
      return Reason::kSaturated;
    case kernels::kFlat:
      return Reason::kNoTexture;
    default:
      return Reason::kNoMatch;
  }
}

int small_window(int window) {
  return std::max(9, (window * 3 / 5) | 1);
}

struct Matcher {
  const kernels::Plane left, right;
  const StereoOptions& options;
  const float rounding;      // the noise of f - g is never below it
  const float damping;       // noise_damping
  const float min_variance;  // one grey level: below it both images may show the same dither
  decltype(&kernels::refine_row_baseline) refine;

  Matcher(const Run& run, const RectifiedImage& l, const RectifiedImage& r, const StereoOptions& o)
      : left(l.plane()),
        right(r.plane()),
        options(o),
        rounding(l.rounding + r.rounding),
        damping(static_cast<float>(noise_damping(l.noise_gain, r.noise_gain))),
        min_variance(12 * std::max(l.rounding, r.rounding)),
        refine(run.isa == Isa::kAvx2 ? kernels::refine_row_avx2 : kernels::refine_row_baseline) {}

  // A single line in the window, of a rim or a shadow, matches to any precision, but says nothing of a surface.
  bool textured(const RowMatch& match) const {
    return sigma_of(match) <= options.max_sigma && match.spread >= kMinSpread;
  }

  // Refines from the plane in `match`; the reason is kNone when it is accepted.
  Reason solve(int x, int y, RowMatch& match, float max_move, int window = 0) const {
    match.window = window > 0 ? window : options.window;
    const kernels::RefineOptions o{match.window / 2, 10, min_variance, max_move};
    refine(left, right, x, y, o, &match);
    // ZNCC knows no scale: without this floor the last bits of a blank wall would correlate.
    match.noise = std::max(match.noise, rounding);
    match.texture /= damping;
    if (match.outcome != kernels::kConverged) return reason_of(match.outcome);
    if (!(match.correlation >= options.min_correlation)) return Reason::kNoMatch;
    return textured(match) ? Reason::kNone : Reason::kNoTexture;
  }

  // Matches back from the right image; true when it returns to where it came from.
  bool returns(int x, int y, const RowMatch& match) const {
    const int x_right = x - static_cast<int>(std::lround(match.d));
    const float s = 1 - match.a;
    const float x_left = static_cast<float>(x) + (static_cast<float>(x_right - x) + match.d) / s;
    RowMatch back = kNoMatch;
    back.d = static_cast<float>(x_right) - x_left;
    back.a = 1 - 1 / s;
    back.b = -match.b / s;
    // The inverse of the warp to second order.
    const float s3 = s * s * s, b = match.b;
    back.c20 = -match.c20 / s3;
    back.c11 = -2 * match.c20 * b / s3 - match.c11 / (s * s);
    back.c02 = -match.c20 * b * b / s3 - match.c11 * b / (s * s) - match.c02 / s;
    const kernels::RefineOptions o{match.window / 2, 6, min_variance, 2};
    refine(right, left, x_right, y, o, &back);
    if (back.outcome != kernels::kConverged || !(back.correlation >= options.min_correlation)) return false;
    return std::abs(static_cast<float>(x_right) - back.d - x_left) <= options.max_left_right;
  }
};

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
            field.labels[w] = static_cast<std::int64_t>(matcher.solve(grid.x(k), grid.y(k), match, 2));
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

// Nodes of which a torn cell lies within the reach of a window.
void find_edges(int window, MatchWork& work) {
  const Grid& n = work.nodes;
  const int reach = (window / 2 + n.stride - 1) / n.stride;
  work.near_edge.assign(n.size(), 0);
  for (int j = 0; j + 1 < n.height; ++j)
    for (int i = 0; i + 1 < n.width; ++i) {
      if (work.cells[static_cast<std::size_t>(j) * n.width + i] != Cell::kTorn) continue;
      for (int v = std::max(0, j - reach + 1); v <= std::min(n.height - 1, j + reach); ++v)
        for (int u = std::max(0, i - reach + 1); u <= std::min(n.width - 1, i + reach); ++u)
          work.near_edge[static_cast<std::size_t>(v) * n.width + u] = 1;
    }
}

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

// Where the surface bends so strongly that the quadric misses some of it, a smaller window takes over: its share.
float bending_of(int window, const RowMatch& shape) {
  const auto m2 = static_cast<float>(second_moment(window));
  return m2 * std::sqrt(shape.c20 * shape.c20 + shape.c02 * shape.c02 + shape.c11 * shape.c11 / 2);
}

float share_of_small(int window, const RowMatch& shape) {
  return std::clamp(bending_of(window, shape) / kBent - 1, 0.F, 1.F);
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
          bool sound = work.near_edge[k] == 0 && fresh.outcome == kernels::kConverged &&
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
    const bool small = work.near_edge[n] != 0 || share_of_small(work.window, node) > 0.5F;
    const Reason r = matcher.solve(x, y, tried, 2, small ? small_window(work.window) : work.window);
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
                         share_of_small(work.window, shape_at(work, grid.x(k), grid.y(k), round[0])) > 0;
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

// Takes the dense answer of every grid point where it is sound, and bends it; refines the others alone.
void finish(const Run& run, const Matcher& matcher, const Grid& grid, const MatchWork& work, MatchField& field) {
  const StereoOptions& o = matcher.options;
  parallel_for(
      run, grid.size(), kBlock / 2,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          const int x = grid.x(k), y = grid.y(k);
          RowMatch& m = field.matches[k];
          std::int64_t round[4];
          nodes_round(work.nodes, x, y, round);
          const std::int64_t near = round[0];
          if (work.field.reason[near] == Reason::kNone && work.near_edge[near] == 0) {
            const RowMatch& node = work.field.matches[near];
            const RowMatch shape = shape_at(work, x, y, near);
            const float share = work.bent[k] != 0 ? share_of_small(work.window, shape) : 0;
            const float at_node = node.d + node.a * static_cast<float>(x - work.nodes.x(near)) +
                                  node.b * static_cast<float>(y - work.nodes.y(near));
            bool sound = m.outcome == kernels::kConverged;
            if (sound) unbend(shape, m);
            if (share > 0) {
              RowMatch small = work.small[k];
              if (small.outcome == kernels::kConverged) {
                unbend(shape, small);
                sound ? mix(share, small, m) : void(m = small);
                sound = true;
              }
            }
            m.noise = std::max(m.noise, matcher.rounding);
            if (sound && std::abs(m.d - at_node) < kFar && m.correlation >= o.min_correlation && matcher.textured(m)) {
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

Grid make_nodes(int width, int height, int window) {
  Grid nodes;
  nodes.stride = std::clamp(window / 3, 4, 8);
  nodes.offset = nodes.stride / 2;
  nodes.width = std::max(1, (width - nodes.offset - 1) / nodes.stride + 1);
  nodes.height = std::max(1, (height - nodes.offset - 1) / nodes.stride + 1);
  return nodes;
}

void match_grid(const Run& run, const RectifiedImage& left, const RectifiedImage& right, const CoarseMap& coarse,
                const Grid& grid, const StereoOptions& options, MatchWork& work, MatchField& field) {
  const Matcher matcher(run, left, right, options);
  work.nodes = make_nodes(left.value.width, left.value.height, options.window);
  if (work.window != options.window) {
    work.window = options.window;
    work.noise_of_bend = bending_noise(options.window, work.nodes.stride);
    work.noise_of_small = bending_noise(small_window(options.window), work.nodes.stride);
  }
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
  dense_step(run, left, work.warp, grid, {options.window, matcher.min_variance, matcher.damping, nullptr},
             field.matches);
  if (want_small(run, grid, work))
    dense_step(run, left, work.warp, grid,
               {small_window(options.window), matcher.min_variance, matcher.damping, work.bent.data()}, work.small);
  field.reason.assign(grid.size(), Reason::kNoMatch);
  finish(run, matcher, grid, work, field);
  check_left_right(grid, right.value.width, static_cast<float>(options.max_left_right), work.seen, field);
  judge_neighbourhood(run, grid, options, field);
  remove_islands(coarse, grid, options, field);
  work.epipolar =
      check_epipolar(run, left, work.warp, grid, options.window, matcher.damping, field, work.epipolar_work);
  explain_unmatched(run, matcher.left, coarse, grid, options, work.noise, field);
}

}  // namespace sgrt
