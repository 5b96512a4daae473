// Fusion, surface after surface: where a later one covers a point of the fused cloud, the point moves along the normal
// to the mean weighted by inverse variances and the later surface's own points are dropped. docs/theory/surface.md eq.
// 7-9.
#include "surface/fuse.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "surface/field.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// What every surface carries, and so the fused one too.
struct Carried {
  bool variance = true, covariance = true;
  std::size_t modes = 0;
};

Carried carried_by_all(const std::vector<const Surface*>& surfaces) {
  Carried c;
  c.modes = surfaces[0]->modes.size();
  for (const Surface* s : surfaces) {
    c.variance = c.variance && (s->sigma.size() > 0 || s->covariance.rows() > 0);
    c.covariance = c.covariance && s->covariance.rows() > 0;
    // Mode k must have the same cause in all.
    if (s->modes.size() != c.modes || s->mode_names != surfaces[0]->mode_names) c.modes = 0;
  }
  return c;
}

// The rows of s for which keep holds, as a cloud with what all carry.
Surface pick(const Surface& s, const std::vector<std::int64_t>& rows, const Carried& c) {
  Surface out;
  const auto n = static_cast<std::int64_t>(rows.size());
  out.points.resize(n, 3);
  out.normals.resize(n, 3);
  if (c.variance) out.sigma.resize(n);
  if (c.covariance) out.covariance.resize(n, 6);
  out.modes.assign(c.modes, Points(n, 3));
  if (c.modes > 0) out.mode_names = s.mode_names;
  out.correlation_points = s.correlation_points;
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int64_t row = rows[static_cast<std::size_t>(i)];
    out.points.row(i) = s.points.row(row);
    out.normals.row(i) = s.normals.row(row);
    if (c.variance) out.sigma[i] = std::sqrt(s.variance_along(row, s.normal(row)));
    if (c.covariance) out.covariance.row(i) = s.covariance.row(row);
    for (std::size_t k = 0; k < c.modes; ++k) out.modes[k].row(i) = s.modes[k].row(row);
  }
  return out;
}

template <class Matrix>
void append(Matrix& a, const Matrix& b) {
  const std::int64_t n = a.rows();
  a.conservativeResize(n + b.rows(), a.cols());
  a.bottomRows(b.rows()) = b;
}

void append(Surface& a, const Surface& b) {
  append(a.points, b.points);
  append(a.normals, b.normals);
  append(a.sigma, b.sigma);
  append(a.covariance, b.covariance);
  for (std::size_t k = 0; k < a.modes.size(); ++k) append(a.modes[k], b.modes[k]);
  a.correlation_points = std::max(a.correlation_points, b.correlation_points);
}

// The other surface at each point of `at`; nearest is -1 where it does not show the same skin.
std::vector<FieldDistance> look_up(const Run& run, const Surface& at, const Field& field, const FuseOptions& options) {
  std::vector<FieldDistance> found(static_cast<std::size_t>(at.size()));
  const double min_cos = std::cos(options.max_angle_deg * 3.14159265358979323846 / 180);
  parallel_for(
      run, at.size(), 512,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          FieldDistance& f = found[static_cast<std::size_t>(i)];
          f = {-1, kNan, kNan, Vec3::Constant(kNan)};
          if (at.present(i)) f = distance_at(field, at.point(i), options.max_distance);
          if (f.nearest >= 0 && !(f.normal.dot(at.normal(i)) >= min_cos)) f.nearest = -1;
        }
      },
      "fusing");
  return found;
}

// x lies beyond the last sample of the field: further than a third of a step, and with no neighbour on its side. The
// reach of a border sample goes 1.4 steps out; dropping what lies there would leave a gap.
bool past_border(const Field& field, std::int64_t i, const Vec3& x) {
  const Vec3 n = field.surface->normal(i), q = field.surface->point(i);
  const Vec3 off = (x - q) - n.dot(x - q) * n;
  if (off.norm() < 0.3 * field.reach[i]) return false;
  for (const std::int32_t j : field.ring.row(i)) {
    if (j >= 0 && off.dot(field.surface->point(j) - q) > 0.5 * off.squaredNorm()) return false;
  }
  return true;
}

