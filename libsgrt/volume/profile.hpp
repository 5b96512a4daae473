// Where the skin lies on a line through the volume: half-way between the level of the air outside and of the tissue
// inside, as a scanner's symmetric blur leaves a flat edge there. docs/theory/volume.md eq. 3-4.
#pragma once

#include "volume/voxels.hpp"

namespace sgrt {

struct Edge {
  double offset;            // mm from x along n to the level; NaN: not crossed nearby
  double threshold_offset;  // the same for the fixed threshold; NaN where that is NaN or not crossed
  double contrast;          // tissue minus air
};

// x in mm, n the unit outward normal. voxel_from_frame: of the volume's axes.
Edge find_edge(const Voxels& voxels, const Mat3& voxel_from_frame, const Vec3& x, const Vec3& n, double threshold);

}  // namespace sgrt
