// Spatial filter: points that disagree with all around them are taken out, the others are moved along their normals
// onto a quadric through the neighbours on the same side of every edge. Second order, so that it does not flatten
// curved skin; nothing is filled. docs/theory/filters.md.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct FilterOptions {
  double radius = 0;          // mm; 0: three spacings of the points
  double max_sigmas = 4;      // two points further apart, along the normals, are not one skin
  double min_support = 0.15;  // share of the neighbours that a point must agree with
};

// The same numbers as SGRT_FILTER_...
enum class FilterReason : std::uint8_t { kFiltered, kAbsent, kKept, kOutlier, kCount };

struct Filtered {
  Surface surface;
  std::vector<FilterReason> reason;  // one a point of the input
  std::array<std::int64_t, static_cast<std::size_t>(FilterReason::kCount)> count{};
  double radius = 0;                         // mm, that was used
  double sigma_before = 0, sigma_after = 0;  // mm, median along the normal over the filtered points; NaN without
};

// The surface needs normals. Without sigma and covariance its roughness stands for sigma.
Filtered filter(const Run& run, const Surface& surface, const FilterOptions& options);

}  // namespace sgrt
