// IC-GN of one window along a rectified row: 3 parameters over a given curvature, ZNSSD, quintic B-spline along x.
// Baker and Matthews (2004); Pan, Li, Tong (2013). docs/theory/stereo.md eq. 6-11. The mean and the gain of the window
// are projected out of the Jacobian, so [H^-1]_dd is the variance of d with brightness and contrast unknown.
#include "stereo/lanes.inl"
#include "stereo/spline_lanes.inl"

static inline int inside(const Plane& p, float x, int y) {
  return x >= 3 && x < (float)(p.width - 4) && y >= 0 && y < p.height &&
         p.mask[(long)y * p.width + (int)(2 * x + 1) / 2] != 1;
}

void refine_row(const Plane& left, const Plane& right, int x0, int y0, const RefineOptions& options, RowMatch* match) {
  enum { kMaxSide = 41, kMaxPad = 48 };
  const int half = options.half, side = 2 * half + 1, pad = (side + 7) / 8 * 8;
  const IntLanes lane = {0, 1, 2, 3, 4, 5, 6, 7};
  // The reference window: centred grey f and gradient, 0 where masked or padded.
  float f[kMaxSide * kMaxPad], fx[kMaxSide * kMaxPad], keep[kMaxSide * kMaxPad];
  match->correlation = __builtin_nanf("");
  match->texture = match->noise = __builtin_nanf("");

  if (x0 - half < 0 || x0 + half >= left.width || y0 - half < 0 || y0 + half >= left.height ||
      left.mask[(long)(y0 - half) * left.width + x0 - half] == 1 ||
      left.mask[(long)(y0 - half) * left.width + x0 + half] == 1 ||
      left.mask[(long)(y0 + half) * left.width + x0 - half] == 1 ||
      left.mask[(long)(y0 + half) * left.width + x0 + half] == 1) {
    match->outcome = kLeftView;
    return;
  }
  Lanes sum = all(0), count8 = all(0);
  for (int j = 0; j < side; ++j) {
    const long row = (long)(y0 - half + j) * left.width + x0 - half;
    float* k = keep + j * pad;
    for (int i = 0; i < pad; ++i) k[i] = i < side && left.mask[row + (i < side ? i : 0)] == 0 ? 1.F : 0.F;
    for (int i = 0; i < pad; i += 8) {
      const Lanes m = load8(k + i);
      // The padding reads past the window; at the image's end it reads the next row (the planes have a spare one).
      const Lanes g = load8(left.value + row + i) * m;
      store8(f + j * pad + i, g);
      store8(fx + j * pad + i, load8(left.gradient + row + i) * m);
      sum += g;
      count8 += m;
    }
  }
  const float n = total(count8);
  if (n < 0.6F * side * side) {
    match->outcome = kClipped;
    return;
  }
  const float mean = total(sum) / n;
  // H and its projections: v1 = sum fx psi, v2 = sum fx psi f, psi = (1, i, j).
  Lanes ff = all(0), h00 = all(0), h01 = all(0), h02 = all(0), h11 = all(0), h12 = all(0), h22 = all(0);
  Lanes s0 = all(0), s1 = all(0), s2 = all(0), q0 = all(0), q1 = all(0), q2 = all(0);
  for (int j = 0; j < side; ++j) {
    const float y = (float)(j - half);
    for (int i = 0; i < pad; i += 8) {
      const Lanes x = __builtin_convertvector(lane + (i - half), Lanes);
      const Lanes g = load8(fx + j * pad + i);
      const Lanes c = (load8(f + j * pad + i) - mean) * load8(keep + j * pad + i);
      store8(f + j * pad + i, c);
      const Lanes gx = g * x, gy = g * y, gc = g * c;
      ff += c * c;
      h00 += g * g, h01 += g * gx, h02 += g * gy, h11 += gx * gx, h12 += gx * gy, h22 += gy * gy;
      s0 += g, s1 += gx, s2 += gy;
      q0 += gc, q1 += gc * x, q2 += gc * y;
    }
  }
  const float norm_f = __builtin_sqrtf(total(ff));
  if (!(norm_f > 1e-5F * (mean > 0 ? mean : -mean)) || norm_f * norm_f < n * options.min_variance) {
    match->outcome = kFlat;
    return;
  }
  const float q = total(h00), qx = total(h01) / q, qy = total(h02) / q;
  const float across = total(h11) / q - qx * qx, down = total(h22) / q - qy * qy;
  match->spread = (across < down ? across : down) * 12 / (float)(side * side - 1);
  const float v10 = total(s0), v11 = total(s1), v12 = total(s2);
  const float v20 = total(q0) / norm_f, v21 = total(q1) / norm_f, v22 = total(q2) / norm_f;
  const double a00 = total(h00) - v10 * v10 / n - v20 * v20, a01 = total(h01) - v10 * v11 / n - v20 * v21;
  const double a02 = total(h02) - v10 * v12 / n - v20 * v22, a11 = total(h11) - v11 * v11 / n - v21 * v21;
  const double a12 = total(h12) - v11 * v12 / n - v21 * v22, a22 = total(h22) - v12 * v12 / n - v22 * v22;
  // Inverse of the symmetric 3 x 3 by cofactors.
  const double k00 = a11 * a22 - a12 * a12, k01 = a02 * a12 - a01 * a22, k02 = a01 * a12 - a02 * a11;
  const double k11 = a00 * a22 - a02 * a02, k12 = a01 * a02 - a00 * a12, k22 = a00 * a11 - a01 * a01;
  const double det = a00 * k00 + a01 * k01 + a02 * k02;
  if (!(det > 1e-9 * a00 * a11 * a22) || !(k00 > 0)) {
    match->outcome = kFlat;
    return;
  }
  match->texture = (float)(k00 / det);

  // Positions relative to an integer column keep the float's precision.
  const float start = match->d;
  const float c20 = match->c20, c11 = match->c11, c02 = match->c02;
  float s = 1 - match->a, b = match->b, d = match->d;
  float offset = mean;  // of g: the first iteration corrects it, so that the sums do not cancel
  match->outcome = kDiverged;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    const int base = x0 - (int)(d + 16384.F) + 16384;
    const float shift = (float)(x0 - base) - d;
    const float centre = (float)base + shift;
    // The valid part of a plane is convex: four corners decide. The padding may read on (the planes have a spare row).
    const float h = (float)half;
    for (int corner = 0; corner < 4; ++corner) {
      const float i = corner & 1 ? h : -h, j = corner & 2 ? h : -h;
      const float x = centre + s * i - b * j - (c20 * i * i + c11 * i * j + c02 * j * j);
      if (!inside(right, x, y0 + (int)j)) {
        match->outcome = kRightView;
        return;
      }
    }
    Lanes sg = all(0), sgg = all(0), sfg = all(0), r0 = all(0), r1 = all(0), r2 = all(0);
    for (int j = 0; j < side; ++j) {
      const float y = (float)(j - half);
      const float* c = right.coefficient + (long)(y0 - half + j) * right.width + base;
      const float from = shift - (b + c02 * y) * y, slope = s - c11 * y;
      Lanes rg = all(0);
      for (int i = 0; i < pad; i += 8) {
        const Lanes x = __builtin_convertvector(lane + (i - half), Lanes);
        const Lanes g = (interpolate8(c, x * (slope - c20 * x) + from) - offset) * load8(keep + j * pad + i);
        const Lanes gf = g * load8(fx + j * pad + i);
        sg += g, sgg += g * g, sfg += g * load8(f + j * pad + i);
        rg += gf, r1 += gf * x;
      }
      r0 += rg, r2 += rg * y;
    }
    const float mean_g = total(sg) / n;
    const float norm2 = total(sgg) - n * mean_g * mean_g;
    offset += mean_g;
    if (!(norm2 > 1e-10F * n * offset * offset) || !(norm2 > 0)) {
      match->outcome = kFlat;
      return;
    }
    const float kappa = norm_f / __builtin_sqrtf(norm2);
    const float zncc = total(sfg) / norm_f * (kappa / norm_f);
    const float along = norm_f * zncc;  // f~ . (kappa g)
    const double e0 = kappa * (total(r0) - mean_g * v10) - v20 * along;
    const double e1 = kappa * (total(r1) - mean_g * v11) - v21 * along;
    const double e2 = kappa * (total(r2) - mean_g * v12) - v22 * along;
    const float dd = (float)((k00 * e0 + k01 * e1 + k02 * e2) / det);
    const float da = (float)((k01 * e0 + k11 * e1 + k12 * e2) / det);
    const float db = (float)((k02 * e0 + k12 * e1 + k22 * e2) / det);
    match->correlation = zncc;
    // f~ and g~ explain each other's gain; what is left is noise: |f - proj|^2 = |f|^2 (1 - zncc^2), over zncc for
    // both.
    match->noise = 2 * norm_f * norm_f * (1 - zncc) / (n - 5);
    // Inverse compositional update: W(p) <- W(p) o W(dp)^-1.
    const float s_new = s / (1 + da);
    b += s_new * db;
    d += s_new * dd;
    s = s_new;
    const float moved = d - start;
    if (!(s > 0.3F && s < 3 && b > -2 && b < 2) || !(moved < options.max_move && moved > -options.max_move)) return;
    const float ad = dd > 0 ? dd : -dd, aa = (da > 0 ? da : -da) * (float)half, ab = (db > 0 ? db : -db) * (float)half;
    match->d = d, match->a = 1 - s, match->b = b;
    if (ad < 2e-3F && aa < 1e-2F && ab < 1e-2F) {
      match->outcome = kConverged;
      return;
    }
  }
}
