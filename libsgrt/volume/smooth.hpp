// Smoothing of a mesh that does not shrink it: each vertex moves along its normal onto a quadric fitted to its
// neighbours over the mesh (Levin 2003, moving least squares; Cazals and Pouget 2005). docs/theory/volume.md eq. 5-6.
#pragma once

#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct Smoothed {
  Points points, normals;
  Eigen::VectorXd sigma;     // mm along the normal, from the scatter of the neighbours; NaN where not smoothed
  Eigen::VectorXd bias;      // mm: a convex surface of a blurred volume lies too deep (eq. 6)
  Eigen::VectorXd leverage;  // of a vertex on its own smoothed place; its inverse is how many share one noise sample
};

// Only vertices with use[i] move and count. radius in mm along the mesh. cell: axes of the voxels that the vertices
// were found in, mm; zero: none. A cell's noise is shared by all vertices within it, and its size blurs the volume.
Smoothed smooth_mesh(const Run& run, const Points& points, const Points& normals, const Faces& faces,
                     const std::vector<std::uint8_t>& use, double radius, const Mat3& cell);

// Vertex normals averaged twice over the mesh.
Points soft_normals(const Run& run, const Points& points, const Faces& faces);

}  // namespace sgrt
