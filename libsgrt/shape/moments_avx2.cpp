// Moments of neighbours for the AVX2 instruction set.
#include "shape/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "shape/moments_kernel.inl"
}  // namespace
long gather_avx2(const Sheet& sheet, const Disc& disc, long begin, long end, double* u, double* v, double* w,
                 double* one) {
  return gather(sheet, disc, begin, end, u, v, w, one);
}
void moments_avx2(const double* u, const double* v, const double* w, const double* one, long n, double* sums) {
  moments(u, v, w, one, n, sums);
}
}  // namespace sgrt::kernels
