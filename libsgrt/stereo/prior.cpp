// Live mode, see stereo/prior.hpp.
#include "stereo/prior.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/median.hpp"
#include "core/nearest.hpp"
#include "core/parallel.hpp"
#include "stereo/matcher.hpp"

namespace sgrt {
namespace {

constexpr double kLeastSearch = 24;  // px: a second place that correlates as well shows within it
constexpr int kRings = 3;            // of nodes that are carried on beyond the region: half a window and some motion
constexpr int kMargin = 24;          // px round the region, beside half a window: what the coarse search needs

// A point of the prior in the whole rectified view.
struct Seen {
  double x, y, d;
};

std::vector<Seen> seen_points(const Rectification& r, const Surface& surface, const Roi* roi, Points& points) {
  std::vector<Seen> seen;
  std::vector<std::int64_t> rows;
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (!surface.present(i) || (roi && !contains(*roi, surface, i))) continue;
    const Vec3 from = surface.point(i) - r.centre, p = r.room_from_rectified.transpose() * from;
    if (!(p.z() > 1) || (surface.has_normals() && surface.normal(i).dot(from) > 0)) continue;  // behind, turned away
    const Seen s{r.f * p.x() / p.z() + r.left.cx, r.f * p.y() / p.z() + r.left.cy,
                 r.f * r.baseline / p.z() + r.disparity_at_infinity()};
    const bool both = s.x >= 0 && s.x <= r.left.width - 1 && s.x - s.d >= 0 && s.x - s.d <= r.right.width - 1;
    if (!both || !(s.y >= 0 && s.y <= r.left.height - 1)) continue;
    seen.push_back(s), rows.push_back(i);
  }
  points.resize(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t k = 0; k < rows.size(); ++k) points.row(static_cast<Eigen::Index>(k)) = surface.points.row(rows[k]);
  return seen;
}

// The median distance between neighbouring points, px.
double spacing_of(const Run& run, const Rectification& r, const Points& points, const std::vector<Seen>& seen) {
  const Nearest nearest(run, points);
  std::vector<double> spacing;
  const std::int64_t step = std::max<std::int64_t>(1, points.rows() / 500);
  for (std::int64_t i = 0; i < points.rows(); i += step) {
    Nearest::Hit hits[2];
    if (nearest.neighbours(points.row(i).transpose(), 2, 1e3, hits) < 2) continue;
    const double parallax = seen[static_cast<std::size_t>(i)].d - r.disparity_at_infinity();
    spacing.push_back(std::sqrt(hits[1].distance2) * parallax / r.baseline);
  }
  return spacing.empty() ? 0 : median(spacing);
}

RectifiedCrop crop_round(const Rectification& r, const std::vector<Seen>& seen, int window, double search) {
  double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9, r0 = 1e9, r1 = -1e9;
  for (const Seen& s : seen) {
    x0 = std::min(x0, s.x), x1 = std::max(x1, s.x), y0 = std::min(y0, s.y), y1 = std::max(y1, s.y);
    r0 = std::min(r0, s.x - s.d), r1 = std::max(r1, s.x - s.d);
  }
  const int half = window / 2;
  const double margin = half + kMargin;
  const auto from = [](double x) { return std::max(0, static_cast<int>(std::floor(x))); };
  const auto size = [](double x, int first, int limit) {
    return std::min(limit, static_cast<int>(std::ceil(x)) + 1) - first;
  };
  RectifiedCrop c{};
  c.x_left = from(x0 - margin), c.width_left = size(x1 + margin, c.x_left, r.left.width);
  c.x_right = from(r0 - margin - search), c.width_right = size(r1 + margin + search, c.x_right, r.right.width);
  c.y = from(y0 - margin), c.height = size(y1 + margin, c.y, r.left.height);
  return c;
}

std::int64_t node_at(const Grid& nodes, double x, double y) {
  const auto along = [&](double at, int count) {
    return std::clamp(static_cast<int>(std::lround((at - nodes.offset) / nodes.stride)), 0, count - 1);
  };
  return static_cast<std::int64_t>(along(y, nodes.height)) * nodes.width + along(x, nodes.width);
}

// Least-squares plane at (x, y); of what lies behind one another only the foremost. False where the points do not fix
// its slopes: they are then 0.
bool plane_through(const std::vector<Seen>& near, double x, double y, double reach, kernels::RowMatch& m) {
  m = kNoMatch;
  double front = -1e9;
  for (const Seen& s : near) front = std::max(front, s.d);
  double n = 0, sx = 0, sy = 0, sd = 0, sxx = 0, sxy = 0, syy = 0, sxd = 0, syd = 0;
  for (const Seen& s : near) {
    if (s.d < front - 2 - reach) continue;
    const double i = s.x - x, j = s.y - y;
    n += 1, sx += i, sy += j, sd += s.d, sxx += i * i, sxy += i * j, syy += j * j, sxd += i * s.d, syd += j * s.d;
  }
  const double xx = sxx - sx * sx / n, xy = sxy - sx * sy / n, yy = syy - sy * sy / n;
  const double xd = sxd - sx * sd / n, yd = syd - sy * sd / n, det = xx * yy - xy * xy;
  const bool fixed = n >= 3 && det > 0.3 * xx * yy && det > n;
  if (fixed) {
    m.a = static_cast<float>(std::clamp((yy * xd - xy * yd) / det, -0.7, 0.7));
    m.b = static_cast<float>(std::clamp((xx * yd - xy * xd) / det, -2.0, 2.0));
  }
  m.d = static_cast<float>((sd - m.a * sx - m.b * sy) / n);
  return fixed;
}

// Rings of nodes round the region, each from its best-placed neighbour's plane.
void carry_on(Prior& prior) {
  MatchField& f = prior.field;
  const Grid& nodes = prior.nodes;
  for (int ring = 0; ring < kRings; ++ring) {
    f.wave.clear();
    for (std::int64_t k = 0; k < nodes.size(); ++k) {
      if (f.reason[k] == Reason::kNone) continue;
      const int column = static_cast<int>(k % nodes.width), row = static_cast<int>(k / nodes.width);
      std::int64_t from = -1;
      const int steps[8][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
      for (const auto& s : steps) {
        const int i = column + s[0], j = row + s[1];
        if (i < 0 || j < 0 || i >= nodes.width || j >= nodes.height) continue;
        const std::int64_t q = static_cast<std::int64_t>(j) * nodes.width + i;
        if (from < 0 && f.reason[q] == Reason::kNone) from = q;
      }
      if (from < 0) continue;
      f.matches[k] = extrapolate(f.matches[from], nodes.x(k) - nodes.x(from), nodes.y(k) - nodes.y(from));
      f.wave.push_back(k);
    }
    for (const std::int64_t k : f.wave) f.reason[k] = Reason::kNone;
  }
  tear(nodes, f, prior.cells);
}

void fill_nodes(const std::vector<Seen>& seen, int reach, Prior& prior) {
  const Grid& nodes = prior.nodes;
  std::vector<std::vector<Seen>> bins(static_cast<std::size_t>(nodes.size()));
  for (Seen s : seen) {
    s.x -= prior.crop.x_left, s.y -= prior.crop.y, s.d += prior.crop.x_right - prior.crop.x_left;
    bins[static_cast<std::size_t>(node_at(nodes, s.x, s.y))].push_back(s);
  }
  prior.field.matches.assign(static_cast<std::size_t>(nodes.size()), kNoMatch);
  prior.field.reason.assign(static_cast<std::size_t>(nodes.size()), Reason::kNoMatch);
  prior.inside.assign(static_cast<std::size_t>(nodes.size()), 0);
  std::vector<Seen> near;
  const auto gather = [&](int column, int row, int within) {
    near.clear();
    for (int j = std::max(row - within, 0); j <= std::min(row + within, nodes.height - 1); ++j)
      for (int i = std::max(column - within, 0); i <= std::min(column + within, nodes.width - 1); ++i) {
        const std::vector<Seen>& bin = bins[static_cast<std::size_t>(j) * nodes.width + i];
        near.insert(near.end(), bin.begin(), bin.end());
      }
    return !near.empty();
  };
  for (std::int64_t k = 0; k < nodes.size(); ++k) {
    const int column = static_cast<int>(k % nodes.width), row = static_cast<int>(k / nodes.width);
    prior.inside[k] = gather(column, row, reach - 1) ? 1 : 0;
    if (!gather(column, row, reach)) continue;
    prior.field.reason[k] = Reason::kNone;
    for (int within = reach; within <= 2 * reach && gather(column, row, within); ++within)
      if (plane_through(near, nodes.x(k), nodes.y(k), within * nodes.stride, prior.field.matches[k])) break;
  }
}

// How far along the line of sight d is from what the prior's node says of the place.
double off_prior(const Rectification& r, const Prior& prior, std::int64_t node, int x, int y, double d) {
  const kernels::RowMatch& p = prior.field.matches[node];
  const double there = p.d + p.a * (x - prior.nodes.x(node)) + p.b * (y - prior.nodes.y(node));
  const double size = r.f * r.baseline, infinity = r.disparity_at_infinity();
  return std::abs(size / (d - infinity) - size / (there - infinity));
}

}  // namespace

Prior make_prior(const Run& run, const Rectification& whole, const Surface& surface, const Roi* roi, int window,
                 const PriorOptions& options) {
  if (!(options.band > 0 && options.band <= 1000))
    fail(Status::kInvalidArgument, "band_mm: " + text_of(options.band) + ", expected more than 0, at most 1000");
  Points points;
  const std::vector<Seen> seen = seen_points(whole, surface, roi, points);
  if (seen.size() < 3)
    fail(Status::kInsufficientData, "prior: " + std::to_string(seen.size()) +
                                        " of its points lie where both cameras see and the region is, expected some");
  Prior prior;
  prior.options = options;
  for (const Seen& s : seen) {  // the motion by `band` towards the cameras, px
    const double parallax = s.d - whole.disparity_at_infinity(), z = whole.f * whole.baseline / parallax;
    prior.search = std::max(prior.search, parallax * options.band / std::max(z - options.band, z / 2));
  }
  prior.search = std::max(kLeastSearch, prior.search);
  prior.crop = crop_round(whole, seen, window, prior.search);
  prior.nodes = make_nodes(prior.crop.width_left, prior.crop.height, window);
  const double spacing = spacing_of(run, whole, points, seen);
  fill_nodes(seen, std::max(1, static_cast<int>(std::ceil(1.5 * spacing / prior.nodes.stride))), prior);
  carry_on(prior);
  return prior;
}

void warp_by_prior(const Run& run, const RectifiedImage& right, RectifiedImage& left, Prior& prior) {
  const Grid& nodes = prior.nodes;
  const int width = left.value.width, height = left.value.height;
  for (std::int64_t k = 0; k < nodes.size(); ++k) {
    if (prior.field.reason[k] == Reason::kNone) continue;
    const int x0 = nodes.x(k) - nodes.stride / 2, x1 = std::min(width, x0 + nodes.stride);
    for (int y = nodes.y(k) - nodes.stride / 2; y < std::min(height, nodes.y(k) + (nodes.stride + 1) / 2); ++y)
      if (y >= 0)
        std::fill(&left.mask[static_cast<std::size_t>(y) * width + std::max(0, x0)],
                  &left.mask[static_cast<std::size_t>(y) * width] + x1, static_cast<std::uint8_t>(Reason::kOutOfView));
  }
  warp(run, left, right, nodes, prior.field, prior.cells, prior.warped);
  prior.image.resize(height, width);
  prior.mask.resize(prior.image.pixels.size());
  for (int y = 0; y < height; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * prior.warped.stride;
    std::copy_n(&prior.warped.g[from], width, prior.image.row(y));
    for (int x = 0; x < width; ++x)
      prior.mask[static_cast<std::size_t>(y) * width + x] = prior.warped.keep[from + x] > 0 ? 0 : 1;
  }
}

void add_prior(const Prior& prior, CoarseMap& coarse) {
  const float centre = static_cast<float>(coarse.scale - 1) / 2;
  for (int j = 0; j < coarse.height; ++j)
    for (int i = 0; i < coarse.width; ++i) {
      CoarseMatch& c = coarse.matches[static_cast<std::size_t>(j) * coarse.width + i];
      if (!(c.d == c.d)) continue;
      const float x = static_cast<float>(coarse.scale * i) + centre, y = static_cast<float>(coarse.scale * j) + centre;
      const std::int64_t k = node_at(prior.nodes, x, y);
      const kernels::RowMatch& p = prior.field.matches[k];
      if (prior.field.reason[k] != Reason::kNone) {
        c.d = kNan;
        continue;
      }
      // Left x is seen at x' = x - c(x) of the warped image, which shows right x' - p(x').
      c.d += p.d + p.a * (x - c.d - static_cast<float>(prior.nodes.x(k))) +
             p.b * (y - static_cast<float>(prior.nodes.y(k)));
      c.b += p.b - p.a * c.b;
      c.a += p.a * (1 - c.a);
    }
}

void hold_against(const Rectification& cropped, const Prior& prior, const Grid& grid, MatchField& field) {
  for (std::int64_t k = 0; k < grid.size(); ++k) {
    const std::int64_t node = node_at(prior.nodes, grid.x(k), grid.y(k));
    if (!prior.inside[node]) {
      field.reason[k] = Reason::kOutOfVolume;
    } else if (field.reason[k] == Reason::kNone &&
               !(off_prior(cropped, prior, node, grid.x(k), grid.y(k), field.matches[k].d) <= prior.options.band)) {
      field.reason[k] = Reason::kMoved;
    }
  }
}

void follow(const Rectification& cropped, const MatchField& found, Prior& prior) {
  const Grid& nodes = prior.nodes;
  for (std::int64_t k = 0; k < nodes.size(); ++k) {
    if (!prior.inside[k]) {
      prior.field.reason[k] = Reason::kNoMatch;
      continue;
    }
    const kernels::RowMatch& m = found.matches[k];
    if (found.reason[k] != Reason::kNone) continue;
    if (!(off_prior(cropped, prior, k, nodes.x(k), nodes.y(k), m.d) <= prior.options.band)) continue;
    prior.field.matches[k].d = m.d, prior.field.matches[k].a = m.a, prior.field.matches[k].b = m.b;
  }
  carry_on(prior);
}

}  // namespace sgrt
