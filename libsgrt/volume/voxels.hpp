// A volume of voxels in the caller's memory and where it lies: voxel (i, j, k) = (column, row, slice) has its centre at
// frame_from_voxel (i, j, k). Any spacing, any orientation, either handedness. docs/theory/volume.md.
#pragma once

#include <cstdint>
#include <cstring>

#include "core/eigen.hpp"

namespace sgrt {

struct Voxels {
  enum class Type { kI16, kU16, kU8, kF32 };
  const void* data = nullptr;
  Type type = Type::kI16;
  int nx = 0, ny = 0, nz = 0;
  std::int64_t x_stride = 0, y_stride = 0, z_stride = 0;  // bytes
  double slope = 1, intercept = 0;                        // value = slope * stored + intercept
  Mat3 axes = Mat3::Identity();                           // mm a voxel along x, y, z: columns
  Vec3 origin = Vec3::Zero();                             // mm, centre of voxel (0, 0, 0)

  Vec3 spacing() const { return axes.colwise().norm().transpose(); }
  const char* row(int y, int z) const { return static_cast<const char*>(data) + y * y_stride + z * z_stride; }

  // Calls f(T) with the stored type's zero; one switch a row instead of one a voxel.
  template <class F>
  auto visit(F&& f) const {
    switch (type) {
      case Type::kU16:
        return f(std::uint16_t{});
      case Type::kU8:
        return f(std::uint8_t{});
      case Type::kF32:
        return f(float{});
      default:
        return f(std::int16_t{});
    }
  }

  double at(int x, int y, int z) const {
    return visit([&](auto zero) -> double {
      std::memcpy(&zero, row(y, z) + x * x_stride, sizeof zero);
      return slope * static_cast<double>(zero) + intercept;
    });
  }

  // Trilinear at a continuous index, the outermost voxels continued.
  double sample(const Vec3& index) const;
};

}  // namespace sgrt
