// A surface made ready for closest points in constant time: surfels (local quadrics, fitted by weighted least squares
// to the samples about them, so that their noise is smoothed) on a pyramid of sparse voxel grids, each level twice as
// coarse. A look-up is one voxel, whatever the number of samples. docs/theory/icp.md section 2.
#pragma once

#include <cstdint>
#include <vector>

#include "core/eigen.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "registration/kernels.hpp"

namespace sgrt {

struct SurfelLevel {
  int count = 0;                         // of its surfels in the ROI
  std::vector<kernels::Surfel> surfels;  // the first is none
  std::vector<kernels::Slot> slots;
  std::uint32_t mask = 0;
  int shift = 0;
  std::vector<std::int32_t> parent;   // the surfel of the next level; 0 at the top
  std::vector<float> samples;         // reference samples that count and belong to it alone
  std::vector<float> slope_variance;  // of its normal, for samples of unit variance
  std::vector<float> noise;           // mm2, variance of one of its samples in a sum over the surfel
};

struct SurfelField {
  Vec3 centre = Vec3::Zero();  // of the samples that count: the origin of all below
  Vec3 low = Vec3::Zero();     // corner of the voxels
  Vec3 box_min, box_max;       // of the surfels that count
  double cell = 0;             // mm, of the finest level
  double lever = 1;            // mm, rms distance of the samples that count from the centre
  double roughness2 = 0;       // mm2, variance of the samples about their surfels
  std::int64_t count = 0;      // surfels of the finest level that count
  std::vector<SurfelLevel> levels;
};

// counts: of each point, or empty: all. Points that are absent or, where the surface has normals, without one are left
// out. Throws kInsufficientData where no surfel can be fitted.
SurfelField make_surfels(const Run& run, const Surface& surface, const std::vector<std::uint8_t>& counts);

// Where a point finds its surfel: level << 27 | surfel, as the kernel writes it; -1: none.
std::int32_t find_surfel(const SurfelField& field, const Vec3& x, int level, int levels);
inline int level_of(std::int32_t code) {
  return code >> 27;
}
inline std::size_t index_of(std::int32_t code) {
  return static_cast<std::size_t>(code & 0x7ffffff);
}
inline const kernels::Surfel& surfel_of(const SurfelField& field, std::int32_t code) {
  return field.levels[static_cast<std::size_t>(level_of(code))].surfels[index_of(code)];
}
inline Vec3 point_of(const kernels::Surfel& s) {
  return {s.q[0], s.q[1], s.q[2]};
}
inline Vec3 normal_of(const kernels::Surfel& s) {
  return {s.n[0], s.n[1], s.n[2]};
}

}  // namespace sgrt
