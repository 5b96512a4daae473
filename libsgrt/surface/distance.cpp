// The signed distance map. docs/theory/surface.md eq. 4-6.
#include "surface/distance.hpp"

#include <limits>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "surface/field.hpp"

namespace sgrt {

Eigen::VectorXd signed_distance(const Run& run, const Field& field, const Surface& live,
                                const Pose& reference_from_live, double max_distance) {
  Eigen::VectorXd distance = Eigen::VectorXd::Constant(live.size(), std::numeric_limits<double>::quiet_NaN());
  parallel_for(
      run, live.size(), 512,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          if (live.present(i))
            distance[i] = distance_at(field, reference_from_live * live.point(i), max_distance).distance;
        }
      },
      "distance map");
  return distance;
}

Eigen::VectorXd signed_distance(const Run& run, const Surface& reference, const Surface& live,
                                const Pose& reference_from_live, const DistanceOptions& options) {
  require(reference.has_normals(), "reference has no normals; estimate them first");
  if (!(options.max_distance > 0)) {
    fail(Status::kInvalidArgument,
         "max_distance_mm is " + text_of(options.max_distance) + ", expected a positive number");
  }
  return signed_distance(run, make_field(run, reference), live, reference_from_live, options.max_distance);
}

}  // namespace sgrt
