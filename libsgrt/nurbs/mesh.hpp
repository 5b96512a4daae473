// A mesh of triangles that lies within a stated distance of a NURBS surface. Filip, Magedson, Markot (1986).
// docs/theory/nurbs.md, "Mesh".
#pragma once

#include "core/run.hpp"
#include "core/surface.hpp"
#include "nurbs/evaluate.hpp"

namespace sgrt {

// Every piece between knots is cut into as many rows and columns as a bound on its second derivatives asks for; pieces
// share their borders, so the mesh has no cracks. Vertices carry the exact normals; triangles that shrank to a line (at
// a pole) are left out. Throws kLimit where it would take more than kMaxPoints points.
Surface mesh_of(const Run& run, const SurfaceEvaluator& evaluator, double chord_error_mm);

}  // namespace sgrt
