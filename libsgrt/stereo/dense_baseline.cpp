// The dense kernels for the baseline instruction set.
#include "stereo/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "stereo/dense_kernel.inl"
}  // namespace
void dense_row_baseline(const DensePlanes& planes, int y0, int x_first, int stride, int count,
                        const DenseOptions& options, RowMatch* matches) {
  dense_row(planes, y0, x_first, stride, count, options, matches);
}
void warp_row_baseline(const WarpRow& row) {
  warp_row(row);
}
}  // namespace sgrt::kernels
