// The coarse search for the baseline instruction set.
#include "stereo/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "stereo/coarse_kernel.inl"
}  // namespace
void coarse_band_baseline(const CoarseBand& band) {
  coarse_band(band);
}
}  // namespace sgrt::kernels
