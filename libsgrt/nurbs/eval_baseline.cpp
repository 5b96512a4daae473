// Evaluation of surfaces for the baseline instruction set.
#include "nurbs/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "nurbs/eval_kernel.inl"
}  // namespace
void points_baseline(const Patch& patch, const double* uv, long n, int order, double* out) {
  cubic(patch) ? points_of<3>(patch, uv, n, order, out) : points_of<0>(patch, uv, n, order, out);
}
void grid_row_baseline(const Patch& patch, const GridRow& row) {
  cubic(patch) ? grid_row_of<3>(patch, row) : grid_row_of<0>(patch, row);
}
void tabulate_baseline(const Spline& spline, const double* u, long n, int order, int* span, double* N, long stride) {
  const int width = spline.degree + 1;
  double row[3][kMaxSplineDegree + 1];
  for (long i = 0; i < n; ++i) {
    span[i] = span_of(spline, u[i]);
    basis<0>(spline, span[i], u[i], order, row[0], row[1], row[2]);
    for (int d = 0; d <= order; ++d) {
      for (int a = 0; a < width; ++a) N[(d * width + a) * stride + i] = row[d][a];
    }
  }
}
}  // namespace sgrt::kernels
