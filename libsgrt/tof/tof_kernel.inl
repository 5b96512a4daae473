// The loops of time of flight over eight pixels at a time; included in each instruction set's file inside namespaces of
// its own. docs/theory/tof.md.
#include "core/lanes.inl"

typedef unsigned char ByteLanes __attribute__((vector_size(8)));

#define SGRT_INLINE static inline __attribute__((always_inline))

SGRT_INLINE Lanes root8(Lanes v) {
  for (int i = 0; i < 8; ++i) v[i] = __builtin_sqrtf(v[i]);
  return v;
}
SGRT_INLINE Lanes pick8(IntLanes mask, Lanes a, Lanes b) {
  return (Lanes)(((IntLanes)a & mask) | ((IntLanes)b & ~mask));
}
SGRT_INLINE Lanes abs8(Lanes v) {
  return (Lanes)((IntLanes)v & 0x7fffffff);
}
SGRT_INLINE Lanes greater8(Lanes a, Lanes b) {
  return pick8(a > b, a, b);
}
// The first n of eight; a row's end is not passed, for another thread may be writing there.
SGRT_INLINE Lanes get8(const float* p, int n) {
  if (n >= 8) return load8(p);
  Lanes v = {};
  for (int i = 0; i < n; ++i) v[i] = p[i];
  return v;
}
SGRT_INLINE void put8(float* p, Lanes v, int n) {
  if (n >= 8) return store8(p, v);
  for (int i = 0; i < n; ++i) p[i] = v[i];
}
SGRT_INLINE void flag8(std::uint8_t* p, IntLanes bits, int n) {
  const ByteLanes add = __builtin_convertvector(bits, ByteLanes);
  if (n >= 8) {
    ByteLanes old;
    __builtin_memcpy(&old, p, 8);
    old |= add;
    __builtin_memcpy(p, &old, 8);
    return;
  }
  for (int i = 0; i < n; ++i) p[i] = (std::uint8_t)(p[i] | add[i]);
}

// atan2 in [0, 2 pi): Cephes' atanf after one division, right to 2e-7 rad; NaN at the origin.
SGRT_INLINE Lanes angle8(Lanes s, Lanes c) {
  const Lanes as = abs8(s), ac = abs8(c);
  const IntLanes steep = as > ac;
  const Lanes small = pick8(steep, ac, as), large = pick8(steep, as, ac);
  const IntLanes far = small > 0.41421356F * large;  // beyond pi/8: atan(t) = pi/4 + atan((t - 1) / (t + 1))
  const Lanes t = pick8(far, small - large, small) / pick8(far, small + large, large);
  const Lanes z = t * t;
  Lanes a = ((8.05374449538e-2F * z - 1.38776856032e-1F) * z + 1.99777106478e-1F) * z - 3.33329491539e-1F;
  a = a * z * t + t + pick8(far, all(0.78539816F), all(0));
  a = pick8(steep, 1.57079633F - a, a);
  a = pick8(c < 0.F, 3.14159265F - a, a);
  a = pick8(s < 0.F, 6.28318531F - a, a);
  return pick8(a < 6.2831853F, a, pick8(a == a, all(0), a));
}

// chi^2 of what a still scene leaves at 0, above its limit. t, v: the taps and their variances.
SGRT_INLINE IntLanes moved8(const PhasorRow& r, const int taps, const Lanes* t, const Lanes* v, Lanes tolerance) {
  Lanes chi2 = all(0);
  for (int j = 0; j < r.null_count; ++j) {
    Lanes e = all(0), variance = all(0);
    for (int k = 0; k < taps; ++k) {
      const float u = r.null_space[j * taps + k];
      e += u * t[k];
      variance += (u * u) * v[k];
    }
    if (r.null_count == 1) return e * e > r.moved_limit * (variance + tolerance);
    chi2 += e * e / (variance + tolerance);
  }
  return chi2 > all(r.moved_limit);
}

// By value: what is stored cannot then be thought to change the numbers of the row.
SGRT_INLINE void phasor_row_of(const PhasorRow r, const int taps) {
  Lanes t[32], v[32];
  float weight[32][6];
  for (int k = 0; k < taps; ++k) {
    const float b = r.model[3 * k], c = r.model[3 * k + 1], s = r.model[3 * k + 2];
    const float all_six[6] = {b, c, s, c * c, c * s, s * s};
    for (int i = 0; i < 6; ++i) weight[k][i] = all_six[i];
  }
  for (int x = 0; x < r.count; x += 8) {
    const Lanes share = r.share ? load8(r.share + x) : all(1);
    Lanes B = all(0), C = all(0), S = all(0), P = all(0), Q = all(0), R = all(0);
    IntLanes clipped = IntLanes{};
    for (int k = 0; k < taps; ++k) {
      const float* m = weight[k];
      const Lanes seen = load8(r.taps + (long)k * r.stride + x);
      clipped |= ~((seen > all(r.low)) & (seen < all(r.high)));  // NaN too
      t[k] = seen;
      v[k] = (r.gain * greater8(t[k], all(0)) + r.floor) * share;
      B += m[0] * t[k];
      C += m[1] * t[k];
      S += m[2] * t[k];
      P += m[3] * v[k];
      Q += m[4] * v[k];
      R += m[5] * v[k];
    }
    const Lanes A2 = C * C + S * S;
    IntLanes flags = clipped & kSaturated;
    if (r.null_count > 0) flags |= moved8(r, taps, t, v, r.tolerance2 * A2) & ~clipped & kMoved;
    const Lanes variance = (S * S * P - 2 * S * C * Q + C * C * R) / (A2 * A2);
    const int n = r.count - x;
    put8(r.phase + x, angle8(S, C), n);
    put8(r.amplitude + x, root8(A2), n);
    put8(r.offset + x, B, n);
    put8(r.variance + x, r.gain > 0 || r.floor > 0 ? variance : all(__builtin_nanf("")), n);
    flag8(r.flags + x, flags, n);
  }
}

