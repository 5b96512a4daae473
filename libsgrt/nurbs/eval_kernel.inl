// Evaluation of surfaces; included by eval_baseline.cpp and eval_avx2.cpp inside a namespace of their own. P: the
// degree of both directions where it is known, so that loops unroll; 0: any. docs/theory/nurbs.md, "Evaluation".
typedef double Lanes __attribute__((vector_size(32)));

static inline __attribute__((always_inline)) Lanes load4(const double* p) {
  Lanes v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
static inline __attribute__((always_inline)) void store4(double* p, Lanes v) {
  __builtin_memcpy(p, &v, sizeof v);
}
static inline __attribute__((always_inline)) Lanes all(double x) {
  return Lanes{x, x, x, x};
}

// The orders in u and in v of S, S_u, S_v, S_uu, S_uv, S_vv.
constexpr int kInU[6] = {0, 1, 0, 2, 1, 0}, kInV[6] = {0, 0, 1, 0, 1, 2};

static inline int span_of(const Spline& s, double u) {
  int b = (int)((u - s.begin) * s.scale);
  if (b >= s.bucket_count) b = s.bucket_count - 1;
  int k = s.bucket[b];
  while (k < s.last && s.knots[k + 1] <= u) ++k;
  while (k > s.degree && s.knots[k] > u) --k;
  return k;
}

// A2.2 with the differences' reciprocals; t[r] of the last two levels gives the first two derivatives (eq. 2.7):
// N' = p (t[r - 1] - t[r]), and the same once more.
template <int P>
static inline __attribute__((always_inline)) void basis(const Spline& s, int k, double u, int order, double* N,
                                                        double* N1, double* N2) {
  const int p = P ? P : s.degree;
  const double *U = s.knots + k, *inverse = s.inverse + (long)k * (p * (p + 1) / 2);
  double t1[P ? P + 2 : kMaxSplineDegree + 2];  // one 0 before and one after, for the differences
  double t2[P ? P + 2 : kMaxSplineDegree + 2];
  t1[0] = t2[0] = 0;
  N[0] = 1;
#pragma GCC unroll 4
  for (int j = 1; j <= p; ++j) {
    double saved = 0;
#pragma GCC unroll 4
    for (int r = 0; r < j; ++r) {
      const double t = N[r] * *inverse++;
      if (j == p) t1[r + 1] = t;
      if (j == p - 1) t2[r + 1] = t;
      N[r] = saved + (U[r + 1] - u) * t;
      saved = (u - U[1 - j + r]) * t;
    }
    N[j] = saved;
  }
  if (order < 1) return;
  t1[p + 1] = 0;
#pragma GCC unroll 4
  for (int r = 0; r <= p; ++r) N1[r] = p * (t1[r] - t1[r + 1]);
  if (order < 2) return;
  if (p == 1) {
    N2[0] = N2[1] = 0;
    return;
  }
  t2[p] = 0;
  const double* last = s.inverse + (long)k * (p * (p + 1) / 2) + p * (p - 1) / 2;
  double before = 0;
#pragma GCC unroll 4
  for (int r = 0; r < p; ++r) {
    const double t = (p - 1) * (t2[r] - t2[r + 1]) * last[r];
    N2[r] = p * (before - t);
    before = t;
  }
  N2[p] = p * before;
}

// Eq. 4.20 for up to two derivatives, on numbers or lanes: A of x, y, z in place, W of the weight.
template <class T>
static inline __attribute__((always_inline)) void quotient(T* A, const T* W, T inverse, int order) {
  A[0] *= inverse;
  if (order < 1) return;
  A[1] = (A[1] - W[1] * A[0]) * inverse;
  A[2] = (A[2] - W[2] * A[0]) * inverse;
  if (order < 2) return;
  const T uu = A[3] - W[1] * A[1] - W[1] * A[1] - W[3] * A[0];
  const T uv = A[4] - W[1] * A[2] - W[2] * A[1] - W[4] * A[0];
  const T vv = A[5] - W[2] * A[2] - W[2] * A[2] - W[5] * A[0];
  A[3] = uu * inverse;
  A[4] = uv * inverse;
  A[5] = vv * inverse;
}

template <int P, int Order>
static void points(const Patch& patch, const double* uv, long n, double* out) {
  constexpr int kCount = (Order + 1) * (Order + 2) / 2;
  constexpr int kWidth = P ? P + 1 : kMaxSplineDegree + 1;
  const int p = P ? P : patch.u.degree, q = P ? P : patch.v.degree;
  const long row = 4L * patch.v.size;
  for (long i = 0; i < n; ++i, out += 3 * kCount) {
    double Nu[3][kWidth], Nv[3][kWidth];
    const int ku = span_of(patch.u, uv[2 * i]), kv = span_of(patch.v, uv[2 * i + 1]);
    basis<P>(patch.u, ku, uv[2 * i], Order, Nu[0], Nu[1], Nu[2]);
    basis<P>(patch.v, kv, uv[2 * i + 1], Order, Nv[0], Nv[1], Nv[2]);
    const double* corner = patch.points + (ku - p) * row + 4L * (kv - q);
    Lanes A[kCount] = {};
#pragma GCC unroll 4
    for (int b = 0; b <= q; ++b) {
      Lanes T[Order + 1] = {};
#pragma GCC unroll 4
      for (int a = 0; a <= p; ++a) {
        const Lanes point = load4(corner + a * row + 4 * b);
#pragma GCC unroll 3
        for (int k = 0; k <= Order; ++k) T[k] = a == 0 ? all(Nu[k][a]) * point : T[k] + all(Nu[k][a]) * point;
      }
#pragma GCC unroll 6
      for (int s = 0; s < kCount; ++s) {
        const Lanes term = all(Nv[kInV[s]][b]) * T[kInU[s]];
        A[s] = b == 0 ? term : A[s] + term;
      }
    }
    if (patch.rational) {
      Lanes W[kCount];
#pragma GCC unroll 6
      for (int s = 0; s < kCount; ++s) W[s] = all(A[s][3]);
      quotient<Lanes>(A, W, all(1 / A[0][3]), Order);
    }
#pragma GCC unroll 6
    for (int s = 0; s < kCount; ++s) {
      out[3 * s] = A[s][0];
      out[3 * s + 1] = A[s][1];
      out[3 * s + 2] = A[s][2];
    }
  }
}

// The points [first, last) of one span of v: coordinates c of every derivative as lines of kChunk + kLanes numbers.
// Works in whole lanes; what runs over the end is written again by the next span.
template <int P, int Order, int Coordinates>
static inline __attribute__((always_inline)) void run_of_span(const Patch& patch, const GridRow& g, int kv, long start,
                                                              long first, long last) {
  constexpr int kCount = (Order + 1) * (Order + 2) / 2;
  const int q = P ? P : patch.v.degree;
  const long width = patch.v.size, line = kChunk + kLanes;
  for (int c = 0; c < Coordinates; ++c) {
    const double* T = g.columns + c * width + kv - q;
    for (long j = first; j < last; j += kLanes) {
      Lanes sum[kCount] = {};
#pragma GCC unroll 4
      for (int b = 0; b <= q; ++b) {
#pragma GCC unroll 6
        for (int s = 0; s < kCount; ++s) {
          const Lanes N = load4(g.Nv + j + (kInV[s] * (q + 1) + b) * g.stride);
          const Lanes term = N * all(T[4 * kInU[s] * width + b]);
          sum[s] = b == 0 ? term : sum[s] + term;
        }
      }
#pragma GCC unroll 6
      for (int s = 0; s < kCount; ++s) store4(g.line + (4 * s + c) * line + j - start, sum[s]);
    }
  }
}

template <int P, int Order>
static void grid_row(const Patch& patch, const GridRow& g) {
  constexpr int kCount = (Order + 1) * (Order + 2) / 2;
  const int p = P ? P : patch.u.degree;
  const long width = patch.v.size, line = kChunk + kLanes;
  double Nu[3][P ? P + 1 : kMaxSplineDegree + 1];
  const int ku = span_of(patch.u, g.u);
  basis<P>(patch.u, ku, g.u, Order, Nu[0], Nu[1], Nu[2]);
  for (int k = 0; k <= Order; ++k) {  // along u for every column of control points
    double* T = g.columns + 4 * k * width;
    const double* rows = patch.columns + (long)(ku - p) * 4 * width;
    for (long j = 0; j < 4 * width; ++j) {
      double sum = Nu[k][0] * rows[j];
      for (int a = 1; a <= p; ++a) sum += Nu[k][a] * rows[a * 4 * width + j];
      T[j] = sum;
    }
  }
  for (long start = 0; start < g.nv; start += kChunk) {
    const long end = start + kChunk < g.nv ? start + kChunk : g.nv;
    for (long j = start; j < end;) {
      long stop = j + 1;
      while (stop < end && g.span[stop] == g.span[j]) ++stop;
      if (patch.rational)
        run_of_span<P, Order, 4>(patch, g, g.span[j], start, j, stop);
      else
        run_of_span<P, Order, 3>(patch, g, g.span[j], start, j, stop);
      j = stop;
    }
    if (patch.rational) {
      for (long j = 0; j < end - start; j += kLanes) {
        Lanes W[kCount], A[kCount];
        for (int s = 0; s < kCount; ++s) W[s] = load4(g.line + (4 * s + 3) * line + j);
        const Lanes inverse = all(1) / W[0];
        for (int c = 0; c < 3; ++c) {
#pragma GCC unroll 6
          for (int s = 0; s < kCount; ++s) A[s] = load4(g.line + (4 * s + c) * line + j);
          quotient<Lanes>(A, W, inverse, Order);
#pragma GCC unroll 6
          for (int s = 0; s < kCount; ++s) store4(g.line + (4 * s + c) * line + j, A[s]);
        }
      }
    }
    for (int s = 0; s < kCount; ++s) {
      const double *x = g.line + 4 * s * line, *y = x + line, *z = y + line;
      double* out = g.out + start * 3 * kCount + 3 * s;
      for (long j = 0; j < end - start; ++j, out += 3 * kCount) {
        out[0] = x[j];
        out[1] = y[j];
        out[2] = z[j];
      }
    }
  }
}

template <int P>
static void points_of(const Patch& patch, const double* uv, long n, int order, double* out) {
  if (order == 0)
    points<P, 0>(patch, uv, n, out);
  else if (order == 1)
    points<P, 1>(patch, uv, n, out);
  else
    points<P, 2>(patch, uv, n, out);
}
template <int P>
static void grid_row_of(const Patch& patch, const GridRow& row) {
  if (row.order == 0)
    grid_row<P, 0>(patch, row);
  else if (row.order == 1)
    grid_row<P, 1>(patch, row);
  else
    grid_row<P, 2>(patch, row);
}
static bool cubic(const Patch& patch) {
  return patch.u.degree == 3 && patch.v.degree == 3;
}
