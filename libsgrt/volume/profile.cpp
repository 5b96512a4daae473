// The profile across the skin. docs/theory/volume.md eq. 3-4.
#include "volume/profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPlateau = 2;  // mm from the edge where tissue or air is taken to be level, at the least
constexpr int kLevels = 4;      // samples of a level, 1 mm apart
constexpr double kReach = 1.5;  // voxels along the normal in which the edge is searched
constexpr int kSteps = 6;       // of it on each side

double middle(double* v) {
  std::sort(v, v + kLevels);
  return (v[kLevels / 2 - 1] + v[kLevels / 2]) / 2;
}

// The crossing of `level` nearest to 0, from tissue (negative t) to air; values at t = (i - kSteps) step.
double crossing(const double* value, double step, double level) {
  double best = kNan;
  for (int i = 0; i < 2 * kSteps; ++i) {
    if (!(value[i] >= level && value[i + 1] < level)) continue;
    const double t = (i - kSteps + (value[i] - level) / (value[i] - value[i + 1])) * step;
    if (!(std::abs(t) >= std::abs(best))) best = t;
  }
  return best;
}

}  // namespace

double Voxels::sample(const Vec3& index) const {
  const auto cell = [](double value, int n, int& i) {
    const double v = std::clamp(value, 0.0, n - 1.0);
    i = std::min(static_cast<int>(v), std::max(0, n - 2));
    return v - i;
  };
  int x, y, z;
  const double u = cell(index.x(), nx, x), v = cell(index.y(), ny, y), w = cell(index.z(), nz, z);
  const std::int64_t dx = nx > 1 ? x_stride : 0, dy = ny > 1 ? y_stride : 0, dz = nz > 1 ? z_stride : 0;
  return visit([&](auto zero) -> double {
    using T = decltype(zero);
    const char* base = row(y, z) + x * x_stride;
    const auto at = [](const char* p) {
      T value;
      std::memcpy(&value, p, sizeof value);
      return static_cast<double>(value);
    };
    const auto line = [&](const char* p) { return at(p) + u * (at(p + dx) - at(p)); };
    const auto plane = [&](const char* p) { return line(p) + v * (line(p + dy) - line(p)); };
    return slope * (plane(base) + w * (plane(base + dz) - plane(base))) + intercept;
  });
}

Edge find_edge(const Voxels& voxels, const Mat3& voxel_from_frame, const Vec3& x, const Vec3& n, double threshold) {
  const Vec3 at = voxel_from_frame * (x - voxels.origin), along = voxel_from_frame * n;
  const double voxel = 1 / along.norm();  // mm that one voxel's length covers along n
  const double plateau = std::max(kPlateau, voxel), step = kReach * voxel / kSteps;
  double inside[kLevels], outside[kLevels], value[2 * kSteps + 1];
  for (int i = 0; i < kLevels; ++i) {
    inside[i] = voxels.sample(at - (plateau + i) * along);
    outside[i] = voxels.sample(at + (plateau + i) * along);
  }
  for (int i = 0; i <= 2 * kSteps; ++i) value[i] = voxels.sample(at + (i - kSteps) * step * along);
  const double tissue = middle(inside), air = middle(outside);
  return {crossing(value, step, (tissue + air) / 2), crossing(value, step, threshold), tissue - air};
}

}  // namespace sgrt
