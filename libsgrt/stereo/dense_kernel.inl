// One Gauss-Newton step of many windows at once. All windows share one warp of the right image, so that a pixel is
// interpolated once and not once a window; sums over columns of a window, then over rows, give each its normal
// equations. The warp's own shape drops out of the answer to first order. docs/theory/stereo.md eq. 12-13.
#include "core/lanes.inl"
#include "stereo/spline_lanes.inl"

void warp_row(const WarpRow& r) {
  for (int x = 0; x < r.width; x += 8) {
    const Lanes shift = load8(r.shift + x);
    const Lanes at = Lanes{0, 1, 2, 3, 4, 5, 6, 7} + (float)x - shift;
    IntLanes good = (at >= 3.F) & (at < (float)(r.right_width - 4));  // false for NaN
    const IntLanes k = __builtin_convertvector((Lanes)((IntLanes)(at + 0.5F) & good), IntLanes);
    for (int l = 0; l < 8; ++l)
      if (x + l >= r.width || r.mask[k[l]] != 0 || r.left_mask[x + l] != 0) good[l] = 0;
    const Lanes g = interpolate8(r.coefficient, (Lanes)(((IntLanes)at & good) | ((IntLanes)all(3) & ~good)));
    store8(r.g + x, (Lanes)((IntLanes)g & good));
    store8(r.d + x, (Lanes)((IntLanes)(shift - r.origin) & good));
    store8(r.keep + x, (Lanes)((IntLanes)all(1) & good));
  }
}

// The sums over one column of a window, weighted by powers of j, lie as kColumn floats a column: those that are then
// also weighted by powers of i come first.
enum {
  kQ0,
  kQ1,
  kX0,
  kC0,
  kQ2,
  kX1,
  kC1,
  kE0,  // fx fx, fx, f fx, fx g
  kF0,
  kQ3,
  kX2,
  kC2,
  kE1,
  kF1,
  kN,
  kXD,  // fx fx d; fx d
  kSf,
  kSg,
  kFF,
  kGG,
  kFG,
  kCD,  // f fx d
  kColumn = 24
};
enum { kTile = 128, kMaxHalf = 20 };

// f and g less these: sums of squares of what is nearly constant would cancel.
struct Level {
  float f, g;
};

static inline Level level_of(const DensePlanes& p, int y0, int left, int right) {
  const int from = left < 0 ? 0 : left, to = right >= p.width ? p.width - 1 : right;
  float f = 0, g = 0, n = 0;
  for (int x = from; x <= to; ++x) {
    const float keep = p.keep[(long)y0 * p.stride + x];
    f += p.f[(long)y0 * p.width + x] * keep, g += p.g[(long)y0 * p.stride + x] * keep, n += keep;
  }
  return n > 0 ? Level{f / n, g / n} : Level{0, 0};
}

static inline void column_sums(const DensePlanes& p, const Level& level, int y0, int half, int x, float* out) {
  const int from = y0 - half < 0 ? -y0 : -half, to = y0 + half >= p.height ? p.height - 1 - y0 : half;
  Lanes s[kColumn];
  {
    Lanes q0 = all(0), q1 = all(0), q2 = all(0), q3 = all(0), x0 = all(0), x1 = all(0), x2 = all(0);
    Lanes c0 = all(0), c1 = all(0), c2 = all(0);
    for (int j = from; j <= to; ++j) {
      const long at = (long)(y0 + j) * p.width + x, to_warp = (long)(y0 + j) * p.stride + x;
      const float y = (float)j;
      const Lanes fx = load8(p.fx + at) * load8(p.keep + to_warp), f = load8(p.f + at) - level.f;
      const Lanes q = fx * fx, qy = q * y, qyy = qy * y, c = f * fx, cy = c * y, xy = fx * y;
      q0 += q, q1 += qy, q2 += qyy, q3 += qyy * y;
      x0 += fx, x1 += xy, x2 += xy * y;
      c0 += c, c1 += cy, c2 += cy * y;
    }
    s[kQ0] = q0, s[kQ1] = q1, s[kQ2] = q2, s[kQ3] = q3, s[kX0] = x0, s[kX1] = x1, s[kX2] = x2;
    s[kC0] = c0, s[kC1] = c1, s[kC2] = c2;
  }
  {
    Lanes e0 = all(0), e1 = all(0), f0 = all(0), f1 = all(0), xd = all(0), cd = all(0);
    for (int j = from; j <= to; ++j) {
      const long at = (long)(y0 + j) * p.width + x, to_warp = (long)(y0 + j) * p.stride + x;
      const float y = (float)j;
      const Lanes fx = load8(p.fx + at) * load8(p.keep + to_warp), f = load8(p.f + at) - level.f;
      const Lanes e = fx * (load8(p.g + to_warp) - level.g), d = fx * load8(p.d + to_warp), q = fx * d;
      e0 += e, e1 += e * y, f0 += q, f1 += q * y, xd += d, cd += f * d;
    }
    s[kE0] = e0, s[kE1] = e1, s[kF0] = f0, s[kF1] = f1, s[kXD] = xd, s[kCD] = cd;
  }
  {
    Lanes n = all(0), sf = all(0), sg = all(0), ff = all(0), gg = all(0), fg = all(0);
    for (int j = from; j <= to; ++j) {
      const long at = (long)(y0 + j) * p.width + x, to_warp = (long)(y0 + j) * p.stride + x;
      const Lanes keep = load8(p.keep + to_warp);
      const Lanes f = (load8(p.f + at) - level.f) * keep, g = (load8(p.g + to_warp) - level.g) * keep;
      n += keep, sf += f, sg += g, ff += f * f, gg += g * g, fg += f * g;
    }
    s[kN] = n, s[kSf] = sf, s[kSg] = sg, s[kFF] = ff, s[kGG] = gg, s[kFG] = fg;
  }
  s[22] = s[23] = all(0);
  for (int k = 0; k < kColumn; ++k)
    for (int l = 0; l < 8; ++l) out[l * kColumn + k] = s[k][l];
}

