// Spacing by areas, noise by the residuals of small discs. docs/theory/curvature.md eq. 11-13.
#include "shape/grain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/median.hpp"
#include "core/nearest.hpp"
#include "core/parallel.hpp"
#include "shape/jet.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;
constexpr std::int64_t kSamples = 400, kDiscs = 600;
constexpr int kNeighbours = 9;

double mesh_spacing(const Surface& s) {
  std::vector<double> area;
  const std::int64_t step = std::max<std::int64_t>(1, s.faces.rows() / (4 * kSamples));
  area.reserve(static_cast<std::size_t>(s.faces.rows() / step + 1));
  for (std::int64_t i = 0; i < s.faces.rows(); i += step) {
    const Vec3 a = s.point(s.faces(i, 0)), b = s.point(s.faces(i, 1)), c = s.point(s.faces(i, 2));
    const double twice = (b - a).cross(c - a).norm();
    if (twice > 0) area.push_back(twice);  // a vertex has two faces to itself
  }
  return std::sqrt(median(area));
}

double grid_spacing(const Surface& s) {
  std::vector<double> area;
  const std::int64_t step = std::max<std::int64_t>(1, s.size() / (8 * kSamples));
  area.reserve(static_cast<std::size_t>(s.size() / step + 1));
  for (std::int64_t i = 0; i < s.size() - s.width; i += step) {
    if ((i + 1) % s.width == 0 || !s.present(i) || !s.present(i + 1) || !s.present(i + s.width)) continue;
    const double a = (s.point(i + 1) - s.point(i)).cross(s.point(i + s.width) - s.point(i)).norm();
    if (a > 0) area.push_back(a);
  }
  return std::sqrt(median(area));
}

double cloud_spacing(const Run& run, const Surface& s) {
  const Nearest nearest(run, s.points);
  std::vector<double> spacing;
  Nearest::Hit hits[kNeighbours];
  const std::int64_t step = std::max<std::int64_t>(1, s.size() / kSamples);
  spacing.reserve(static_cast<std::size_t>(s.size() / step + 1));
  for (std::int64_t i = 0; i < s.size(); i += step) {
    if (!s.present(i)) continue;
    const int n = nearest.neighbours(s.point(i), kNeighbours, std::numeric_limits<double>::infinity(), hits);
    if (n > 2 && hits[n - 1].distance2 > 0) spacing.push_back(std::sqrt(kPi * hits[n - 1].distance2 / (n - 0.5)));
  }
  return median(spacing);
}

// The area that a point stands for, as a length: the median over the surface. NaN where it is not a mesh or grid.
double area_spacing(const Surface& surface) {
  double h = kNan;
  if (surface.faces.rows() > 0) h = mesh_spacing(surface);
  if (!(h > 0) && surface.organised()) h = grid_spacing(surface);
  return h;
}

// Variance of heights as the residuals of small discs show it, mm2. NaN where no disc has points enough.
double measured_variance(const Run& run, const Pyramid& pyramid, double spacing, int degree) {
  const SkinCells& cells = pyramid.levels[0];
  const std::int64_t step = std::max<std::int64_t>(1, cells.size_of() / kDiscs);
  const std::int64_t n = (cells.size_of() + step - 1) / step;
  std::vector<double> variance(static_cast<std::size_t>(n), -1);
  parallel_for(
      run, n, 32,
      [&](std::int64_t begin, std::int64_t end) {
        JetFitter fitter(run, pyramid, degree);
        for (std::int64_t i = begin; i < end; ++i) {
          const auto at = static_cast<std::size_t>(i * step);
          const Vec3 p(cells.x[at], cells.y[at], cells.z[at]);
          Vec3 normal(cells.nx[at], cells.ny[at], cells.nz[at]);
          Jet jet;
          for (const double factor : {1.4, 1.2}) {  // the first for its normal
            jet = fitter.fit(p, normal, factor * kLeastDisc[degree] * spacing);
            if (jet.fault != JetFault::kNone) break;
            normal = jet.normal;
          }
          const double freedom = jet.count - jet.unknowns;
          if (jet.fault != JetFault::kNone || freedom < 4) continue;
          // The median of chi^2 is freedom (1 - 2 / (9 freedom))^3.
          variance[static_cast<std::size_t>(i)] = jet.residual / freedom / std::pow(1 - 2 / (9 * freedom), 3);
        }
      },
      "curvature: noise");
  variance.erase(std::remove_if(variance.begin(), variance.end(), [](double v) { return v < 0; }), variance.end());
  return median(variance);
}

// The variances of the heights, and the median sigma.
void add_heights(const Run& run, const Surface& surface, int degree, double noise, Grain& grain) {
  Heights& h = grain.heights;
  if (noise > 0) {
    h.common = noise * noise * surface.correlation_points;
    grain.noise = noise;
  } else if (surface.sigma.size() > 0 || surface.covariance.rows() > 0) {
    const std::vector<std::int32_t>& rows = grain.pyramid.levels[0].row;
    h.variance.assign(static_cast<std::size_t>(surface.size()), 0);
    std::vector<double> all;
    all.reserve(rows.size());
    for (const std::int32_t row : rows) {
      all.push_back(surface.variance_along(row, surface.normal(row)));
      h.variance[static_cast<std::size_t>(row)] = all.back() * surface.correlation_points;
    }
    grain.noise = std::sqrt(median(all));
  } else {
    const double v = measured_variance(run, grain.pyramid, grain.spacing, degree);
    h.common = (v == v ? v : 0) * surface.correlation_points;
    grain.noise = std::sqrt(v);
  }
}

}  // namespace

Grain grain_of(const Run& run, const Surface& surface, int degree, double noise) {
  if (!surface.has_normals())
    fail(Status::kInvalidArgument,
         "surface: it has no normals, expected some: they say what is outward, so what is convex");
  Grain grain;
  grain.spacing = area_spacing(surface);
  const bool counted = !(grain.spacing > 0);
  if (counted) grain.spacing = cloud_spacing(run, surface);  // NaN: fewer than 3 points
  if (!(grain.spacing > 0)) return grain;
  grain.pyramid = make_pyramid(surface, grain.spacing);
  const SkinCells& cells = grain.pyramid.levels[0];
  if (counted && cells.duplicates > 0) {
    // Places were counted as often as there are points at them.
    const double kept = static_cast<double>(cells.size_of()), all = kept + static_cast<double>(cells.duplicates);
    grain.spacing *= std::sqrt(all / kept);
    grain.pyramid = make_pyramid(surface, grain.spacing);
  }
  add_heights(run, surface, degree, noise, grain);
  return grain;
}

}  // namespace sgrt
