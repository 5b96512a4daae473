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
  float width;       // px, sigma by the width at half height; 0 where the profile does not come down
  float asymmetry;   // of its foot about its top (eq. 9)
};

struct PlainOptions {
  int half;  // of the centroid's window, px; the background is taken from the `half` pixels on each side of it
};

void line_peak_u8_baseline(const unsigned char* line, int width, const PlainOptions& options, LinePeak* out);
void line_peak_u8_avx2(const unsigned char* line, int width, const PlainOptions& options, LinePeak* out);
void line_peak_f32_baseline(const float* line, int width, const PlainOptions& options, LinePeak* out);
void line_peak_f32_avx2(const float* line, int width, const PlainOptions& options, LinePeak* out);

// The pixels of a Gaussian fit: v[0 .. count), readable to a multiple of four, v[0] at position `first`; parameters p:
// centre, sigma, amplitude, background, its slope; variance noise2 + gain x signal; levels from `clipped` on left out.
constexpr int kGaussSize = 5;
struct GaussTask {
  const float* v;
  int count;
  double first;
  const double* p;
  double noise2, gain, clipped;
};
struct GaussSums {
  double N[kGaussSize][kGaussSize];  // lower triangle of the normal equations
  double g[kGaussSize];
  double cost;
};
void gauss_sums_baseline(const GaussTask& task, GaussSums* out);
void gauss_sums_avx2(const GaussTask& task, GaussSums* out);

// What noise that grows with the signal does to the centre: sums of k_i^2 a_i, k_i = d centre / d v_i; of the residuals
// beside it, of which the fit leaves the share 1 - h_i, h the leverage; and of that share times a_i^2. N = L D L^T, 1 /
// D on L's diagonal; top: first row of the inverse of N.
struct GaussShot {
  double shot, excess, power;
};
void gauss_shot_baseline(const GaussTask& task, const double L[kGaussSize][kGaussSize], const double* top,
                         GaussShot* out);
void gauss_shot_avx2(const GaussTask& task, const double L[kGaussSize][kGaussSize], const double* top, GaussShot* out);

}  // namespace sgrt::kernels
