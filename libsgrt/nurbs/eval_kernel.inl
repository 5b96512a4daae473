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
static inline __attribute__((always_inline)) void store3(double* p, Lanes v) {
  __builtin_memcpy(p, &v, 3 * sizeof(double));
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
  k += k < s.last && s.knots[k + 1] <= u;  // mostly enough, and no branch to guess
  while (__builtin_expect(k < s.last && s.knots[k + 1] <= u, 0)) ++k;
  while (__builtin_expect(k > s.degree && s.knots[k] > u, 0)) --k;
  return k;
}

// The functions of a span and their derivatives at u. Degree 3: by their Taylor series about the span's begin.
static inline __attribute__((always_inline)) void cubic_basis(const Spline& s, int k, double u, int order, double* N,
                                                              double* N1, double* N2) {
  const double* series = s.series + 16L * k;
  const Lanes x = all(u - s.knots[k]), c1 = load4(series + 4), c2 = load4(series + 8), c3 = load4(series + 12);
  store4(N, load4(series) + x * (c1 + x * (c2 + x * c3)));
  if (order < 1) return;
  const Lanes twice = c2 + c2, thrice = c3 + c3 + c3;
  store4(N1, c1 + x * (twice + x * thrice));
  if (order < 2) return;
  store4(N2, twice + x * (thrice + thrice));
}

