// Exact nearest neighbours in a cloud: FLANN's KDTreeSingleIndex behind a wall (no random numbers, no FLANN type here).
// Non-finite points are left out (they would recurse without end); results carry the original indices. Ties go to the
// lowest index.
#pragma once

#include <cstdint>
#include <memory>

#include "core/eigen.hpp"
#include "core/run.hpp"

namespace sgrt {

class Nearest {
 public:
  struct Hit {
    std::int64_t index = -1;  // row of the points given; -1: none within reach
    double distance2 = 0;     // mm2
  };

  Nearest(const Run& run, const Points& points);
  ~Nearest();
  Nearest(Nearest&&) noexcept;
  Nearest& operator=(Nearest&&) noexcept;

  std::int64_t size() const;  // finite points
  // The nearest point within max_distance. Safe from many threads. A non-finite query has no neighbour.
  Hit nearest(const Vec3& x, double max_distance) const;
  // Up to k nearest within max_distance, nearest first; returns how many were written.
  int neighbours(const Vec3& x, int k, double max_distance, Hit* hits) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace sgrt
