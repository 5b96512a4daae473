// Normals of a sweep's grid, whose rows lie much closer than its columns or the other way round: the plane through the
// points of a window that is about as high as wide. docs/theory/laser.md, "Normals".
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/median.hpp"
#include "core/parallel.hpp"
#include "laser/sweep.hpp"

namespace sgrt {
namespace {

constexpr int kReach = 2;  // of the coarser direction
// Noise is along the ray, sigma along the normal: a normal that is wrong by much would make a point look exact. So
// there is none where the neighbours are no plane (their thickness over their width, squared) or stand on edge.
constexpr double kMaxThickness = 0.05, kMinCos = 0.26;

// The median distance of neighbours `step` apart in memory, over a sample.
double spacing(const Surface& s, std::int64_t step, std::int64_t width) {
  std::vector<double> d;
  const std::int64_t n = s.size(), stride = 1 + n / 2000;
  d.reserve(static_cast<std::size_t>(n / stride + 1));
  for (std::int64_t i = 0; i + step < n; i += stride) {
    if (step == 1 && (i + 1) % width == 0) continue;
    const double length = (s.point(i + step) - s.point(i)).norm();
    if (std::isfinite(length)) d.push_back(length);
  }
  return median(d);
}

Vec3 normal_at(const Surface& s, std::int64_t line, std::int64_t column, int lines, int columns, double limit) {
  constexpr int kLeast = 6;
  const Vec3 x = s.point(line * s.width + column);
  Mat3 C = Mat3::Zero();
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::int64_t i = std::max<std::int64_t>(0, line - lines); i <= std::min(s.height - 1, line + lines); ++i) {
    for (std::int64_t j = std::max<std::int64_t>(0, column - columns); j <= std::min(s.width - 1, column + columns);
         ++j) {
      const std::int64_t k = i * s.width + j;
      if (!s.present(k)) continue;
      const Vec3 d = s.point(k) - x;
      if (d.squaredNorm() > limit * limit) continue;
      C += d * d.transpose();
      sum += d;
      ++count;
    }
  }
  const Vec3 none = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  if (count < kLeast) return none;
  C -= sum * sum.transpose() / count;
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(C);
  const Vec3 e = solver.eigenvalues();
  // Points on a line fix no plane, nor does a heap.
  if (!(e(1) > 0.01 * e(2) && e(0) < kMaxThickness * e(1))) return none;
  return solver.eigenvectors().col(0);
}

}  // namespace

void set_grid_normals(const Run& run, const Vec3& viewpoint, Surface& s) {
  const double between_lines = spacing(s, s.width, s.width), between_columns = spacing(s, 1, s.width);
  if (!(between_lines > 0 && between_columns > 0)) return;
  const double coarse = std::max(between_lines, between_columns);
  const auto reach = [&](double own) {
    return std::clamp(static_cast<int>(std::lround(kReach * coarse / own)), kReach, 12);
  };
  const int lines = reach(between_lines), columns = reach(between_columns);
  const double limit = 3 * kReach * coarse;
  parallel_for(
      run, s.height, 4,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t line = begin; line < end; ++line) {
          for (std::int64_t column = 0; column < s.width; ++column) {
            const std::int64_t k = line * s.width + column;
            if (!s.present(k)) continue;
            const Vec3 n = normal_at(s, line, column, lines, columns, limit);
            const double facing = n.dot((viewpoint - s.point(k)).normalized());
            if (std::abs(facing) > kMinCos) s.normals.row(k) = (facing < 0 ? Vec3(-n) : n).transpose();
          }
        }
      },
      "normals");
}

}  // namespace sgrt
