// Many points of one surface: on a grid of parameters or scattered, with derivatives. The surface is prepared once
// (homogeneous control points, reciprocals of knot differences, where to look for a span); after that a point costs
// nanoseconds and nothing is allocated but a row. docs/theory/nurbs.md, "Evaluation".
#pragma once

#include <cstdint>
#include <vector>

#include "core/run.hpp"
#include "nurbs/kernels.hpp"
#include "nurbs/surface.hpp"

namespace sgrt {

class SurfaceEvaluator {
 public:
  explicit SurfaceEvaluator(NurbsSurface surface);
  SurfaceEvaluator(const SurfaceEvaluator&) = delete;
  SurfaceEvaluator& operator=(const SurfaceEvaluator&) = delete;
  const NurbsSurface& surface() const { return surface_; }
  const kernels::Patch& patch() const { return patch_; }

 private:
  NurbsSurface surface_;
  std::vector<double> inverse_[2], series_[2], points_;
  std::vector<int> bucket_[2];
  kernels::Patch patch_;
};

// out: n x derivative_count(order) x 3, for n pairs (u, v) within the domain. Does not poll: out is written whole.
void evaluate_points(const Run& run, const SurfaceEvaluator& evaluator, const double* uv, std::int64_t n, int order,
                     double* out);

// out: nu x nv x derivative_count(order) x 3. Fastest with u sorted.
void evaluate_grid(const Run& run, const SurfaceEvaluator& evaluator, const double* u, std::int64_t nu, const double* v,
                   std::int64_t nv, int order, double* out);

// Unit normals (see normal): n x 3.
void evaluate_normals(const Run& run, const SurfaceEvaluator& evaluator, const double* uv, std::int64_t n, double* out);

}  // namespace sgrt
