// The stripe kernels for the AVX2 instruction set.
#include "laser/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "laser/gaussian_kernel.inl"
#include "laser/stripe_kernel.inl"
}  // namespace
void line_peak_u8_avx2(const unsigned char* line, int width, const PlainOptions& options, LinePeak* out) {
  line_peak(line, width, options, out);
}
void line_peak_f32_avx2(const float* line, int width, const PlainOptions& options, LinePeak* out) {
  line_peak(line, width, options, out);
}
void gauss_sums_avx2(const GaussTask& task, GaussSums* out) {
  equations(task, out);
}
void gauss_shot_avx2(const GaussTask& task, const double L[kGaussSize][kGaussSize], const double* top, GaussShot* out) {
  shot(task, L, top, out);
}
}  // namespace sgrt::kernels
