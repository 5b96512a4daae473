// The hot loop of stripe extraction, compiled once per instruction set from stripe_kernel.inl (plain C inside: no
// inline function of a library may leak out of a file that is built for AVX2). All arithmetic that a result depends on
// is scalar or exact, so both give the same bits.
#pragma once

namespace sgrt::kernels {

// The strongest peak of a line and its grey centroid over a local, linear background.
struct LinePeak {
  int at;            // pixel of the peak, the middle of a plateau
  float value;       // its grey level
  float second;      // the largest grey level further than twice the window's half width from it
  float background;  // local, under the peak
  float signal;      // sum of grey levels over the background in the window
  float centre;      // centroid, px; NaN where there is no signal or the flanks leave the line
};

struct PlainOptions {
  int half;  // of the centroid's window, px; the background is taken from the `half` pixels on each side of it
};

void line_peak_u8_baseline(const unsigned char* line, int width, const PlainOptions& options, LinePeak* out);
void line_peak_u8_avx2(const unsigned char* line, int width, const PlainOptions& options, LinePeak* out);
void line_peak_f32_baseline(const float* line, int width, const PlainOptions& options, LinePeak* out);
void line_peak_f32_avx2(const float* line, int width, const PlainOptions& options, LinePeak* out);

}  // namespace sgrt::kernels
