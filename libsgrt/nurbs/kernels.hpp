// The hot loops of surface evaluation, compiled once per instruction set from eval_kernel.inl (plain C inside: no
// inline function of a library may leak out of a file that is built for AVX2). Points of a grid and scattered ones go
// through the same additions in the same order, so they have the same bits, on both instruction sets.
#pragma once

namespace sgrt::kernels {

constexpr int kMaxSplineDegree = 24;
constexpr int kLanes = 4;  // doubles

// One direction, prepared.
struct Spline {
  int degree, size;
  const double* knots;
  const double* inverse;   // a span's knot differences, 1 / (u_k+r+1 - u_k+1-j+r), p (p + 1) / 2 numbers from span 0 on
  const double* series;    // degree 3: N^(d)(u_k) / d! of the span's functions, 4 x 4 numbers from span 0 on
  const int* bucket;       // a span to start the search from, by (u - begin) * scale
  int bucket_count, last;  // last: the last non-empty span
  double begin, scale;
};

struct Patch {
  Spline u, v;
  const double* points;  // nu x nv x 4: w x, w y, w z, w
  bool rational;
};

// The points and derivatives up to `order` (0, 1 or 2) at n pairs (u, v): n x 1, 3 or 6 x 3.
void points_baseline(const Patch& patch, const double* uv, long n, int order, double* out);
void points_avx2(const Patch& patch, const double* uv, long n, int order, double* out);

// The spans and basis functions of parameters: span[i], N[i][derivative][function].
void tabulate_baseline(const Spline& spline, const double* u, long n, int order, int* span, double* N);
void tabulate_avx2(const Spline& spline, const double* u, long n, int order, int* span, double* N);

// Some rows of a grid by some of its columns: first Q, the rows of control points summed along v, which all rows share,
// then each row of the grid from those of Q that its span needs.
constexpr int kChunk = 64;  // columns, so that Q stays near
struct GridChunk {
  long nu, nv;
  const int *span_u, *span_v;
  const double *Nu, *Nv;  // tabulated
  int order;
  int first_row, last_row;  // of the control points that the spans of u need
  double* Q;                // scratch: these rows x nv x 4 (order + 1), and kLanes numbers more
  double* out;
  long stride;  // numbers from one row of out to the next
};
void grid_baseline(const Patch& patch, const GridChunk& chunk);
void grid_avx2(const Patch& patch, const GridChunk& chunk);

}  // namespace sgrt::kernels
