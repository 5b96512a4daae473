// The pass over live points, eight at a time; included in each instruction set's file inside namespaces of its own.
#include "core/lanes.inl"

typedef float Lanes4 __attribute__((vector_size(16)));

static inline __attribute__((always_inline)) Lanes root8(Lanes v) {
  for (int i = 0; i < 8; ++i) v[i] = __builtin_sqrtf(v[i]);
  return v;
}
static inline __attribute__((always_inline)) Lanes pick8(IntLanes mask, Lanes a, Lanes b) {
  return mask ? a : b;
}
static inline __attribute__((always_inline)) IntLanes cell8(Lanes x, float low, float inverse, float last) {
  Lanes f = (x - all(low)) * all(inverse);
  f = pick8(f > all(0), f, all(0));
  f = pick8(f < all(last), f, all(last));
  return __builtin_convertvector(f, IntLanes);
}

// The surfel of a voxel at the finest of the levels that has one: level << 27 | surfel, or -1.
static inline int32_t find_surfel(const Pass* p, uint32_t ix, uint32_t iy, uint32_t iz, const Surfel** found) {
  for (int k = 0; k < p->level_count; ++k) {
    const LevelView* level = &p->level[k];
    const int up = p->first + k;
    const uint32_t key = ix >> up | (iy >> up) << kKeyBitsX | (iz >> up) << (kKeyBitsX + kKeyBitsY);
    uint32_t at = (((key >> 3) * 0x9E3779B1u) >> level->shift << 3 | (key & 7)) & level->mask;
    for (; level->slots[at].key != kNoKey; at = (at + 1) & level->mask) {
      if (level->slots[at].key != key) continue;
      *found = &level->surfels[level->slots[at].surfel];
      return (int32_t)(up << 27) | level->slots[at].surfel;
    }
  }
  *found = &p->level[0].surfels[0];
  return -1;
}

