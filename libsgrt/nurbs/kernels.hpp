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
  const int* bucket;       // a span to start the search from, by (u - begin) * scale
  int bucket_count, last;  // last: the last non-empty span
  double begin, scale;
};

struct Patch {
  Spline u, v;
  const double* points;   // nu x nv x 4: w x, w y, w z, w
  const double* columns;  // nu x 4 x nv: the same
  bool rational;
};

// The points and derivatives up to `order` (0, 1 or 2) at n pairs (u, v): n x 1, 3 or 6 x 3.
void points_baseline(const Patch& patch, const double* uv, long n, int order, double* out);
void points_avx2(const Patch& patch, const double* uv, long n, int order, double* out);

// The spans and basis functions of parameters: span[i], N[(d (p + 1) + a) * stride + i].
void tabulate_baseline(const Spline& spline, const double* u, long n, int order, int* span, double* N, long stride);

// A row of a grid: one u against the v of a table. N is padded to a multiple of kLanes (stride), `line` is scratch.
struct GridRow {
  double u;
  const int* span;   // of v
  const double* Nv;  // tabulated
  long nv, stride;
  int order;
  double* columns;  // scratch: 3 x 4 x size of v
  double* line;     // scratch: 6 x 4 x (kChunk + kLanes)
  double* out;      // nv x 1, 3 or 6 x 3
};
constexpr int kChunk = 128;  // points of a row at a time
void grid_row_baseline(const Patch& patch, const GridRow& row);
void grid_row_avx2(const Patch& patch, const GridRow& row);

}  // namespace sgrt::kernels
