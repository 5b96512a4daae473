// The sums of the Gaussian fit over its pixels, four side by side, see kernels.hpp; docs/theory/laser.md eq. 6-7.
typedef double Four __attribute__((vector_size(32)));
constexpr int kSize = kGaussSize;

// exp(-(x - c)^2 / 2 t^2) at four pixels after four by recurrences: three exponentials a window instead of one a pixel.
struct Bell {
  Four value, ratio;
  double step;
  Bell(double x, double c, double t) {
    const double v = __builtin_exp(-(x - c) * (x - c) / (2 * t * t)),
                 r = __builtin_exp(-(2 * (x - c) + 1) / (2 * t * t));
    const double s = __builtin_exp(-1 / (t * t)), s2 = s * s, s3 = s2 * s, s6 = s3 * s3, r2 = r * r, r4 = r2 * r2;
    value = Four{v, v * r, v * r2 * s, v * r2 * r * s3};
    const double first = r4 * s6, s4 = s2 * s2, s8 = s4 * s4;
    ratio = Four{first, first * s4, first * s8, first * s8 * s4};
    step = s8 * s8;
  }
  void next() {
    value *= ratio;
    ratio *= step;
  }
};

static inline double total(const Four& v) {
  return (v[0] + v[1]) + (v[2] + v[3]);
}

// Four pixels of the window: J of the model, residual, weight (0 of what is clipped), signal.
struct Pixels {
  Four J[kSize], r, weight, a;
  Pixels(const GaussTask& w, int i, const Four& bell) {
    const double first = w.first + i, per_t = 1 / w.p[1];
    const double* p = w.p;
    const Four x = Four{first, first + 1, first + 2, first + 3}, u = (x - p[0]) * per_t;
    const Four v = Four{w.v[i], w.v[i + 1], w.v[i + 2], w.v[i + 3]}, zero = {0, 0, 0, 0};
    a = p[2] * bell;
    r = v - (a + p[3] + p[4] * x);
    const Four variance = w.noise2 + w.gain * (a > 0 ? a : zero);
    weight = v < w.clipped ? 1 / variance : zero;
    J[0] = a * u * per_t;
    J[1] = J[0] * u;
    J[2] = bell;
    J[3] = Four{1, 1, 1, 1};
    J[4] = x;
  }
};

static void equations(const GaussTask& w, GaussSums* out) {
  Four N[kSize * (kSize + 1) / 2] = {}, g[kSize] = {}, cost = {};
  Bell bell(w.first, w.p[0], w.p[1]);
  for (int i = 0; i < w.count; i += 4, bell.next()) {
    const Pixels x(w, i, bell.value);
    for (int j = 0, at = 0; j < kSize; ++j) {
      const Four wj = x.weight * x.J[j];
      g[j] += wj * x.r;
      for (int k = 0; k <= j; ++k) N[at++] += wj * x.J[k];
    }
    cost += x.weight * x.r * x.r;
  }
  for (int j = 0, at = 0; j < kSize; ++j) {
    out->g[j] = total(g[j]);
    for (int k = 0; k < kSize; ++k) out->N[j][k] = k <= j ? total(N[at++]) : 0;
  }
  out->cost = total(cost);
}

static void shot(const GaussTask& w, const double L[kSize][kSize], const double* top, GaussShot* out) {
  Four shot = {}, excess = {}, power = {};
  const Four one = {1, 1, 1, 1}, zero = {0, 0, 0, 0};
  Bell bell(w.first, w.p[0], w.p[1]);
  for (int i = 0; i < w.count; i += 4, bell.next()) {
    const Pixels x(w, i, bell.value);
    const Four there = x.weight > 0 ? one : zero;
    Four effect = {}, leverage = {}, y[kSize];
    for (int j = 0; j < kSize; ++j) {
      effect += top[j] * x.J[j];
      y[j] = x.J[j];
      for (int k = 0; k < j; ++k) y[j] -= L[j][k] * y[k];
      leverage += y[j] * y[j] * L[j][j];
    }
    effect *= x.weight;
    const Four left = there - x.weight * leverage;
    shot += effect * effect * x.a;
    excess += there * (x.r * x.r - left * w.noise2) * x.a;
    power += left * x.a * x.a;
  }
  *out = {total(shot), total(excess), total(power)};
}
