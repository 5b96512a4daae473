// Fusion of the pods' surfaces into one, weighted by covariance. docs/theory/surface.md.
#pragma once

#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct FuseOptions {
  double max_distance = 3;  // mm
  double max_angle_deg = 60;
};

struct Fusion {
  Surface surface;
  std::int64_t overlap_count = 0;
  double disagreement_mean, disagreement_rms, disagreement_expected;  // mm; NaN without overlap (or sigma)
};

Fusion fuse(const Run& run, const std::vector<const Surface*>& surfaces, const FuseOptions& options);

}  // namespace sgrt
