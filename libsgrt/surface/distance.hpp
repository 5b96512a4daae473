// Signed distance map between two surfaces, mm along the reference's normal. docs/theory/surface.md.
#pragma once

#include "core/geometry.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct DistanceOptions {
  double max_distance = 20;  // mm
};

// One number a point of live; NaN without correspondence (too far, past the border of the reference).
Eigen::VectorXd signed_distance(const Run& run, const Surface& reference, const Surface& live,
                                const Pose& reference_from_live, const DistanceOptions& options);

// The same on a reference made ready.
struct Field;
Eigen::VectorXd signed_distance(const Run& run, const Field& field, const Surface& live,
                                const Pose& reference_from_live, double max_distance);

}  // namespace sgrt
