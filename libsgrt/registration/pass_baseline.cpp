// The pass over live points for the baseline.
#include "registration/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "registration/pass_kernel.inl"
}  // namespace
void pass_baseline(const Pass& pass, long begin, long end, PassSums* sums) {
  pass_over(&pass, begin, end, sums);
}
}  // namespace sgrt::kernels
