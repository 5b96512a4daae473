// Second-order distance to sampled surfaces. docs/theory/surface.md eq. 4-6.
#include "surface/field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr int kRing = 9;  // the sample itself and eight round it, as on a grid
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Weights that reproduce an affine function of the tangent coordinates at x from its values at the samples (eq. 5):
// g_i (1 + (u_i - mean)^T S^-1 (u_x - mean)), sum 1. Falls back to g where the samples lie on a line.
void affine_weights(const Vec2* u, const double* g, int count, const Vec2& ux, double* w) {
  Vec2 mean = Vec2::Zero();
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    mean += g[i] * u[i];
    sum += g[i];
  }
  mean /= sum;
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (int i = 0; i < count; ++i) scatter += g[i] / sum * (u[i] - mean) * (u[i] - mean).transpose();
  const double determinant = scatter.determinant(), trace = scatter.trace();
  Vec2 slope = Vec2::Zero();
  if (determinant > 1e-4 * trace * trace) slope = scatter.inverse() * (ux - mean);
  for (int i = 0; i < count; ++i) w[i] = g[i] / sum * (1 + slope.dot(u[i] - mean));
}

// A sample at a border has its 8th neighbour further away than those inside: it reaches as far as the median of its
// ring.
Eigen::VectorXd even_out(const Field& field, const Eigen::VectorXd& eighth) {
  Eigen::VectorXd reach = eighth;
  for (std::int64_t i = 0; i < reach.size(); ++i) {
    double of_ring[8];
    int n = 0;
    for (const std::int32_t j : field.ring.row(i)) {
      if (j >= 0) of_ring[n++] = eighth[j];
    }
    if (n == 0) continue;
    std::nth_element(of_ring, of_ring + n / 4, of_ring + n);
    reach[i] = std::min(reach[i], of_ring[n / 4]);
  }
  return reach;
}

}  // namespace

Field make_field(const Run& run, const Surface& surface) {
  Field field{&surface, Nearest(run, surface.points), {}, 0, {}};
  field.ring.setConstant(surface.size(), 8, -1);
  Eigen::VectorXd eighth = Eigen::VectorXd::Zero(surface.size());
  parallel_for(
      run, surface.size(), 1024,
      [&](std::int64_t begin, std::int64_t end) {
        Nearest::Hit hits[kRing];
        for (std::int64_t i = begin; i < end; ++i) {
          if (!surface.present(i)) continue;
          const int n =
              field.nearest.neighbours(surface.point(i), kRing, std::numeric_limits<double>::infinity(), hits);
          eighth[i] = std::sqrt(hits[n - 1].distance2);
          int k = 0;
          for (int h = 0; h < n && k < 8; ++h) {
            if (hits[h].index != i) field.ring(i, k++) = static_cast<std::int32_t>(hits[h].index);
          }
        }
      },
      "spacing");
  field.reach = even_out(field, eighth);
  field.max_reach = field.reach.size() > 0 ? field.reach.maxCoeff() : 0;
  return field;
}

bool within_reach(const Field& field, std::int64_t i, const Vec3& x) {
  const Vec3 d = x - field.surface->point(i);
  const double along = field.surface->normal(i).dot(d);
  return d.squaredNorm() - along * along <= field.reach[i] * field.reach[i];  // false for a NaN normal
}

FieldDistance distance_at(const Field& field, const Vec3& x, double max_distance) {
  FieldDistance out{-1, kNan, kNan, Vec3::Constant(kNan)};
  const Surface& s = *field.surface;
  const Nearest::Hit first = field.nearest.nearest(x, max_distance + field.max_reach);
  if (first.index < 0 || !within_reach(field, first.index, x)) return out;

  // The closest sample and its ring, weighted down to nothing at the edge of the reach.
  const Vec3 m = s.normal(first.index), q = s.point(first.index);
  const Vec3 foot = x - m.dot(x - q) * m;
  const double edge2 = 2.25 * std::max(field.reach[first.index] * field.reach[first.index], 1e-12);
  const Vec3 e1 = m.unitOrthogonal(), e2 = m.cross(e1);
  Vec2 u[kRing];
  double g[kRing], w[kRing];
  std::int64_t row[kRing];
  int used = 0;
  for (int i = 0; i < kRing; ++i) {
    const std::int64_t j = i == 0 ? first.index : field.ring(first.index, i - 1);
    if (j < 0 || !(s.normal(j).dot(m) > 0.5)) continue;  // another sheet, or no normal
    const Vec3 d = s.point(j) - foot;
    const double fade = 1 - d.squaredNorm() / edge2;
    if (!(fade > 0)) continue;
    row[used] = j;
    u[used] = Vec2(e1.dot(d), e2.dot(d));
    g[used++] = fade * fade;
  }
  if (used == 0) return out;
  affine_weights(u, g, used, Vec2::Zero(), w);
  Vec3 normal = Vec3::Zero();
  for (int i = 0; i < used; ++i) normal += w[i] * s.normal(row[i]);
  normal.normalize();

  // Each sample's symmetric point-to-plane distance is exact on a circle's arc (eq. 4); their mean tempers the noise.
  double sum = 0, distance = 0, variance = 0;
  for (int i = 0; i < used; ++i) {
    const Vec3 n = s.normal(row[i]);
    distance += g[i] * (n + normal).dot(x - s.point(row[i])) / (1 + n.dot(normal));
    variance += g[i] * g[i] * s.variance_along(row[i], normal);
    sum += g[i];
  }
  out = {first.index, distance / sum, variance / (sum * sum), normal};
  if (!(std::abs(out.distance) <= max_distance)) out = {-1, kNan, kNan, Vec3::Constant(kNan)};
  return out;
}

}  // namespace sgrt
