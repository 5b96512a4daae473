#include "stereo/match.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "stereo/spline.hpp"

namespace sgrt {
namespace {

using kernels::RowMatch;
constexpr int kReach = 8;    // px round a window in which its curvature is sought
constexpr int kBlock = 512;  // grid points: about 2 ms
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr RowMatch kNoMatch{kNan, 0, 0, 0, 0, 0, kNan, kNan, kNan, 1, 0, kernels::kDiverged};

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

struct Matcher {
  const kernels::Plane left, right;
  const StereoOptions& options;
  decltype(&kernels::refine_row_baseline) refine;

  Matcher(const Run& run, const RectifiedImage& l, const RectifiedImage& r, const StereoOptions& o)
      : left(l.plane()),
        right(r.plane()),
        options(o),
        refine(run.isa == Isa::kAvx2 ? kernels::refine_row_avx2 : kernels::refine_row_baseline) {}

  // Refines from the plane in `match`; the reason is kNone when it is accepted.
  Reason solve(int x, int y, RowMatch& match, float max_move) const {
    const kernels::RefineOptions o{options.window / 2, 12, max_move};
    refine(left, right, x, y, o, &match);
    if (match.outcome != kernels::kConverged) return reason_of(match.outcome);
    if (!(match.correlation >= options.min_correlation)) return Reason::kNoMatch;
    return sigma_of(match) <= options.max_sigma ? Reason::kNone : Reason::kNoTexture;
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
    const kernels::RefineOptions o{options.window / 2, 6, 2};
    refine(right, left, x_right, y, o, &back);
    if (back.outcome != kernels::kConverged || !(back.correlation >= options.min_correlation)) return false;
    return std::abs(static_cast<float>(x_right) - back.d - x_left) <= options.max_left_right;
  }
};

// The plane of `from` carried to another pixel.
RowMatch extrapolate(const RowMatch& from, int dx, int dy) {
  RowMatch match = from;
  match.d = from.d + from.a * static_cast<float>(dx) + from.b * static_cast<float>(dy);
  match.c20 = match.c11 = match.c02 = 0;
  return match;
}

void seed(const Run& run, const Matcher& matcher, const CoarseMap& coarse, const Grid& grid, MatchField& field) {
  const float centre = static_cast<float>(coarse.scale - 1) / 2;
  parallel_for(
      run, grid.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          const int x = grid.x(k), y = grid.y(k);
          const CoarseMatch& c = coarse.at_pixel(x, y);
          RowMatch match = kNoMatch;
          if (c.d == c.d) {
            const float dx = static_cast<float>(x % coarse.scale) - centre,
                        dy = static_cast<float>(y % coarse.scale) - centre;
            match.d = c.d + c.a * dx + c.b * dy, match.a = c.a, match.b = c.b;
            field.reason[k] = matcher.solve(x, y, match, static_cast<float>(coarse.scale) + 2);
          } else {
            field.reason[k] = Reason::kNoMatch;
          }
          field.matches[k] = match;
        }
      },
      "refining");
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

int reach_of(int stride) {
  return std::max(1, (kReach + stride / 2) / stride);
}

// Second order: the curvature of the disparity, from the slopes of the solved neighbours within kReach px (a plane per
// window is biased by curvature, but its slopes are not). False where there are too few.
bool curvature_at(const Grid& grid, const MatchField& field, std::int64_t k, RowMatch& match) {
  const int reach = reach_of(grid.stride);
  const int column = static_cast<int>(k % grid.width), row = static_cast<int>(k / grid.width);
  const RowMatch& own = field.matches[k];
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sa = 0, sb = 0, sax = 0, say = 0, sbx = 0, sby = 0;
  for (int j = std::max(row - reach, 0); j <= std::min(row + reach, grid.height - 1); ++j)
    for (int i = std::max(column - reach, 0); i <= std::min(column + reach, grid.width - 1); ++i) {
      const std::int64_t q = static_cast<std::int64_t>(j) * grid.width + i;
      if (field.reason[q] != Reason::kNone) continue;
      const RowMatch& m = field.matches[q];
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

// Refines every match once more over the curvature of its neighbourhood. Reads the first pass, writes the second.
void bend(const Run& run, const Matcher& matcher, const Grid& grid, MatchField& field) {
  if (field.gain == 0) field.gain = bending_gain(matcher.options.window, grid.stride);
  const auto gain = static_cast<float>(field.gain);
  field.bent = field.matches;
  field.labels.assign(grid.size(), static_cast<std::int64_t>(Reason::kNone));
  parallel_for(
      run, grid.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          if (field.reason[k] != Reason::kNone) continue;
          RowMatch match = field.matches[k];
          if (!curvature_at(grid, field, k, match)) continue;
          match.gain = gain;
          field.labels[k] = static_cast<std::int64_t>(matcher.solve(grid.x(k), grid.y(k), match, 2));
          field.bent[k] = match;
        }
      },
      "refining");
  for (std::int64_t k = 0; k < grid.size(); ++k)
    if (field.reason[k] == Reason::kNone) field.reason[k] = static_cast<Reason>(field.labels[k]);
  field.matches.swap(field.bent);
}

// What the quadratic leaves unexplained of the neighbourhood, beyond the noise, is the bias that a window may have
// there. It joins the sigma. A window of which a quarter has no surface straddles an edge: both sides' speckle pulls at
// it.
void judge_neighbourhood(const Run& run, const Grid& grid, const StereoOptions& options, MatchField& field) {
  const int reach = std::max(1, (options.window / 2 + grid.stride / 2) / grid.stride);
  const double side = options.window, second_moment = (side * side - 1) / 12;
  field.labels.assign(grid.size(), 0);
  parallel_for(
      run, grid.size(), kBlock * 4,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          if (field.reason[k] != Reason::kNone) continue;
          RowMatch& own = field.matches[k];
          const int column = static_cast<int>(k % grid.width), row = static_cast<int>(k / grid.width);
          int asked = 0, solved = 0;
          double sum = 0, expected = 0;
          for (int j = row - reach; j <= row + reach; ++j)
            for (int i = column - reach; i <= column + reach; ++i) {
              ++asked;
              if (i < 0 || j < 0 || i >= grid.width || j >= grid.height) continue;
              const std::int64_t q = static_cast<std::int64_t>(j) * grid.width + i;
              if (field.reason[q] != Reason::kNone) continue;
              const RowMatch& m = field.matches[q];
              const double x = (i - column) * grid.stride, y = (j - row) * grid.stride;
              const double off =
                  own.d + own.a * x + own.b * y + own.c20 * x * x + own.c11 * x * y + own.c02 * y * y - m.d;
              if (std::abs(off) > 1) continue;
              ++solved;
              // Noise alone: windows that overlap by rho share it, and the slopes carry theirs outwards (eq. 13).
              const double rho = std::max(0.0, 1 - std::abs(x) / side) * std::max(0.0, 1 - std::abs(y) / side);
              sum += off * off;
              expected += variance_of_noise(m) * (1 - rho) * (2 + (x * x + y * y) / second_moment);
            }
          if (4 * solved < 3 * asked) field.labels[k] = 1;
          field.bent[k].bias2 = static_cast<float>(std::max(0.0, (sum - 2 * expected) / std::max(1, solved)));
        }
      },
      "checking");
  for (std::int64_t k = 0; k < grid.size(); ++k) {
    if (field.reason[k] != Reason::kNone) continue;
    field.matches[k].bias2 = field.bent[k].bias2;
    if (field.labels[k] != 0 || !(sigma_of(field.matches[k]) <= options.max_sigma)) field.reason[k] = Reason::kEdge;
  }
}

