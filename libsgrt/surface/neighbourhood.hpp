// The points around a point: in an organised grid by its rows and columns, in a cloud or a mesh by a tree.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/nearest.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

// Half the side of a grid's window, and what a cloud's neighbours are limited to.
constexpr int kMaxHalfWindow = 15, kMaxCloudNeighbours = 256;

// The median distance of neighbouring points, mm, from about 500 of them: along rows and columns of a grid; in a cloud
// to the fourth neighbour, as on a square lattice. Throws kInsufficientData where there are no two neighbours.
double point_spacing(const Run& run, const Surface& surface);

class Neighbourhood {
 public:
  Neighbourhood(const Run& run, const Surface& surface, double radius);
  // The present points about within the radius of point i, without i. The same vector again and again: no allocation.
  void of(std::int64_t i, std::vector<std::int64_t>& neighbours) const;

 private:
  const Surface& s_;
  double radius_;
  std::unique_ptr<Nearest> tree_;  // of a cloud
};

}  // namespace sgrt
