// Plane fit, then quadric fit. docs/theory/surface.md eq. 1-3.
#include "surface/local_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/median.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kRoughnessPoints = 500, kRoughnessNeighbours = 24;

// Axes of the neighbours' scatter: columns from the least spread to the most; false where they fix no plane.
bool principal_frame(const Points& points, const Nearest::Hit* hits, int count, Mat3& axes, double& spread,
                     double& thickness2) {
  Vec3 mean = Vec3::Zero();
  for (int i = 0; i < count; ++i) mean += points.row(hits[i].index).transpose();
  mean /= count;
  Mat3 scatter = Mat3::Zero();
  for (int i = 0; i < count; ++i) {
    const Vec3 d = points.row(hits[i].index).transpose() - mean;
    scatter.noalias() += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(scatter / count));
  const Vec3& s = eigen.eigenvalues();
  // A line has no normal, nor has a ball of noise.
  if (!(s[1] > 1e-4 * s[2]) || !(s[1] > 2 * s[0])) return false;
  axes = eigen.eigenvectors();
  spread = std::sqrt(s[2]);
  thickness2 = std::max(0.0, s[0]) * count / std::max(1, count - 3);
  return true;
}

}  // namespace

LocalFit fit_local(const Points& points, const Vec3& x, const Nearest::Hit* hits, int count) {
  LocalFit fit{Vec3::Constant(kNan), kNan};
  Mat3 axes;
  double spread, thickness2;
  if (count < kMinNeighbours || !principal_frame(points, hits, count, axes, spread, thickness2)) return fit;
  fit.normal = axes.col(0);
  if (count < kQuadricNeighbours) return fit;
  fit.variance = thickness2;

  // h(u, v) = a + b u + c v + d u^2 + e u v + f v^2 with x as the origin (eq. 2); its normal there is n - b e1 - c e2.
  Mat6 m = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  double hh = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3 d = axes.transpose() * (points.row(hits[i].index).transpose() - x) / spread;
    Vec6 row;
    row << 1, d[1], d[2], d[1] * d[1], d[1] * d[2], d[2] * d[2];
    m.selfadjointView<Eigen::Lower>().rankUpdate(row);
    g += row * d[0];
    hh += d[0] * d[0];
  }
  const Eigen::LDLT<Mat6> solver(m);
  const Vec6 pivots = solver.vectorD();
  if (!(pivots.minCoeff() > 1e-6 * pivots.maxCoeff())) return fit;  // the neighbours fix no quadric: the plane stands
  const Vec6 a = solver.solve(g);
  if (!(std::hypot(a[1], a[2]) < 1)) return fit;  // over 45 deg from the plane: not a smooth sheet
  fit.normal = (axes.col(0) - a[1] * axes.col(1) - a[2] * axes.col(2)).normalized();
  fit.variance = std::max(0.0, hh - a.dot(g)) * spread * spread / (count - 6);
  return fit;
}

double roughness(const Run& run, const Surface& surface, const Nearest& nearest) {
  const std::int64_t step = std::max<std::int64_t>(1, surface.size() / kRoughnessPoints);
  const std::int64_t count = (surface.size() + step - 1) / step;
  std::vector<double> variance(static_cast<std::size_t>(count), kNan);
  parallel_for(
      run, count, 256,
      [&](std::int64_t begin, std::int64_t end) {
        Nearest::Hit hits[kRoughnessNeighbours];
        for (std::int64_t i = begin; i < end; ++i) {
          const std::int64_t row = i * step;
          if (!surface.present(row)) continue;
          const int n = nearest.neighbours(surface.point(row), kRoughnessNeighbours,
                                           std::numeric_limits<double>::infinity(), hits);
          variance[static_cast<std::size_t>(i)] = fit_local(surface.points, surface.point(row), hits, n).variance;
        }
      },
      "measuring noise");
  variance.erase(std::remove_if(variance.begin(), variance.end(), [](double v) { return !(v == v); }), variance.end());
  return std::sqrt(median(variance));
}

}  // namespace sgrt
