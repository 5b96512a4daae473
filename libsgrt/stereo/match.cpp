#include "stereo/match.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "stereo/bend.hpp"
#include "stereo/screen.hpp"

namespace sgrt {
namespace {

using kernels::RowMatch;
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
  const float rounding;      // the noise of f - g is never below it
  const float min_variance;  // one grey level: below it both images may show the same dither
  decltype(&kernels::refine_row_baseline) refine;

  Matcher(const Run& run, const RectifiedImage& l, const RectifiedImage& r, const StereoOptions& o)
      : left(l.plane()),
        right(r.plane()),
        options(o),
        rounding(l.rounding + r.rounding),
        min_variance(12 * std::max(l.rounding, r.rounding)),
        refine(run.isa == Isa::kAvx2 ? kernels::refine_row_avx2 : kernels::refine_row_baseline) {}

  // Refines from the plane in `match`; the reason is kNone when it is accepted.
  Reason solve(int x, int y, RowMatch& match, float max_move) const {
    const kernels::RefineOptions o{options.window / 2, 12, min_variance, max_move};
    refine(left, right, x, y, o, &match);
    // ZNCC knows no scale: without this floor the last bits of a blank wall would correlate.
    match.noise = std::max(match.noise, rounding);
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
    const kernels::RefineOptions o{options.window / 2, 6, min_variance, 2};
    refine(right, left, x_right, y, o, &back);
    if (back.outcome != kernels::kConverged || !(back.correlation >= options.min_correlation)) return false;
    return std::abs(static_cast<float>(x_right) - back.d - x_left) <= options.max_left_right;
  }
};

void seed(const Run& run, const Matcher& matcher, const CoarseMap& coarse, const Grid& grid, MatchField& field) {
  const float centre = static_cast<float>(coarse.scale - 1) / 2;
  parallel_for(
      run, grid.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          const int x = grid.x(k), y = grid.y(k);
          const CoarseMatch& c = coarse.at_pixel(x, y);
          if (!(c.d == c.d)) continue;
          const float dx = static_cast<float>(x % coarse.scale) - centre,
                      dy = static_cast<float>(y % coarse.scale) - centre;
          RowMatch match = kNoMatch;
          match.d = c.d + c.a * dx + c.b * dy, match.a = c.a, match.b = c.b;
          field.reason[k] = matcher.solve(x, y, match, static_cast<float>(coarse.scale) + 2);
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

}  // namespace

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
  explain_unmatched(run, matcher.left, grid, options, field);
}

}  // namespace sgrt