// The moments of one window.
struct WindowSums {
  float by[4][8];    // kQ0 ... kE0, by i^0 ... i^3
  float more[2][8];  // kF0 ... kXD, by i^0, i^1
  float rest[8];     // kSf ...
};

static inline void window_sums(const float* columns, int half, WindowSums* w) {
  Lanes a0 = all(0), a1 = all(0), a2 = all(0), a3 = all(0), b0 = all(0), b1 = all(0), c0 = all(0);
  for (int i = -half; i <= half; ++i, columns += kColumn) {
    const float x = (float)i;
    const Lanes a = load8(columns), b = load8(columns + 8), ax = a * x, axx = ax * x;
    a0 += a, a1 += ax, a2 += axx, a3 += axx * x;
    b0 += b, b1 += b * x;
    c0 += load8(columns + 16);
  }
  store8(w->by[0], a0), store8(w->by[1], a1), store8(w->by[2], a2), store8(w->by[3], a3);
  store8(w->more[0], b0), store8(w->more[1], b1), store8(w->rest, c0);
}

static inline void solve_window(const WindowSums& w, float area, const DenseOptions& options, RowMatch* m) {
  enum { kF = kF0 - 8 };
  const float* s = w.by[0];
  const float *t = w.more[0], *u = w.rest;
  m->correlation = m->texture = m->noise = __builtin_nanf("");
  const double n = t[kN - 8];
  if (n < 0.3 * area) {
    m->outcome = kClipped;
    return;
  }
  const double sf = u[kSf - 16], sg = u[kSg - 16], mean_f = sf / n, mean_g = sg / n;
  const double ff = u[kFF - 16] - sf * mean_f, gg = u[kGG - 16] - sg * mean_g, fg = u[kFG - 16] - sf * mean_g;
  if (!(ff > n * options.min_variance) || !(gg > 1e-6 * ff)) {
    m->outcome = kFlat;
    return;
  }
  const double norm = __builtin_sqrt(ff), kappa = __builtin_sqrt(ff / gg), zncc = fg / (norm * norm) * kappa;
  // v1 = sum fx psi, v2 = sum f~ fx psi, psi = (1, i, j).
  const double v1[3] = {s[kX0], w.by[1][kX0], s[kX1]};
  const double v2[3] = {(s[kC0] - mean_f * v1[0]) / norm, (w.by[1][kC0] - mean_f * v1[1]) / norm,
                        (s[kC1] - mean_f * v1[2]) / norm};
  const double qx = w.by[1][kQ0] / (double)s[kQ0], qy = s[kQ1] / (double)s[kQ0];
  const double across = w.by[2][kQ0] / (double)s[kQ0] - qx * qx, down = s[kQ2] / (double)s[kQ0] - qy * qy;
  // A window that the image's rim cuts is so much narrower.
  const double cut = n < area ? n / area : 1;
  m->spread = (float)((across < down ? across : down) * 12 / ((area - 1) * (cut > 0.5 ? cut * cut : 0.25)));
  const double h00 = s[kQ0] - v1[0] * v1[0] / n - v2[0] * v2[0];
  const double h01 = w.by[1][kQ0] - v1[0] * v1[1] / n - v2[0] * v2[1];
  const double h02 = s[kQ1] - v1[0] * v1[2] / n - v2[0] * v2[2];
  const double h11 = w.by[2][kQ0] - v1[1] * v1[1] / n - v2[1] * v2[1];
  const double h12 = w.by[1][kQ1] - v1[1] * v1[2] / n - v2[1] * v2[2];
  const double h22 = s[kQ2] - v1[2] * v1[2] / n - v2[2] * v2[2];
  const double k00 = h11 * h22 - h12 * h12, k01 = h02 * h12 - h01 * h22, k02 = h01 * h12 - h02 * h11;
  const double k11 = h00 * h22 - h02 * h02, k12 = h01 * h02 - h00 * h12, k22 = h00 * h11 - h01 * h01;
  const double det = h00 * k00 + h01 * k01 + h02 * k02;
  if (!(det > 1e-9 * h00 * h11 * h22) || !(k00 > 0)) {
    m->outcome = kFlat;
    return;
  }
  // What the projected Jacobian makes of a field q: sum fx^2 q psi - v1 sum fx q / n - v2 sum f~ fx q.
  const double along = kappa * fg / norm;
  const double d1 = t[kXD - 8] / n, d2 = (u[kCD - 16] - mean_f * t[kXD - 8]) / norm;
  const double e0 = kappa * (s[kE0] - mean_g * v1[0]) - v2[0] * along + t[kF] - v1[0] * d1 - v2[0] * d2;
  const double e1 = kappa * (w.by[1][kE0] - mean_g * v1[1]) - v2[1] * along + w.more[1][kF] - v1[1] * d1 - v2[1] * d2;
  const double e2 = kappa * (t[kE1 - 8] - mean_g * v1[2]) - v2[2] * along + t[kF1 - 8] - v1[2] * d1 - v2[2] * d2;
  const auto weight = [&](double q0, double q1, double q2, double x, double c) {
    const double y1 = x / n, y2 = (c - mean_f * x) / norm;
    q0 -= v1[0] * y1 + v2[0] * y2, q1 -= v1[1] * y1 + v2[1] * y2, q2 -= v1[2] * y1 + v2[2] * y2;
    return (float)((k00 * q0 + k01 * q1 + k02 * q2) / det);
  };
  m->w20 = weight(w.by[2][kQ0], w.by[3][kQ0], w.by[2][kQ1], w.by[2][kX0], w.by[2][kC0]);
  m->w11 = weight(w.by[1][kQ1], w.by[2][kQ1], w.by[1][kQ2], w.by[1][kX1], w.by[1][kC1]);
  m->w02 = weight(s[kQ2], w.by[1][kQ2], t[kQ3 - 8], t[kX2 - 8], t[kC2 - 8]);
  m->d = (float)((k00 * e0 + k01 * e1 + k02 * e2) / det);
  m->a = (float)((k01 * e0 + k11 * e1 + k12 * e2) / det);
  m->b = (float)((k02 * e0 + k12 * e1 + k22 * e2) / det);
  m->correlation = (float)zncc;
  m->texture = (float)(k00 / det);
  m->noise = (float)(2 * ff * (1 - zncc) / (n - 5));
  m->outcome = kConverged;
}

