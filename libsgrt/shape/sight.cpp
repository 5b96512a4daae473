// The foremost skin in the cells of a plane across the line of sight. docs/theory/landmarks.md eq. 8.
#include "shape/sight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "shape/cells.hpp"
#include "shape/forms.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kClosed = 0.25;           // length of the mean normal of a body seen from all sides
constexpr double kCell = 1;                // of the spacing
constexpr Eigen::Index kMostCells = 1024;  // a side

}  // namespace

Sight::Sight(const Surface& surface, double spacing) : towards_(Vec3::Zero()) {
  std::int64_t count = 0;
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (!oriented(surface, i)) continue;
    towards_ += surface.normal(i);
    ++count;
  }
  if (count == 0 || towards_.norm() < kClosed * static_cast<double>(count)) {
    towards_.setZero();
    return;
  }
  towards_.normalize();
  plane_ = tangent_plane(towards_);
  Vec2 low = Vec2::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (!oriented(surface, i)) continue;
    const Vec2 u = plane_ * surface.point(i);
    low = low.cwiseMin(u);
    high = high.cwiseMax(u);
  }
  corner_ = low;
  cell_ = std::max(kCell * spacing, (high - low).maxCoeff() / static_cast<double>(kMostCells));
  columns_ = static_cast<Eigen::Index>((high - low)[0] / cell_) + 1;
  rows_ = static_cast<Eigen::Index>((high - low)[1] / cell_) + 1;
  front_.assign(static_cast<std::size_t>(columns_ * rows_), kNan);
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (!oriented(surface, i)) continue;
    const Vec2 u = (plane_ * surface.point(i) - corner_) / cell_;
    double& front =
        front_[static_cast<std::size_t>(static_cast<Eigen::Index>(u[1]) * columns_ + static_cast<Eigen::Index>(u[0]))];
    front = std::fmax(front, towards_.dot(surface.point(i)));
  }
}

double Sight::before_skin(const Vec3& x) const {
  if (front_.empty()) return kNan;
  const Vec2 u = (plane_ * x - corner_) / cell_;
  if (!(std::abs(u[0]) < 1e6 && std::abs(u[1]) < 1e6)) return kNan;
  const auto column = static_cast<Eigen::Index>(std::floor(u[0])), row = static_cast<Eigen::Index>(std::floor(u[1]));
  double front = kNan;
  for (const Eigen::Index reach : {0, 1}) {
    for (Eigen::Index r = std::max<Eigen::Index>(0, row - reach); r <= std::min(rows_ - 1, row + reach); ++r) {
      for (Eigen::Index c = std::max<Eigen::Index>(0, column - reach); c <= std::min(columns_ - 1, column + reach); ++c)
        front = std::fmax(front, front_[static_cast<std::size_t>(r * columns_ + c)]);
    }
    if (front == front) break;
  }
  return towards_.dot(x) - front;
}

}  // namespace sgrt
