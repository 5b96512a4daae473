// Sparse voxel grids: samples sorted into cells, and the hash table from a voxel to its surfel. Keys pack three cell
// indices; those of a coarser level are theirs shifted right.
#pragma once

#include <cstdint>
#include <vector>

#include "core/eigen.hpp"
#include "registration/kernels.hpp"

namespace sgrt {

struct SurfelLevel;

// Rows of the samples, cell by cell in the order of the keys.
struct Cells {
  std::vector<std::uint32_t> keys;
  std::vector<std::int64_t> begin;  // one more than keys
  std::vector<std::int32_t> rows;
  std::vector<kernels::Slot> slots;  // key to its place in keys
  std::uint32_t mask = 0;

  std::int32_t find(std::uint32_t key) const;  // -1: an empty cell
};

// Samples beyond the grid are left out.
Cells sort_into_cells(const Points& x, const Vec3& low, double cell);
std::int64_t count_cells(const Points& x, const Vec3& low, double cell);

// call(key) for a cell and those up to kRings away. Cells at the grid's rim hold no samples, so no key overflows.
template <int kRings, class Call>
void for_neighbours(std::uint32_t key, Call&& call) {
  constexpr std::uint32_t kY = 1U << kernels::kKeyBitsX, kZ = kY << kernels::kKeyBitsY, kSide = 2 * kRings + 1;
  const std::uint32_t corner = key - kRings * (1 + kY + kZ);
  for (std::uint32_t z = 0; z < kSide; ++z) {
    for (std::uint32_t y = 0; y < kSide; ++y) {
      for (std::uint32_t x = 0; x < kSide; ++x) call(corner + x + y * kY + z * kZ);
    }
  }
}

// Every cell that has a surfel, and those round it, lead to the surfel nearest their middle. keys: of the surfels.
void fill_voxels(const std::vector<std::uint32_t>& keys, const Vec3& low, double cell, SurfelLevel& level);

}  // namespace sgrt
