// Curvature of NURBS surfaces, analytic, many places at once. docs/theory/curvature.md eq. 3-7.
#pragma once

#include "core/run.hpp"
#include "nurbs/evaluate.hpp"
#include "shape/forms.hpp"

namespace sgrt {

// out: n, at n pairs (u, v) of the domain. All NaN where the surface has no normal (at a pole).
void nurbs_curvature(const Run& run, const SurfaceEvaluator& evaluator, const double* uv, std::int64_t n,
                     Curvature* out);

}  // namespace sgrt
