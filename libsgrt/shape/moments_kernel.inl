// Neighbours into a disc, and the moments of a quadric. See shape/kernels.hpp. Four doubles at a time, so that both
// instruction sets add in the same order.
typedef double Four __attribute__((vector_size(32)));
typedef long FourBits __attribute__((vector_size(32)));

static inline __attribute__((always_inline)) Four load4(const double* p) {
  Four v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
static inline __attribute__((always_inline)) void store4(double* p, Four v) {
  __builtin_memcpy(p, &v, sizeof v);
}
static inline __attribute__((always_inline)) Four all4(double x) {
  return Four{x, x, x, x};
}
static inline __attribute__((always_inline)) Four masked(FourBits mask, Four v) {
  return (Four)(mask & (FourBits)v);
}

static inline long gather(const Sheet& s, const Disc& d, long begin, long end, double* u, double* v, double* w,
                          double* one) {
  const double inverse = 1 / d.radius;
  const Four cx = all4(d.centre[0]), cy = all4(d.centre[1]), cz = all4(d.centre[2]);
  const Four limit = all4(d.radius * d.radius), cosine = all4(d.least_cosine);
  Four a[9];
  for (int k = 0; k < 9; ++k) a[k] = all4(d.axes[k] * inverse);
  const Four n0 = all4(d.axes[6]), n1 = all4(d.axes[7]), n2 = all4(d.axes[8]);
  const FourBits lane = {0, 1, 2, 3};
  long to = 0;
  for (long i = begin; i < end; i += 4) {
    const Four x = load4(s.x + i) - cx, y = load4(s.y + i) - cy, z = load4(s.z + i) - cz;
    const long left = end - i;
    FourBits in = (x * x + y * y + z * z <= limit) & (lane < FourBits{left, left, left, left});
    in &= n0 * load4(s.nx + i) + n1 * load4(s.ny + i) + n2 * load4(s.nz + i) >= cosine;
    if ((in[0] | in[1] | in[2] | in[3]) == 0) continue;
    store4(u + to, masked(in, a[0] * x + a[1] * y + a[2] * z));
    store4(v + to, masked(in, a[3] * x + a[4] * y + a[5] * z));
    store4(w + to, masked(in, a[6] * x + a[7] * y + a[8] * z));
    store4(one + to, masked(in, load4(s.weight + i)));
    to += 4;
  }
  return to;
}

static inline __attribute__((always_inline)) void keep(double* sums, Four v) {
  *sums = (v[0] + v[2]) + (v[1] + v[3]);
}

static inline void moments(const double* u, const double* v, const double* w, const double* one, long n, double* sums) {
  const Four zero = all4(0), unit = all4(1);
  Four s[28];
  for (int k = 0; k < 28; ++k) s[k] = zero;
  // Twice over the points, so that the sums of a sweep stay in registers.
  for (long i = 0; i < n; i += 4) {
    const Four o = load4(one + i), a = load4(u + i), b = load4(v + i), h = load4(w + i);
    const Four uu = a * a, vv = b * b, rho = uu + vv;
    const Four g = unit + h * h / (rho + all4(1e-6));
    const Four d = uu * g, e = a * b * g, f = vv * g;
    const Four oa = o * a, ob = o * b;
    s[0] += o;
    s[1] += oa;
    s[2] += ob;
    s[3] += o * d;
    s[4] += o * e;
    s[5] += o * f;
    s[6] += o * h;
    s[7] += oa * a;
    s[8] += oa * b;
    s[9] += oa * d;
    s[10] += oa * e;
    s[11] += oa * f;
    s[12] += oa * h;
    s[13] += ob * b;
  }
  for (long i = 0; i < n; i += 4) {
    const Four o = load4(one + i), a = load4(u + i), b = load4(v + i), h = load4(w + i);
    const Four uu = a * a, vv = b * b, rho = uu + vv;
    const Four g = unit + h * h / (rho + all4(1e-6));
    const Four d = uu * g, e = a * b * g, f = vv * g;
    const Four ob = o * b, od = o * d, oe = o * e, of = o * f, oh = o * h;
    s[14] += ob * d;
    s[15] += ob * e;
    s[16] += ob * f;
    s[17] += ob * h;
    s[18] += od * d;
    s[19] += od * e;
    s[20] += od * f;
    s[21] += od * h;
    s[22] += oe * e;
    s[23] += oe * f;
    s[24] += oe * h;
    s[25] += of * f;
    s[26] += of * h;
    s[27] += oh * h;
  }
  for (int k = 0; k < 28; ++k) keep(sums + k, s[k]);
}
