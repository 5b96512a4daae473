// Evaluation of surfaces for the AVX2 instruction set.
#include "nurbs/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "nurbs/eval_kernel.inl"
}  // namespace
void points_avx2(const Patch& patch, const double* uv, long n, int order, double* out) {
  cubic(patch) ? points_of<3>(patch, uv, n, order, out) : points_of<0>(patch, uv, n, order, out);
}
void grid_avx2(const Patch& patch, const GridChunk& chunk) {
  cubic(patch) ? grid_of<3>(patch, chunk) : grid_of<0>(patch, chunk);
}
void tabulate_avx2(const Spline& spline, const double* u, long n, int order, int* span, double* N) {
  spline.degree == 3 ? tabulate<3>(spline, u, 1, n, order, span, N) : tabulate<0>(spline, u, 1, n, order, span, N);
}
}  // namespace sgrt::kernels
