// See registration/voxels.hpp.
#include "registration/voxels.hpp"

#include <algorithm>
#include <limits>

#include "registration/surfels.hpp"

namespace sgrt {
namespace {

using kernels::kKeyBitsX;
using kernels::kKeyBitsY;
using kernels::kKeyBitsZ;
using kernels::kNoKey;
using kernels::Slot;

constexpr double kRim = 3;  // cells at the grid's border that stay empty

std::uint32_t key_of(const double* x, const Vec3& low, double inverse) {
  constexpr double kLast[3] = {(1 << kKeyBitsX) - kRim, (1 << kKeyBitsY) - kRim, (1 << kKeyBitsZ) - kRim};
  std::uint32_t at[3];
  for (int k = 0; k < 3; ++k) {
    const double f = (x[k] - low[k]) * inverse;
    if (!(f >= kRim && f < kLast[k])) return kNoKey;
    at[k] = static_cast<std::uint32_t>(f);
  }
  return at[0] | at[1] << kKeyBitsX | at[2] << (kKeyBitsX + kKeyBitsY);
}

int bits_for(std::size_t entries) {
  int bits = 6;
  while ((std::size_t{1} << bits) < 2 * entries) ++bits;
  return bits;
}

// Eight neighbours along x share a cache line.
std::uint32_t place_of(std::uint32_t key, std::uint32_t mask, int shift) {
  return ((((key >> 3) * 0x9E3779B1U) >> shift << 3) | (key & 7)) & mask;
}

}  // namespace

std::int32_t Cells::find(std::uint32_t key) const {
  int bits = 0;
  while ((std::uint32_t{1} << bits) <= mask) ++bits;
  for (std::uint32_t at = place_of(key, mask, 32 - (bits - 3)); slots[at].key != kNoKey; at = (at + 1) & mask) {
    if (slots[at].key == key) return slots[at].surfel;
  }
  return -1;
}

Cells sort_into_cells(const Points& x, const Vec3& low, double cell) {
  std::vector<std::uint64_t> order;
  order.reserve(static_cast<std::size_t>(x.rows()));
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const std::uint32_t key = key_of(x.data() + 3 * i, low, 1 / cell);
    if (key != kNoKey) order.push_back(std::uint64_t{key} << 32 | static_cast<std::uint64_t>(i));
  }
  std::sort(order.begin(), order.end());
  Cells out;
  out.rows.resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto key = static_cast<std::uint32_t>(order[i] >> 32);
    if (out.keys.empty() || out.keys.back() != key) {
      out.keys.push_back(key);
      out.begin.push_back(static_cast<std::int64_t>(i));
    }
    out.rows[i] = static_cast<std::int32_t>(order[i] & 0xffffffffU);
  }
  out.begin.push_back(static_cast<std::int64_t>(order.size()));
  const int bits = bits_for(out.keys.size());
  out.slots.assign(std::size_t{1} << bits, {kNoKey, 0});
  out.mask = (1U << bits) - 1;
  for (std::size_t c = 0; c < out.keys.size(); ++c) {
    std::uint32_t at = place_of(out.keys[c], out.mask, 32 - (bits - 3));
    while (out.slots[at].key != kNoKey) at = (at + 1) & out.mask;
    out.slots[at] = {out.keys[c], static_cast<std::int32_t>(c)};
  }
  return out;
}

std::int64_t count_cells(const Points& x, const Vec3& low, double cell) {
  const int bits = bits_for(static_cast<std::size_t>(x.rows()));
  const std::uint32_t mask = (1U << bits) - 1;
  std::vector<std::uint32_t> seen(std::size_t{1} << bits, kNoKey);
  std::int64_t count = 0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const std::uint32_t key = key_of(x.data() + 3 * i, low, 1 / cell);
    if (key == kNoKey) continue;
    std::uint32_t at = place_of(key, mask, 32 - (bits - 3));
    while (seen[at] != kNoKey && seen[at] != key) at = (at + 1) & mask;
    count += seen[at] == kNoKey;
    seen[at] = key;
  }
  return count;
}

std::int32_t find_surfel(const SurfelField& field, const Vec3& x, int level, int levels) {
  const std::uint32_t key = key_of(x.data(), field.low, 1 / field.cell);
  if (key == kNoKey) return -1;
  const std::uint32_t ix = key & ((1U << kKeyBitsX) - 1), iy = (key >> kKeyBitsX) & ((1U << kKeyBitsY) - 1);
  const std::uint32_t iz = key >> (kKeyBitsX + kKeyBitsY);
  const int end = std::min(level + levels, static_cast<int>(field.levels.size()));
  for (int up = level; up < end; ++up) {
    const SurfelLevel& from = field.levels[static_cast<std::size_t>(up)];
    const std::uint32_t k = ix >> up | (iy >> up) << kKeyBitsX | (iz >> up) << (kKeyBitsX + kKeyBitsY);
    for (std::uint32_t at = place_of(k, from.mask, from.shift); from.slots[at].key != kNoKey;
         at = (at + 1) & from.mask) {
      if (from.slots[at].key == k) return static_cast<std::int32_t>(up << 27) | from.slots[at].surfel;
    }
  }
  return -1;
}

void fill_voxels(const std::vector<std::uint32_t>& keys, const Vec3& low, double cell, SurfelLevel& level) {
  std::size_t wanted = 16 * keys.size();
  for (bool fits = false; !fits;) {
    const int bits = bits_for(wanted / 2);
    level.mask = (1U << bits) - 1;
    level.shift = 32 - (bits - 3);
    level.slots.assign(std::size_t{1} << bits, {kNoKey, 0});
    std::vector<float> nearest(level.slots.size(), std::numeric_limits<float>::infinity());
    std::size_t used = 0;
    fits = true;
    for (std::size_t i = 1; i < keys.size() && fits; ++i) {
      const Vec3 q(level.surfels[i].q[0], level.surfels[i].q[1], level.surfels[i].q[2]);
      for_neighbours<1>(keys[i], [&](std::uint32_t key) {
        const Vec3 index(key & ((1U << kKeyBitsX) - 1), (key >> kKeyBitsX) & ((1U << kKeyBitsY) - 1),
                         key >> (kKeyBitsX + kKeyBitsY));
        const auto d2 = static_cast<float>((low + cell * (index + Vec3::Constant(0.5)) - q).squaredNorm());
        std::uint32_t at = place_of(key, level.mask, level.shift);
        while (level.slots[at].key != kNoKey && level.slots[at].key != key) at = (at + 1) & level.mask;
        used += level.slots[at].key == kNoKey;
        level.slots[at].key = key;
        if (d2 < nearest[at]) {
          nearest[at] = d2;
          level.slots[at].surfel = static_cast<std::int32_t>(i);
        }
      });
      fits = 2 * used < level.slots.size();
    }
    wanted *= 2;
  }
}

}  // namespace sgrt
