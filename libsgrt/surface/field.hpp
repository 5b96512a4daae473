// A surface made ready to be asked "how far is x, and on which side": its tree and, for each point, how far its samples
// reach. The distance is good to second order between the samples. docs/theory/surface.md eq. 4-6.
#pragma once

#include "core/nearest.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct Field {
  const Surface* surface;  // with normals
  Nearest nearest;
  Eigen::VectorXd reach;  // mm, about to the 8th neighbour: a foot further from its sample lies past a border
  double max_reach = 0;
  Eigen::Matrix<std::int32_t, Eigen::Dynamic, 8, Eigen::RowMajor> ring;  // the 8 neighbours; -1 where there are fewer
};

Field make_field(const Run& run, const Surface& surface);

struct FieldDistance {
  std::int64_t nearest = -1;  // the closest sample; -1: too far, past the border, or without a normal
  double distance;            // mm along the normal, positive outside
  double variance;            // mm2, of the samples' noise in it; NaN where they carry none
  Vec3 normal;                // of the surface at the foot
};

FieldDistance distance_at(const Field& field, const Vec3& x, double max_distance);

// The tangential offset of x from sample i is within the sample's reach.
bool within_reach(const Field& field, std::int64_t i, const Vec3& x);

}  // namespace sgrt
