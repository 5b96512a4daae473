// The IC-GN kernel for the baseline instruction set.
#include "stereo/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "stereo/icgn_kernel.inl"
}  // namespace
void refine_row_baseline(const Plane& left, const Plane& right, int x0, int y0, const RefineOptions& options,
                         RowMatch* match) {
  refine_row(left, right, x0, y0, options, match);
}
}  // namespace sgrt::kernels