// Moves point i of `fused` to the weighted mean of it and the later surface's foot (eq. 8).
void merge(Surface& fused, std::int64_t i, const FieldDistance& f, const Surface& later, const Carried& c) {
  double share = 0.5;  // of the later surface
  const Vec3 q = fused.normal(i), p = f.normal;
  if (c.variance) {
    const double a = fused.sigma[i] * fused.sigma[i], b = later.variance_along(f.nearest, p);
    // The blend of several samples is better than one of them unless their noise is shared.
    const double blend = std::min(b, f.variance * later.correlation_points);
    share = a / (a + b);
    const double variance = (1 - share) * (1 - share) * a + share * share * blend;
    fused.sigma[i] = std::sqrt(variance);
    if (c.covariance) set_variance_along(fused, i, q, variance);
  }
  fused.points.row(i) -= (share * f.distance * p).transpose();
  fused.normals.row(i) = ((1 - share) * q + share * p).normalized().transpose();
  for (std::size_t k = 0; k < c.modes; ++k) {
    const Vec3 difference = (later.modes[k].row(f.nearest) - fused.modes[k].row(i)).transpose();
    fused.modes[k].row(i) += (share * difference.dot(p) * p).transpose();
  }
}

struct Disagreement {
  std::int64_t count = 0;
  double sum = 0, sum2 = 0, expected2 = 0;

  void add(const Surface& fused, std::int64_t i, const FieldDistance& f, const Surface& later) {
    const double h = -f.distance;  // the later surface minus the first
    ++count;
    sum += h;
    sum2 += h * h;
    const double blend = std::min(later.variance_along(f.nearest, f.normal), f.variance * later.correlation_points);
    expected2 += fused.sigma.size() > 0 ? fused.sigma[i] * fused.sigma[i] + blend : kNan;
  }
};

void check(const std::vector<const Surface*>& surfaces, const FuseOptions& options) {
  require(!surfaces.empty(), "surfaces is empty, expected at least one");
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    if (!surfaces[i]->has_normals()) {
      fail(Status::kInvalidArgument, "surfaces[" + std::to_string(i) + "] has no normals; estimate them first");
    }
  }
  if (!(options.max_distance > 0)) {
    fail(Status::kInvalidArgument,
         "max_distance_mm is " + text_of(options.max_distance) + ", expected a positive number");
  }
  if (!(options.max_angle_deg > 0 && options.max_angle_deg <= 90)) {
    fail(Status::kInvalidArgument, "max_angle_deg is " + text_of(options.max_angle_deg) + ", expected 0 to 90");
  }
}

std::vector<std::int64_t> present_rows(const Surface& s) {
  std::vector<std::int64_t> rows;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    if (s.present(i)) rows.push_back(i);
  }
  return rows;
}

}  // namespace

Fusion fuse(const Run& run, const std::vector<const Surface*>& surfaces, const FuseOptions& options) {
  check(surfaces, options);
  const Carried c = carried_by_all(surfaces);
  Fusion out;
  Surface& fused = out.surface;
  fused = pick(*surfaces[0], present_rows(*surfaces[0]), c);
  std::vector<bool> seen(static_cast<std::size_t>(fused.size()), false);
  Disagreement all;
  for (std::size_t k = 1; k < surfaces.size(); ++k) {
    const Surface later = pick(*surfaces[k], present_rows(*surfaces[k]), c);
    if (later.size() == 0) continue;
    std::vector<std::int64_t> alone;
    if (fused.size() > 0) {
      const Field before = make_field(run, fused);
      auto doubled = look_up(run, later, before, options);
      for (std::int64_t i = 0; i < later.size(); ++i) {
        FieldDistance& f = doubled[static_cast<std::size_t>(i)];
        if (f.nearest >= 0 && past_border(before, f.nearest, later.point(i))) f.nearest = -1;
      }
      const auto covered = look_up(run, fused, make_field(run, later), options);
      for (std::int64_t i = 0; i < fused.size(); ++i) {
        const FieldDistance& f = covered[static_cast<std::size_t>(i)];
        if (f.nearest < 0) continue;
        all.add(fused, i, f, later);
        merge(fused, i, f, later, c);
        seen[static_cast<std::size_t>(i)] = true;
      }
      for (std::int64_t i = 0; i < later.size(); ++i) {
        if (doubled[static_cast<std::size_t>(i)].nearest < 0) alone.push_back(i);
      }
    } else {
      alone = present_rows(later);
    }
    append(fused, pick(later, alone, c));
    seen.resize(static_cast<std::size_t>(fused.size()), false);
  }
  const auto n = static_cast<double>(all.count);
  out.overlap_count = std::count(seen.begin(), seen.end(), true);
  out.disagreement_mean = n > 0 ? all.sum / n : kNan;
  out.disagreement_rms = n > 0 ? std::sqrt(all.sum2 / n) : kNan;
  out.disagreement_expected = n > 0 ? std::sqrt(all.expected2 / n) : kNan;
  return out;
}

}  // namespace sgrt
