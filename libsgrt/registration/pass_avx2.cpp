// The pass over live points for AVX2.
#include "registration/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "registration/pass_kernel.inl"
}  // namespace
void pass_avx2(const Pass& pass, long begin, long end, PassSums* sums) {
  pass_over(&pass, begin, end, sums);
}
}  // namespace sgrt::kernels
