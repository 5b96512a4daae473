// The stripe kernels for the baseline instruction set.
#include "laser/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "laser/stripe_kernel.inl"
}  // namespace
void line_peak_u8_baseline(const unsigned char* line, int width, const PlainOptions& options, LinePeak* out) {
  line_peak(line, width, options, out);
}
void line_peak_f32_baseline(const float* line, int width, const PlainOptions& options, LinePeak* out) {
  line_peak(line, width, options, out);
}
}  // namespace sgrt::kernels
