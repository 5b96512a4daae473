// The two hot loops of stereo, compiled once per instruction set from *_kernel.inl (plain C inside: no inline function
// of a library may leak out of a file that is built for AVX2). The same lanes and the same order of additions give the
// same bits on both.
#pragma once

namespace sgrt::kernels {

// A rectified image as the kernels see it: grey values, x-gradient, B-spline coefficients along x and mask share one
// layout.
struct Plane {
  const float* value;
  const float* gradient;
  const float* coefficient;
  const unsigned char* mask;
  int width, height;
};

// A match along the row: left (x0 + i, y0 + j) lies at right x0 + i - (d + a i + b j + c20 i^2 + c11 i j + c02 j^2),
// row y0 + j. The plane (d, a, b) is refined; the curvature is given.
struct RowMatch {
  float d, a, b;
  float c20, c11, c02;
  float correlation;    // ZNCC at the last evaluation
  float texture;        // [H^-1]_dd: variance of d for unit noise variance of f - g, grey levels of the left image
  float noise;          // residual variance of f - g, grey levels squared of the left image
  float gain;           // how much the noise of a curvature taken from the neighbours adds, >= 1 (set by match.cpp)
  float bias2;          // px^2, what the neighbourhood shows beyond noise (set by match.cpp)
  float spread;         // of the texture over the window: its second moment, the smaller of x and y, 1 if even
  float w20, w11, w02;  // how far d is moved by a curvature c20, c11, c02 that the window's plane does not follow
  int window;           // px, that it was made with (set by match.cpp)
  int outcome;          // kConverged ...
};
enum { kConverged = 0, kLeftView = 1, kRightView = 2, kClipped = 3, kFlat = 4, kDiverged = 5 };

struct RefineOptions {
  int half;  // window side is 2 half + 1, at most 41
  int max_iterations;
  float min_variance;  // of the window's grey levels; flatter ones have no texture
  float max_move;      // px that d may move from its start
};

void refine_row_baseline(const Plane& left, const Plane& right, int x0, int y0, const RefineOptions& options,
                         RowMatch* match);
void refine_row_avx2(const Plane& left, const Plane& right, int x0, int y0, const RefineOptions& options,
                     RowMatch* match);

// The dense step (docs/theory/stereo.md): the right image is warped once by a disparity d a pixel, and every window
// then takes one Gauss-Newton step from sums over it. f and fx have rows of `width`, g, d and keep of `stride`, a
// multiple of
// 8. d is relative to an origin of the frame; keep is 1 or 0, and g and d are 0 where it is 0.
struct DensePlanes {
  const float *f, *fx, *g, *d, *keep;
  int width, height, stride;
};
struct DenseOptions {
  int half;
  float min_variance;
  const unsigned char* wanted;  // one a window of the row, 0: leave it; NULL: all
};
// Solves the windows centred on (x_first + k stride, y0), k < count. match.d is relative like the planes'.
void dense_row_baseline(const DensePlanes& planes, int y0, int x_first, int stride, int count,
                        const DenseOptions& options, RowMatch* matches);
void dense_row_avx2(const DensePlanes& planes, int y0, int x_first, int stride, int count, const DenseOptions& options,
                    RowMatch* matches);

// One row of the right image at x - shift(x), x < width, from its spline coefficients along x. Where shift is NaN or
// leads out of the row keep, g and d become 0; else d is shift less `origin`. shift and d may be one row; rows are
// padded to a multiple of 8.
struct WarpRow {
  const float* coefficient;   // of the right row
  const unsigned char* mask;  // of the right row; 0 is good
  const unsigned char* left_mask;
  const float* shift;
  float* g;
  float* d;
  float* keep;
  int width, right_width;
  float origin;
};
void warp_row_baseline(const WarpRow& row);
void warp_row_avx2(const WarpRow& row);

// One band of rows of the coarse search. Images are width x height (own widths), zero-mean enough for float sums.
struct CoarseBand {
  const float *left, *right;           // rows of left_width, right_width
  const float *left_mean, *left_norm;  // window mean and 1/|window - mean|; norm 0: not usable
  const float *right_mean, *right_norm;
  int left_width, right_width, height;
  int half;            // window side is 2 half + 1
  int d_min, d_count;  // disparities d_min .. d_min + d_count - 1; d_count a multiple of 8
  int row_begin, row_end;
  float* columns;         // scratch: left_width x d_count
  float* reversed;        // scratch: 6 x (left_width + d_count)
  float* sums;            // scratch: 2 x d_count
  float* best_left;       // out, left_width a row: correlation and disparity of the best match
  float* second_left;     // correlation of the best match more than 2 disparities from it
  float* disparity_left;  // sub-pixel by a parabola
  float* best_right;      // out, right_width a row
  int* disparity_right;
};
void coarse_band_baseline(const CoarseBand& band);
void coarse_band_avx2(const CoarseBand& band);

}  // namespace sgrt::kernels
