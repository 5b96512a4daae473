// The live points as the pass reads them: single precision about their own centre, padded to whole lanes.
#pragma once

#include <cstdint>
#include <vector>

#include "core/surface.hpp"

namespace sgrt {

struct LivePoints {
  Vec3 centre = Vec3::Zero();
  double lever = 0;  // mm, rms distance from the centre
  std::int64_t count = 0;
  std::vector<float> x, y, z;     // mm
  std::vector<float> nx, ny, nz;  // empty: the surface has no normals
  std::vector<float> v;           // mm2 along the normal; empty: v_all
  float v_all = 1;
  std::vector<std::int32_t> row;  // of the surface
};

// Points that are absent, or have no normal where others have, are left out. Variances from sigma; left to the caller
// where the surface carries covariances or nothing.
void read_live(const Surface& surface, LivePoints& live);

// About so many of them, evenly drawn whatever their order.
void draw_subset(const LivePoints& live, std::int64_t wanted, LivePoints& subset);

}  // namespace sgrt
