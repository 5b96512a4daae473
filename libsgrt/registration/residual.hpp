// What a step of ICP makes smaller: distances to the closest surface along its normal, along the mean of both normals,
// or whole distances to the closest points, in closed form. docs/theory/icp.md section 3.
#pragma once

#include <vector>

#include "core/geometry.hpp"

namespace sgrt {

enum class Residual : int {
  kPlane = 0,            // n . (T p - q), q on a local quadric: Chen and Medioni (1992)
  kPointSvd = 1,         // |T p - q|: Besl and McKay (1992), the fit by Arun's singular vectors (1987)
  kPointQuaternion = 2,  // the same by Horn's quaternion (1987)
  kSymmetric = 3         // (n + R m) . (T p - q): Rusinkiewicz (2019)
};

// A live point at the pose and the closest point of the reference, both about the reference's centre.
struct ClosestPair {
  Vec3 y, q;    // mm
  Vec3 n, m;    // unit normals of reference and live (kSymmetric alone asks for the latter)
  double r, w;  // mm along n; weight, 0: does not count
};

// The twist about the centre that the pairs ask for. lever: mm, at which turns are compared with shifts.
Vec6 step_of(Residual residual, const std::vector<ClosestPair>& pairs, double lever);

// One file each.
Vec6 step_along_normals(const std::vector<ClosestPair>& pairs, double lever);
Vec6 step_along_both_normals(const std::vector<ClosestPair>& pairs, double lever);
Vec6 step_to_points(Residual residual, const std::vector<ClosestPair>& pairs);

}  // namespace sgrt
