// Organised surfaces of time of flight, see tof/organise.hpp.
#include "tof/organise.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "tof/kernels.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Pixels {
  const TofResult* result;
  const float *range, *sigma, *ray[3];
  double slope;
  int half;

  bool present(std::int64_t i) const {
    return (result->flags[static_cast<std::size_t>(i)] & kernels::kTofRejected) == 0;
  }
  Vec3 direction(std::int64_t i) const { return {ray[0][i], ray[1][i], ray[2][i]}; }
};

// A plane n . X = 1 about the camera is linear in 1 / range: direction . n = 1 / range. Weights are the inverse
// variances of that; jumps do not count. NaN where fewer than 6 neighbours fix none.
Vec3 normal_at(const Pixels& p, int y, int x) {
  constexpr int kFewest = 6;
  constexpr double kJumpSigmas = 4;
  const std::int64_t width = p.result->width, at = y * width + x;
  const double range = p.range[at];
  Mat3 A = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  int count = 0;
  for (int v = std::max(0, y - p.half); v <= std::min(p.result->height - 1, y + p.half); ++v) {
    for (int u = std::max(0, x - p.half); u <= std::min(p.result->width - 1, x + p.half); ++u) {
      const std::int64_t i = v * width + u;
      if (!p.present(i)) continue;
      const double d = p.range[i], known = p.sigma[i] == p.sigma[i] ? std::hypot(p.sigma[i], p.sigma[at]) : 0;
      if (std::abs(d - range) > kJumpSigmas * known + p.slope * range * (std::abs(u - x) + std::abs(v - y))) continue;
      const Vec3 e = p.direction(i);
      const double s = p.sigma[i] == p.sigma[i] ? p.sigma[i] : 1, w = d * d * d * d / (s * s) / (range * range);
      A.noalias() += w * e * e.transpose();
      b += w / d * e;
      ++count;
    }
  }
  const Eigen::LDLT<Mat3> solver(A);
  const Vec3 pivots = solver.vectorD();
  if (count < kFewest || !(pivots.minCoeff() > 1e-12 * pivots.maxCoeff())) return Vec3::Constant(kNan);
  return -solver.solve(b).normalized();
}

}  // namespace

Surface organise(const Run& run, const TofResult& result, const Planes& rays, const Vec3& centre, int window,
                 double slope) {
  const std::int64_t n = static_cast<std::int64_t>(result.width) * result.height;
  const Pixels p{
      &result,   result.range.plane(0), result.sigma.plane(0), {rays.plane(0), rays.plane(1), rays.plane(2)}, slope,
      window / 2};
  Surface s;
  s.width = result.width, s.height = result.height;
  s.points = Points::Constant(n, 3, kNan), s.normals = s.points;
  s.sigma = Eigen::VectorXd::Constant(n, kNan);
  s.covariance = Covariances::Constant(n, 6, kNan);
  parallel_for(
      run, result.height, 8,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t y = begin; y < end; ++y) {
          for (int x = 0; x < result.width; ++x) {
            const std::int64_t i = y * result.width + x;
            if (!p.present(i)) continue;
            const Vec3 e = p.direction(i), normal = normal_at(p, static_cast<int>(y), x);
            const double sigma = p.sigma[i], v = sigma * sigma;
            s.points.row(i) = (centre + static_cast<double>(p.range[i]) * e).transpose();
            s.normals.row(i) = normal.transpose();
            // Without a normal the skin is taken to face the camera.
            s.sigma(i) = sigma * (normal.allFinite() ? std::max(std::abs(normal.dot(e)), 1e-3) : 1);
            s.covariance.row(i) << v * e.x() * e.x(), v * e.x() * e.y(), v * e.x() * e.z(), v * e.y() * e.y(),
                v * e.y() * e.z(), v * e.z() * e.z();
          }
        }
      },
      "organising");
  if (!(result.median_sigma > 0)) s.sigma.resize(0), s.covariance.resize(0, 6);  // the noise is not known
  return s;
}

}  // namespace sgrt
