// Quintic B-spline interpolation of eight positions of a row. Included after lanes.inl.
static inline __attribute__((always_inline)) Lanes gather8(const float* p, IntLanes k) {
#if defined(__AVX2__) && !defined(__clang__)  // which has it under another name
  return (Lanes)__builtin_ia32_gathersiv8sf((Lanes){0}, p, (__attribute__((vector_size(32))) int)k,
                                            (Lanes)(IntLanes{-1, -1, -1, -1, -1, -1, -1, -1}), 4);
#else
  return Lanes{p[k[0]], p[k[1]], p[k[2]], p[k[3]], p[k[4]], p[k[5]], p[k[6]], p[k[7]]};
#endif
}

// Quintic B-spline of the row c at x (any sign; |x| < 2^14).
static inline __attribute__((always_inline)) Lanes interpolate8(const float* c, Lanes x) {
  const IntLanes k = __builtin_convertvector(x + 16384.F, IntLanes) - 16384;  // floor
  const Lanes t = x - __builtin_convertvector(k, Lanes), u = 1.F - t, tt = t * t, uu = u * u;
  // 120 beta(2 + t), beta(1 + t), beta(t) and their mirrors: in u = 1 - t and t.
  const Lanes w0 = uu * uu * u, w5 = tt * tt * t;
  const Lanes w1 = 1.F + 5.F * u * (1.F + u * (2.F + u * (2.F + u * (1.F - u))));
  const Lanes w4 = 1.F + 5.F * t * (1.F + t * (2.F + t * (2.F + t * (1.F - t))));
  const Lanes w2 = 66.F + tt * (-60.F + tt * (30.F - 10.F * t)), w3 = 66.F + uu * (-60.F + uu * (30.F - 10.F * u));
  return (w0 * gather8(c - 2, k) + w1 * gather8(c - 1, k) + w2 * gather8(c, k) + w3 * gather8(c + 1, k) +
          w4 * gather8(c + 2, k) + w5 * gather8(c + 3, k)) *
         (1.F / 120);
}
