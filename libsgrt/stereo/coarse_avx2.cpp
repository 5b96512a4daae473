// The coarse search for the AVX2.
#include "stereo/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "stereo/coarse_kernel.inl"
}  // namespace
void coarse_band_avx2(const CoarseBand& band) {
  coarse_band(band);
}
}  // namespace sgrt::kernels