void check_left_right(const Run& run, const Matcher& matcher, const Grid& grid, MatchField& field) {
  parallel_for(
      run, grid.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k)
          if (field.reason[k] == Reason::kNone && !matcher.returns(grid.x(k), grid.y(k), field.matches[k]))
            field.reason[k] = Reason::kLeftRight;
      },
      "checking");
}

// Connected groups (neighbours whose planes agree) smaller than min_component are not trusted.
void remove_islands(const Grid& grid, const StereoOptions& options, MatchField& field) {
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
    if (static_cast<int>(field.wave.size()) >= options.min_component) continue;
    for (std::int64_t k : field.wave) field.reason[k] = Reason::kAmbiguous;
  }
}

// What kept an unmatched window from matching, as far as the left image tells.
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

void explain_unmatched(const Run& run, const Matcher& matcher, const Grid& grid, MatchField& field) {
  std::vector<float>& noise = field.noise;
  noise.clear();
  for (std::int64_t k = 0; k < grid.size(); ++k)
    if (field.reason[k] == Reason::kNone) noise.push_back(field.matches[k].noise);
  double typical = 0;  // of one image
  if (!noise.empty()) {
    std::nth_element(noise.begin(), noise.begin() + static_cast<std::ptrdiff_t>(noise.size() / 2), noise.end());
    typical = noise[noise.size() / 2] / 2;
  }
  parallel_for(
      run, grid.size(), kBlock * 4,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k)
          if (field.reason[k] == Reason::kNoMatch)
            field.reason[k] = explain(matcher.left, grid.x(k), grid.y(k), matcher.options.window / 2, typical);
      },
      "checking");
}

}  // namespace

double bending_gain(int window, int stride) {
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
          if (u == 0 && v == 0) w += 1 / n;
          w -= (u * i + v * j) * stride / (2 * sxx * n);
        }
  double gain = 0;
  for (const double w : weight) gain += w * w * n;
  return gain;
}

double variance_of_noise(const RowMatch& match) {
  // The residual f - g holds two images' noise after interpolation (left: x and y; right: x, y and x again), which
  // damps the fine grain that the residual sees but not the coarse grain that moves the match.
  constexpr double kGain2 = kSplineNoiseGain * kSplineNoiseGain;
  constexpr double kDamping = (kGain2 + kGain2 * kSplineNoiseGain) / 2;
  return static_cast<double>(match.noise) * match.texture * match.gain / kDamping;
}

double sigma_of(const RowMatch& match) {
  return std::sqrt(variance_of_noise(match) + match.bias2);
}

void prepare(const Run& run, RectifiedImage& image) {
  const int w = image.value.width, h = image.value.height;
  const std::size_t size = static_cast<std::size_t>(w) * h, spare = size + static_cast<std::size_t>(w) + 64;
  image.scratch = image.value;
  spline_rows(run, image.scratch);
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
          for (int x = 1; x + 1 < w; ++x) g[x] = (c[x + 1] - c[x - 1]) / 2;  // exact for the spline at its knots
        }
      },
      "interpolating");
}

void match_grid(const Run& run, const RectifiedImage& left, const RectifiedImage& right, const CoarseMap& coarse,
                const Grid& grid, const StereoOptions& options, MatchField& field) {
  field.matches.assign(grid.size(), kNoMatch);
  field.reason.assign(grid.size(), Reason::kNoMatch);
  const Matcher matcher(run, left, right, options);
  seed(run, matcher, coarse, grid, field);
  grow(run, matcher, grid, field);
  bend(run, matcher, grid, field);
  check_left_right(run, matcher, grid, field);
  judge_neighbourhood(run, grid, options, field);
  remove_islands(grid, options, field);
  explain_unmatched(run, matcher, grid, field);
}

}  // namespace sgrt