void dense_row(const DensePlanes& p, int y0, int x_first, int stride, int count, const DenseOptions& options,
               RowMatch* matches) {
  float columns[(kTile + 2 * kMaxHalf + 16) * kColumn];
  const int half = options.half, side = 2 * half + 1, per_tile = 1 + (kTile - 1) / stride;
  for (int first = 0; first < count; first += per_tile) {
    const int last = first + per_tile < count ? first + per_tile - 1 : count - 1;
    const int left = x_first + first * stride - half, right = x_first + last * stride + half;
    int any = options.wanted == nullptr;
    for (int k = first; k <= last && !any; ++k) any = options.wanted[k];
    if (!any) continue;
    const Level level = level_of(p, y0, left, right);
    for (int x = left; x <= right; x += 8) {
      float* out = columns + (long)(x - left) * kColumn;
      if (x >= 0 && x + 8 <= p.width) {
        column_sums(p, level, y0, half, x, out);
        continue;
      }
      for (int l = 0; l < 8 * kColumn; ++l) out[l] = 0;
      if (x + 8 <= 0 || x >= p.width) continue;
      float part[8 * kColumn];  // columns that lie partly beside the image: from whole ones inside it
      const int at = x < 0 ? 0 : p.width - 8;
      column_sums(p, level, y0, half, at, part);
      for (int l = 0; l < 8; ++l)
        if (x + l >= at && x + l < at + 8)
          for (int k = 0; k < kColumn; ++k) out[l * kColumn + k] = part[(x + l - at) * kColumn + k];
    }
    for (int k = first; k <= last; ++k) {
      if (options.wanted != nullptr && !options.wanted[k]) continue;
      WindowSums sums;
      window_sums(columns + (long)((k - first) * stride) * kColumn, half, &sums);
      solve_window(sums, (float)(side * side), options, matches + k);
    }
  }
}
