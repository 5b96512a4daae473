// The couch under the patient: what has the same cross-section in nearly every slice, thin, wide and flat, on the side
// that the patient lies on. Its top is a smooth curve across the couch, fitted where it is seen and continued under the
// body, so that couch and body part where they touch. docs/theory/volume.md eq. 2.
#pragma once

#include <vector>

#include "volume/runs.hpp"

namespace sgrt {

struct Support {
  bool found = false;
  int axis = 1, sign = 1;  // "down" is +sign along lattice axis 0 or 1
  std::vector<int> top;    // of each line across the couch: the voxel nearest to the patient that is couch
};

// down: towards the couch, in voxels (any length; its largest component in the slice counts). All zero: none is
// searched.
Support find_support(const Runs& tissue, const Vec3& down, const Vec3& spacing_mm);

// The tissue without the couch and whatever lies beyond it.
Runs without_support(const Run& run, const Runs& tissue, const Support& support);

// Whether a voxel is couch or beyond it.
inline bool is_support(const Support& s, int x, int y) {
  if (!s.found) return false;
  const int along = s.axis == 0 ? x : y, across = s.axis == 0 ? y : x;
  const int top = s.top[static_cast<std::size_t>(across)];
  return s.sign > 0 ? along >= top : along <= top;
}

}  // namespace sgrt