// Eight surfels, member by member: two transpositions of 8 x 8.
static inline __attribute__((always_inline)) void transpose8(const float* const* rows, int from, Lanes* out) {
  Lanes a[8], b[8];
  for (int i = 0; i < 8; ++i) a[i] = load8(rows[i] + from);
  for (int i = 0; i < 4; ++i) {
    b[2 * i] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    b[2 * i + 1] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (int i = 0; i < 2; ++i) {
    a[4 * i] = __builtin_shufflevector(b[4 * i], b[4 * i + 2], 0, 1, 8, 9, 4, 5, 12, 13);
    a[4 * i + 1] = __builtin_shufflevector(b[4 * i], b[4 * i + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    a[4 * i + 2] = __builtin_shufflevector(b[4 * i + 1], b[4 * i + 3], 0, 1, 8, 9, 4, 5, 12, 13);
    a[4 * i + 3] = __builtin_shufflevector(b[4 * i + 1], b[4 * i + 3], 2, 3, 10, 11, 6, 7, 14, 15);
  }
  for (int i = 0; i < 4; ++i) {
    out[i] = __builtin_shufflevector(a[i], a[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    out[i + 4] = __builtin_shufflevector(a[i], a[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

static inline __attribute__((always_inline)) Lanes row_of(const float* R, Lanes x, Lanes y, Lanes z) {
  return all(R[0]) * x + all(R[1]) * y + all(R[2]) * z;
}

// Adds up eight points: weight W for the sums, residual r, J = (y cross n / lever, n).
static inline __attribute__((always_inline)) void add8(const Pass* p, const Lanes* y, const Lanes* n, Lanes W, Lanes r,
                                                       Lanes* sum) {
  const Lanes s = all(p->inverse_lever);
  const Lanes j[6] = {(y[1] * n[2] - y[2] * n[1]) * s,
                      (y[2] * n[0] - y[0] * n[2]) * s,
                      (y[0] * n[1] - y[1] * n[0]) * s,
                      n[0],
                      n[1],
                      n[2]};
  int at = 0;
  for (int a = 0; a < 6; ++a) {
    const Lanes w = W * j[a];
    for (int b = a; b < 6; ++b) sum[at++] += w * j[b];
    sum[21 + a] += w * r;
  }
}

static inline __attribute__((always_inline)) void eight(const Pass* p, long i, Lanes* sum) {
  const Lanes x = load8(p->x + i), yy = load8(p->y + i), z = load8(p->z + i);
  const Lanes y[3] = {row_of(p->R, x, yy, z) + all(p->t[0]), row_of(p->R + 3, x, yy, z) + all(p->t[1]),
                      row_of(p->R + 6, x, yy, z) + all(p->t[2])};
  const IntLanes ix = cell8(y[0], p->low[0], p->inverse_cell, 2047), iy = cell8(y[1], p->low[1], p->inverse_cell, 2047),
                 iz = cell8(y[2], p->low[2], p->inverse_cell, 1023);
  const Surfel* surfel[8];
  int32_t index[8];
  for (int k = 0; k < 8; ++k) index[k] = find_surfel(p, (uint32_t)ix[k], (uint32_t)iy[k], (uint32_t)iz[k], &surfel[k]);
  const float* rows[8];
  for (int k = 0; k < 8; ++k) rows[k] = surfel[k]->q;
  Lanes s[16];
  transpose8(rows, 0, s);
  transpose8(rows, 8, s + 8);

  // r = n.d - d K d / 2 over the length of its gradient n - K d (eq. 1, 2).
  const Lanes d[3] = {y[0] - s[0], y[1] - s[1], y[2] - s[2]};
  const Lanes kd[3] = {s[6] * d[0] + s[7] * d[1] + s[8] * d[2], s[7] * d[0] + s[9] * d[1] + s[10] * d[2],
                       s[8] * d[0] + s[10] * d[1] + s[11] * d[2]};
  const Lanes along = s[3] * d[0] + s[4] * d[1] + s[5] * d[2];
  const Lanes length = all(1) / root8(all(1) + kd[0] * kd[0] + kd[1] * kd[1] + kd[2] * kd[2]);
  const Lanes r = (along - all(0.5f) * (kd[0] * d[0] + kd[1] * d[1] + kd[2] * d[2])) * length;
  const Lanes n[3] = {(s[3] - kd[0]) * length, (s[4] - kd[1]) * length, (s[5] - kd[2]) * length};
  const Lanes across2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - along * along;
  const IntLanes found = (across2 <= s[14]);
  const IntLanes counted = s[15] > all(0);
  IntLanes good = found & counted & (r <= all(p->limit)) & (r >= all(-p->limit));
  const Lanes one = all(1), zero = all(0);
  sum[32] += pick8(counted, one, zero);
  if (p->nx) {
    const Lanes lx = load8(p->nx + i), ly = load8(p->ny + i), lz = load8(p->nz + i);
    Lanes cosine =
        row_of(p->R, lx, ly, lz) * n[0] + row_of(p->R + 3, lx, ly, lz) * n[1] + row_of(p->R + 6, lx, ly, lz) * n[2];
    if (p->signs_unsure) cosine = pick8(cosine < zero, -cosine, cosine);
    sum[33] += pick8(good & (cosine <= all(-p->min_cos)), one, zero);
    good = good & (cosine >= all(p->min_cos));
  }

  const Lanes v_live = p->v ? load8(p->v + i) : all(p->v_all);
  const Lanes inverse_noise = one / (v_live + s[13]);
  const Lanes u2 = r * r * inverse_noise;
  Lanes w;
  if (p->given) {
    w = load8(p->given + i);
  } else {
    Lanes t = (root8(u2 * all(p->inverse_scale2)) - all(p->flat)) * all(p->inverse_width);
    t = pick8(t > zero, t, zero);
    const Lanes fall = one - t * t;
    w = pick8(t < one, fall * fall, zero);
  }
  w = pick8(good, w, zero);
  const Lanes inverse_v = one / (v_live + s[12]);
  const Lanes W = p->score ? w * w * v_live * inverse_v * inverse_v : w * inverse_v;
  const Lanes r0 = pick8(good, r, zero);
  add8(p, y, n, W, r0, sum);
  sum[27] += W * r0 * r0;
  sum[28] += w * pick8(good, u2, zero);
  sum[29] += w;
  sum[30] += w * r0 * r0;
  sum[31] += pick8(w > zero, one, zero);
  if (p->r_out) store8(p->r_out + i, pick8(found, r, all(__builtin_nanf(""))));
  if (p->w_out) store8(p->w_out + i, w);
  if (p->surfel_out) {
    for (int k = 0; k < 8; ++k) p->surfel_out[i + k] = index[k];
  }
}

static inline void pass_over(const Pass* p, long begin, long end, PassSums* out) {
  Lanes sum[34];
  for (int k = 0; k < 34; ++k) sum[k] = all(0);
  for (long i = begin; i < end; i += 8) eight(p, i, sum);
  for (int k = 0; k < 21; ++k) out->a[k] = total(sum[k]);
  for (int k = 0; k < 6; ++k) out->g[k] = total(sum[21 + k]);
  out->cost = total(sum[27]);
  out->chi = total(sum[28]);
  out->weight = total(sum[29]);
  out->square = total(sum[30]);
  out->pairs = total(sum[31]);
  out->candidates = total(sum[32]);
  out->flipped = total(sum[33]);
}
