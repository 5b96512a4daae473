// Normals of a cloud by a local fit: a plane, then a quadric over it. docs/theory/surface.md.
#pragma once

#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct NormalsOptions {
  int neighbours = 24;
  Vec3 viewpoint = Vec3(0, 0, 1e4);  // mm; normals turn towards it
  double radius = 50;                // mm
};

// The surface with estimated normals; on a mesh or a surface that has normals already they are replaced.
Surface estimate_normals(const Run& run, Surface surface, const NormalsOptions& options);

}  // namespace sgrt
