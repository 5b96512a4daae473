// The part of the reference that counts: a polygon seen from above, or a box.
#pragma once

#include <vector>

#include "core/surface.hpp"

namespace sgrt {

struct Roi {
  std::vector<Vec2> polygon;  // empty: a box
  Vec3 box_min = Vec3::Zero(), box_max = Vec3::Zero();
};

constexpr std::size_t kMaxVertices = 10'000;

Roi roi_from_polygon(std::vector<Vec2> vertices);
Roi roi_from_box(const Vec3& min, const Vec3& max);

// The region under a rigid motion, as it moves the reference on which it was drawn. A polygon, seen from above, can
// turn about the vertical alone, a box not at all: kInvalidArgument.
Roi moved(const Roi& roi, const Pose& pose);

// Inside by even-odd and normal z > 0 (where the surface has normals), or inside the box.
bool contains(const Roi& roi, const Surface& surface, std::int64_t i);

}  // namespace sgrt