// Any degree: A2.2 with the differences' reciprocals; t[r] of the last two levels gives the first two derivatives
// (eq. 2.7): N' = p (t[r - 1] - t[r]), and the same once more.
static void any_basis(const Spline& s, int k, double u, int order, double* N, double* N1, double* N2) {
  const int p = s.degree;
  const double *U = s.knots + k, *inverse = s.inverse + (long)k * (p * (p + 1) / 2);
  double t1[kMaxSplineDegree + 2];  // one 0 before and one after, for the differences
  double t2[kMaxSplineDegree + 2];
  t1[0] = t2[0] = 0;
  N[0] = 1;
  for (int j = 1; j <= p; ++j) {
    double saved = 0;
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
  for (int r = 0; r <= p; ++r) N1[r] = p * (t1[r] - t1[r + 1]);
  if (order < 2) return;
  if (p == 1) {
    N2[0] = N2[1] = 0;
    return;
  }
  t2[p] = 0;
  const double* last = s.inverse + (long)k * (p * (p + 1) / 2) + p * (p - 1) / 2;
  double before = 0;
  for (int r = 0; r < p; ++r) {
    const double t = (p - 1) * (t2[r] - t2[r + 1]) * last[r];
    N2[r] = p * (before - t);
    before = t;
  }
  N2[p] = p * before;
}

template <int P>
static inline __attribute__((always_inline)) void basis(const Spline& s, int k, double u, int order, double* N,
                                                        double* N1, double* N2) {
  if (P == 3 || s.degree == 3)
    cubic_basis(s, k, u, order, N, N1, N2);
  else
    any_basis(s, k, u, order, N, N1, N2);
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

// What a point needs in v of one row of control points, sum over b of N_b P_b.
template <int P>
static inline __attribute__((always_inline)) Lanes along_v(const double* row, const double* Nv, int q) {
  Lanes sum = all(Nv[0]) * load4(row);
#pragma GCC unroll 4
  for (int b = 1; b <= (P ? P : q); ++b) sum += all(Nv[b]) * load4(row + 4 * b);
  return sum;
}

// From A (x, y, z, w) of a point and its derivatives to numbers in a row.
template <int Order>
static inline __attribute__((always_inline)) void finish(bool rational, Lanes* A, double* out) {
  constexpr int kCount = (Order + 1) * (Order + 2) / 2;
  if (rational) {
    Lanes W[kCount];
#pragma GCC unroll 6
    for (int s = 0; s < kCount; ++s) W[s] = all(A[s][3]);
    quotient<Lanes>(A, W, all(1) / W[0], Order);
  }
#pragma GCC unroll 6
  for (int s = 0; s + 1 < kCount; ++s) store4(out + 3 * s, A[s]);  // the fourth number is written over by the next
  store3(out + 3 * (kCount - 1), A[kCount - 1]);
}

template <int P>
static void tabulate(const Spline& given, const double* u, long step, long n, int order, int* span, double* N) {
  const Spline spline = given;  // a copy that no output can overlap
  const int width = P ? P + 1 : spline.degree + 1;
  for (long i = 0; i < n; ++i, N += (order + 1) * width) {
    span[i] = span_of(spline, u[step * i]);
    basis<P>(spline, span[i], u[step * i], order, N, N + width, N + 2 * width);
  }
}

// Spans and basis functions of a batch first, then the sums: short loops, of which the processor overlaps many turns.
template <int P, int Order>
static void points(const Patch& patch, const double* uv, long n, double* out) {
  constexpr int kCount = (Order + 1) * (Order + 2) / 2, kBatch = 32;
  constexpr int kWidth = P ? P + 1 : kMaxSplineDegree + 1;
  const int p = P ? P : patch.u.degree, q = P ? P : patch.v.degree;
  const long row = 4L * patch.v.size;
  const double* control = patch.points;
  const bool rational = patch.rational;
  int span[2][kBatch];
  double N[2][kBatch * (Order + 1) * kWidth];
  for (long begin = 0; begin < n; begin += kBatch) {
    const long count = n - begin < kBatch ? n - begin : kBatch;
    tabulate<P>(patch.u, uv + 2 * begin, 2, count, Order, span[0], N[0]);
    tabulate<P>(patch.v, uv + 2 * begin + 1, 2, count, Order, span[1], N[1]);
    for (long i = 0; i < count; ++i, out += 3 * kCount) {
      const double *Nu = N[0] + i * (Order + 1) * (p + 1), *Nv = N[1] + i * (Order + 1) * (q + 1);
      const double* corner = control + (span[0][i] - p) * row + 4L * (span[1][i] - q);
      Lanes A[kCount] = {};
#pragma GCC unroll 4
      for (int a = 0; a <= p; ++a) {
        Lanes T[Order + 1];
#pragma GCC unroll 3
        for (int l = 0; l <= Order; ++l) T[l] = along_v<P>(corner + a * row, Nv + l * (q + 1), q);
#pragma GCC unroll 6
        for (int s = 0; s < kCount; ++s) {
          const Lanes term = all(Nu[kInU[s] * (p + 1) + a]) * T[kInV[s]];
          A[s] = a == 0 ? term : A[s] + term;
        }
      }
      finish<Order>(rational, A, out);
    }
  }
}

// Points alone, without weights: the numbers of a row of the grid are sums of four rows of Q, whatever they mean.
template <int P>
static void packed_row(const double* Q, long row, const double* Nu, int p, long n, double* out) {
  long j = 0;
  for (; j + kLanes <= n; j += kLanes) {
    Lanes sum = all(Nu[0]) * load4(Q + j);
#pragma GCC unroll 4
    for (int a = 1; a <= (P ? P : p); ++a) sum += all(Nu[a]) * load4(Q + a * row + j);
    store4(out + j, sum);
  }
  for (; j < n; ++j) {
    double sum = Nu[0] * Q[j];
    for (int a = 1; a <= p; ++a) sum += Nu[a] * Q[a * row + j];
    out[j] = sum;
  }
}

template <int P, int Order>
static void lanes_row(bool rational, const double* Q, long row, const double* Nu, int p, long n, double* out) {
  constexpr int kCount = (Order + 1) * (Order + 2) / 2;
  for (long j = 0; j < n; ++j, Q += 4 * (Order + 1), out += 3 * kCount) {
    Lanes A[kCount] = {};
#pragma GCC unroll 4
    for (int a = 0; a <= (P ? P : p); ++a) {
#pragma GCC unroll 6
      for (int s = 0; s < kCount; ++s) {
        const Lanes term = all(Nu[kInU[s] * (p + 1) + a]) * load4(Q + a * row + 4 * kInV[s]);
        A[s] = a == 0 ? term : A[s] + term;
      }
    }
    finish<Order>(rational, A, out);
  }
}

template <int P, int Order>
static void grid(const Patch& patch, const GridChunk& g) {
  constexpr int kNumbers = 3 * (Order + 1) * (Order + 2) / 2;
  const int p = P ? P : patch.u.degree, q = P ? P : patch.v.degree;
  const bool packed = Order == 0 && !patch.rational;
  const long each = packed ? 3 : 4 * (Order + 1), row = each * g.nv;
  for (int r = g.first_row; r <= g.last_row; ++r) {
    double* to = g.Q + (r - g.first_row) * row;
    for (long j = 0; j < g.nv; ++j) {
      const double* corner = patch.points + 4 * ((long)r * patch.v.size + g.span_v[j] - q);
      for (int l = 0; l <= Order; ++l)  // packed: the fourth number is written over by the next point
        store4(to + each * j + 4 * l, along_v<P>(corner, g.Nv + (j * (Order + 1) + l) * (q + 1), q));
    }
  }
  for (long i = 0; i < g.nu; ++i) {
    const double* Q = g.Q + (g.span_u[i] - p - g.first_row) * row;
    const double* Nu = g.Nu + i * (Order + 1) * (p + 1);
    double* out = g.out + i * g.stride;
    if (packed)
      packed_row<P>(Q, row, Nu, p, kNumbers * g.nv, out);
    else
      lanes_row<P, Order>(patch.rational, Q, row, Nu, p, g.nv, out);
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
static void grid_of(const Patch& patch, const GridChunk& chunk) {
  if (chunk.order == 0)
    grid<P, 0>(patch, chunk);
  else if (chunk.order == 1)
    grid<P, 1>(patch, chunk);
  else
    grid<P, 2>(patch, chunk);
}
static bool cubic(const Patch& patch) {
  return patch.u.degree == 3 && patch.v.degree == 3;
}
