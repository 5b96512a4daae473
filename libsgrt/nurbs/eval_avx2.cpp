// Evaluation of surfaces for the AVX2 instruction set.
#include "nurbs/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "nurbs/eval_kernel.inl"
}  // namespace
void points_avx2(const Patch& patch, const double* uv, long n, int order, double* out) {
  cubic(patch) ? points_of<3>(patch, uv, n, order, out) : points_of<0>(patch, uv, n, order, out);
}
void grid_row_avx2(const Patch& patch, const GridRow& row) {
  cubic(patch) ? grid_row_of<3>(patch, row) : grid_row_of<0>(patch, row);
}
}  // namespace sgrt::kernels
