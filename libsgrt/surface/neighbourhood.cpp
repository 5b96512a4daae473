// Neighbours by the grid or by the tree. A grid's window follows the local spacing, which changes with slope and range.
#include "surface/neighbourhood.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kSpacingPoints = 500;

// Distance to the next point of the row (step 1) or column (step width); NaN where one is absent.
double step_length(const Surface& s, std::int64_t i, std::int64_t step) {
  return (s.point(i + step) - s.point(i)).norm();
}

// The shortest of the steps to the four neighbours in the grid; infinity without any.
double grid_step(const Surface& s, std::int64_t i) {
  const std::int64_t row = i / s.width, column = i % s.width;
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](bool inside, std::int64_t step) {
    const double d = inside ? step_length(s, i, step) : std::numeric_limits<double>::infinity();
    if (d > 0 && d < least) least = d;
  };
  look(column > 0, -1);
  look(column + 1 < s.width, 1);
  look(row > 0, -s.width);
  look(row + 1 < s.height, s.width);
  return least;
}

}  // namespace

double point_spacing(const Run& run, const Surface& surface) {
  run.poll(0, "measuring the spacing");
  const std::int64_t stride = std::max<std::int64_t>(1, surface.size() / kSpacingPoints);
  const std::unique_ptr<Nearest> tree = surface.organised() ? nullptr : std::make_unique<Nearest>(run, surface.points);
  std::vector<double> spacing;
  for (std::int64_t i = 0; i < surface.size(); i += stride) {
    if (!surface.present(i)) continue;
    std::array<Nearest::Hit, 5> hits;
    double d = std::numeric_limits<double>::infinity();
    if (surface.organised()) {
      d = grid_step(surface, i);
    } else if (tree->neighbours(surface.point(i), 5, d, hits.data()) == 5) {
      d = std::sqrt(hits[4].distance2);
    }
    if (d > 0 && std::isfinite(d)) spacing.push_back(d);
  }
  if (spacing.empty()) fail(Status::kInsufficientData, "surface: no point has neighbours, so it has no spacing");
  return median(spacing);
}

Neighbourhood::Neighbourhood(const Run& run, const Surface& surface, double radius) : s_(surface), radius_(radius) {
  if (!surface.organised()) tree_ = std::make_unique<Nearest>(run, surface.points);
}

void Neighbourhood::of(std::int64_t i, std::vector<std::int64_t>& neighbours) const {
  neighbours.clear();
  if (tree_) {
    std::array<Nearest::Hit, kMaxCloudNeighbours> hits;
    const int n = tree_->neighbours(s_.point(i), kMaxCloudNeighbours, radius_, hits.data());
    for (int k = 0; k < n; ++k) {
      if (hits[static_cast<std::size_t>(k)].index != i) neighbours.push_back(hits[static_cast<std::size_t>(k)].index);
    }
    return;
  }
  const double step = grid_step(s_, i);
  const std::int64_t half =
      step < std::numeric_limits<double>::infinity()
          ? std::clamp(static_cast<std::int64_t>(radius_ / step) + 1, std::int64_t{1}, std::int64_t{kMaxHalfWindow})
          : kMaxHalfWindow;
  const std::int64_t row = i / s_.width, column = i % s_.width;
  for (std::int64_t r = std::max<std::int64_t>(0, row - half); r <= std::min(s_.height - 1, row + half); ++r) {
    for (std::int64_t c = std::max<std::int64_t>(0, column - half); c <= std::min(s_.width - 1, column + half); ++c) {
      const std::int64_t j = r * s_.width + c;
      if (j != i && s_.present(j)) neighbours.push_back(j);
    }
  }
}

}  // namespace sgrt
