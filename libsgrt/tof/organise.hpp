// The organised surface of a time-of-flight result: normals by planes through neighbouring rays, covariance along the
// rays (eq. 11-12 of docs/theory/tof.md).
#pragma once

#include "core/run.hpp"
#include "core/surface.hpp"
#include "tof/tof.hpp"

namespace sgrt {

// rays: unit, room axes, planes x y z. window: px, odd. slope: mm a mm of range, how far a neighbour on the same skin
// may lie beside its noise, a pixel of distance.
Surface organise(const Run& run, const TofResult& result, const Planes& rays, const Vec3& centre, int window,
                 double slope);

}  // namespace sgrt