SGRT_INLINE void phasor_row(const PhasorRow& r) {
  if (r.tap_count == 4) return phasor_row_of(r, 4);
  phasor_row_of(r, r.tap_count);
}

SGRT_INLINE void range_row(const RangeRow r) {
  const float inverse = 1 / r.ambiguity;
  for (int x = 0; x < r.count; x += 8) {
    const int n = r.count - x;
    const Lanes first = get8(r.phase + x, n) * r.mm_per_rad;
    // Into [low, low + ambiguity): floor by way of integers, which the window keeps small.
    const Lanes turns = (all(r.low) - first) * inverse;
    Lanes up = __builtin_convertvector(__builtin_convertvector(pick8(turns == turns, turns, all(0)), IntLanes), Lanes);
    up = up + pick8(up < turns, all(1), all(0));
    put8(r.range + x, first + up * r.ambiguity, n);
    put8(r.sigma + x, root8(get8(r.variance + x, n)) * r.mm_per_rad, n);
  }
}

SGRT_INLINE void judge_row(const JudgeRow r) {
  for (int x = 0; x < r.count; x += 8) {
    const int n = r.count - x;
    const Lanes range = get8(r.range + x, n), sigma = get8(r.sigma + x, n), amplitude = get8(r.amplitude + x, n);
    IntLanes dark = ~(amplitude > all(r.min_amplitude)) | ~(range == range);
    if (r.known_sigma) dark |= ~(sigma <= all(r.max_sigma)) | ~(sigma <= all(r.max_phase_sigma_mm));
    const IntLanes outside = (range < all(r.low)) | (range > all(r.high));
    const IntLanes twice = (range + r.ambiguity < all(r.high)) & ~outside;
    IntLanes flags = (dark & kLowAmplitude) | (outside & kOutOfRange) | (twice & kWrapped);
    flag8(r.flags + x, flags, n);
    ByteLanes old = {};
    if (n >= 8) __builtin_memcpy(&old, r.flags + x, 8);
    for (int i = 0; n < 8 && i < n; ++i) old[i] = r.flags[x + i];
    const IntLanes bad = (__builtin_convertvector(old, IntLanes) & kTofRejected) != 0;
    Lanes reach = r.jump_slope * range;
    if (r.known_sigma) reach += r.jump_sigmas * sigma;
    put8(r.reach + x, pick8(bad, all(__builtin_nanf("")), reach), n);
  }
}

// Of two opposite neighbours one lies a jump away and the other does not hold on to the pixel either.
SGRT_INLINE IntLanes between8(Lanes range, Lanes reach, const float* range_a, const float* reach_a,
                              const float* range_b, const float* reach_b) {
  const Lanes da = abs8(range - load8(range_a)), ta = reach + load8(reach_a);
  const Lanes db = abs8(range - load8(range_b)), tb = reach + load8(reach_b);
  return ((da > ta) & ~(db <= tb)) | ((db > tb) & ~(da <= ta));
}

SGRT_INLINE void points_row(const PointsRow r) {
  const IntLanes lane = {0, 1, 2, 3, 4, 5, 6, 7};
  for (int x = 0; x < r.count; x += 8) {
    const Lanes range = load8(r.range + x), reach = load8(r.reach + x);
    const int n = r.count - x;
    IntLanes flying = IntLanes{};
    if (r.count > 2) {
      const IntLanes at = lane + x;
      flying = between8(range, reach, r.range + x - 1, r.reach + x - 1, r.range + x + 1, r.reach + x + 1);
      flying &= (at > 0) & (at < r.count - 1);
    }
    if (r.range_above && r.range_below)
      flying |= between8(range, reach, r.range_above + x, r.reach_above + x, r.range_below + x, r.reach_below + x);
    flag8(r.flags + x, flying & kFlying, n);
    const IntLanes good = (reach == reach) & ~flying;
    const Lanes nothing = all(__builtin_nanf(""));
    for (int i = 0; i < 3; ++i)
      put8(r.point[i] + x, pick8(good, r.centre[i] + range * load8(r.ray[i] + x), nothing), n);
  }
}

#undef SGRT_INLINE
