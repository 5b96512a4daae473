// Peak, centroid and widths of one line, see kernels.hpp; docs/theory/laser.md eq. 1-3 and 9. One pass over the line
// for the maxima of its blocks; the rest looks at a few of them only.
typedef unsigned char Bytes __attribute__((vector_size(32)));
typedef float Floats __attribute__((vector_size(32)));
typedef unsigned long long Words __attribute__((vector_size(32)));

template <class T>
struct Vector;
template <>
struct Vector<unsigned char> {
  typedef Bytes Type;
  typedef int Sum;  // exact
  static constexpr unsigned char kLeast = 0;
};
template <>
struct Vector<float> {
  typedef Floats Type;
  typedef float Sum;
  static constexpr float kLeast = -3e38F;
};

template <class T>
static inline __attribute__((always_inline)) typename Vector<T>::Type load(const T* p) {
  typename Vector<T>::Type v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}

// The largest lane, by halves.
static inline __attribute__((always_inline)) unsigned char top_of(Bytes m) {
  typedef unsigned char Half __attribute__((vector_size(16)));
  Half a, b;
  __builtin_memcpy(&a, &m, sizeof a);
  __builtin_memcpy(&b, reinterpret_cast<const char*>(&m) + sizeof a, sizeof b);
  a = b > a ? b : a;
  b = __builtin_shufflevector(a, a, 8, 9, 10, 11, 12, 13, 14, 15, 8, 9, 10, 11, 12, 13, 14, 15);
  a = b > a ? b : a;
  b = __builtin_shufflevector(a, a, 4, 5, 6, 7, 4, 5, 6, 7, 4, 5, 6, 7, 4, 5, 6, 7);
  a = b > a ? b : a;
  b = __builtin_shufflevector(a, a, 2, 3, 2, 3, 2, 3, 2, 3, 2, 3, 2, 3, 2, 3, 2, 3);
  a = b > a ? b : a;
  return a[1] > a[0] ? a[1] : a[0];
}
static inline __attribute__((always_inline)) float top_of(Floats m) {
  float best = m[0];
  for (int i = 1; i < 8; ++i) best = m[i] > best ? m[i] : best;
  return best;
}

template <class T>
static inline __attribute__((always_inline)) int first_at(const T* p, int n, T value) {
  constexpr int lanes = 32 / static_cast<int>(sizeof(T));
  typename Vector<T>::Type wanted;
  for (int i = 0; i < lanes; ++i) wanted[i] = value;
  int i = 0;
  for (; i + 4 * lanes <= n; i += 4 * lanes) {
    const auto equal = ((load(p + i) == wanted) | (load(p + i + lanes) == wanted)) |
                       ((load(p + i + 2 * lanes) == wanted) | (load(p + i + 3 * lanes) == wanted));
    Words w;
    __builtin_memcpy(&w, &equal, sizeof w);
    if ((w[0] | w[1]) | (w[2] | w[3])) break;
  }
  for (; i + lanes <= n; i += lanes) {
    const auto equal = load(p + i) == wanted;
    Words w;
    __builtin_memcpy(&w, &equal, sizeof w);
    for (int k = 0; k < 4; ++k) {
      if (w[k]) return i + (64 * k + __builtin_ctzll(w[k])) / (8 * static_cast<int>(sizeof(T)));
    }
  }
  while (i < n - 1 && p[i] != value) ++i;
  return i;
}

// The maxima of a line's blocks, lane by lane; what is left over at its end as one number.
template <class T>
struct Blocks {
  static constexpr int kLanes = 32 / static_cast<int>(sizeof(T)), kMost = 32;
  typename Vector<T>::Type top[kMost];
  int count, size, tail;  // blocks; pixels in each; where the rest starts
  T tail_top;
};

template <class T>
static inline __attribute__((always_inline)) T largest(const T* p, int n) {
  T best = Vector<T>::kLeast;
  for (int i = 0; i < n; ++i) best = p[i] > best ? p[i] : best;
  return best;
}

template <class T>
static inline __attribute__((always_inline)) void fill(const T* p, int width, Blocks<T>* out) {
  constexpr int lanes = Blocks<T>::kLanes, kAhead = 2560 / static_cast<int>(sizeof(T));
  const int vectors = width / lanes, share = (vectors + Blocks<T>::kMost - 1) / Blocks<T>::kMost;
  const int each = share > 4 ? share : 4;
  out->count = vectors / each;
  out->size = each * lanes;
  out->top[0] = typename Vector<T>::Type{};
  for (int b = 0; b < out->count; ++b) {
    const T* at = p + b * out->size;
    // The line after next, where lines follow each other: the centroid would keep the memory waiting.
    for (int i = 0; i < each; i += 2) __builtin_prefetch(at + kAhead + i * lanes);
    auto m = load(at), other = load(at + lanes);
    int i = 2;
    for (; i + 2 <= each; i += 2) {
      const auto v = load(at + i * lanes), w = load(at + (i + 1) * lanes);
      m = v > m ? v : m;
      other = w > other ? w : other;
    }
    if (i < each) {
      const auto v = load(at + i * lanes);
      m = v > m ? v : m;
    }
    out->top[b] = other > m ? other : m;
  }
  out->tail = out->count * out->size;
  out->tail_top = largest(p + out->tail, width - out->tail);
}

template <class V>
static inline __attribute__((always_inline)) bool any(V equal) {
  Words w;
  __builtin_memcpy(&w, &equal, sizeof w);
  return ((w[0] | w[1]) | (w[2] | w[3])) != 0;
}

template <class T>
static inline __attribute__((always_inline)) T top_of(const Blocks<T>& b) {
  if (b.count == 0) return b.tail_top;
  auto m = b.top[0];
  for (int i = 1; i < b.count; ++i) m = b.top[i] > m ? b.top[i] : m;
  const T top = top_of(m);
  return b.tail_top > top ? b.tail_top : top;
}

template <class T>
static inline __attribute__((always_inline)) int place_of(const Blocks<T>& b, const T* p, int width, T value) {
  typename Vector<T>::Type wanted;
  for (int i = 0; i < Blocks<T>::kLanes; ++i) wanted[i] = value;
  int block = 0;
  while (block < b.count && !any(b.top[block] == wanted)) ++block;
  const int from = block * b.size;
  return from + first_at(p + from, block < b.count ? b.size : width - from, value);
}

// The largest of [0, left) and [right, width): whole blocks, and vectors that may reach back into blocks already seen.
template <class T>
static inline __attribute__((always_inline)) T top_outside(const Blocks<T>& b, const T* p, int width, int left,
                                                           int right) {
  constexpr int lanes = Blocks<T>::kLanes;
  typename Vector<T>::Type m;
  for (int i = 0; i < lanes; ++i) m[i] = Vector<T>::kLeast;
  T rest = Vector<T>::kLeast;
  const int whole = left > 0 ? (left < b.tail ? left : b.tail) / b.size : 0;
  for (int i = 0; i < whole; ++i) m = b.top[i] > m ? b.top[i] : m;
  int at = left;
  for (; at > whole * b.size && at >= lanes; at -= lanes) {
    const auto v = load(p + at - lanes);
    m = v > m ? v : m;
  }
  for (int i = whole * b.size; i < at; ++i) rest = p[i] > rest ? p[i] : rest;
  const int next = (right + b.size - 1) / b.size;
  for (int i = next; i < b.count; ++i) m = b.top[i] > m ? b.top[i] : m;
  const bool inside = next < b.count + 1 && right <= b.tail;  // the rest lies wholly outside
  if (inside) rest = b.tail_top > rest ? b.tail_top : rest;
  const int end = inside ? next * b.size : width;
  for (at = right; at < end && at + lanes <= width; at += lanes) {
    const auto v = load(p + at);
    m = v > m ? v : m;
  }
  for (; at < end && at < width; ++at) rest = p[at] > rest ? p[at] : rest;
  const T top = top_of(m);
  return rest > top ? rest : top;
}

template <class T>
static inline __attribute__((always_inline)) typename Vector<T>::Sum sum_of(const T* p, int n) {
  typename Vector<T>::Sum sum = 0;
  for (int i = 0; i < n; ++i) sum += p[i];
  return sum;
}

// The centroid about `at` of a window that moves with it (eq. 2), from sums over whole pixels and the two at its
// borders, which it holds by a share.
template <class T>
static inline __attribute__((always_inline)) float centroid(const T* p, int at, int half, float level, float slope,
                                                            float* signal) {
  constexpr int kPasses = 3;
  typedef typename Vector<T>::Sum Sum;
  const float n = static_cast<float>(2 * half + 1);
  const float squares = static_cast<float>(half * (half + 1) * (2 * half + 1)) / 3;
  float centre = 0, base0 = 0, base1 = 0, under = level;
  int k = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    const float limit = static_cast<float>(half) - 0.5F;
    if (!(centre > -limit && centre < limit)) return __builtin_nanf("");
    const float from = centre - static_cast<float>(k);
    if (pass == 0 || from < -1 || from > 1) {
      const float rounded = centre + static_cast<float>(half) + 0.5F;
      k = static_cast<int>(rounded) - half;
      Sum s0 = 0, s1 = 0;
      for (int j = -half; j <= half; ++j) {
        const Sum v = p[at + k + j];
        s0 += v;
        s1 += v * static_cast<Sum>(j);
      }
      under = level + slope * static_cast<float>(k);
      base0 = static_cast<float>(s0) - n * under;
      base1 = static_cast<float>(s1) - slope * squares;
    }
    const float shift = centre - static_cast<float>(k);
    const int side = shift < 0 ? -1 : 1, in = side * (half + 1), out = -side * half;
    const float share = shift < 0 ? -shift : shift;
    const float gained = share * (static_cast<float>(p[at + k + in]) - under - slope * static_cast<float>(in));
    const float lost = share * (static_cast<float>(p[at + k + out]) - under - slope * static_cast<float>(out));
    const float s0 = base0 + gained - lost;
    const float s1 = base1 + gained * static_cast<float>(in) - lost * static_cast<float>(out);
    *signal = s0;
    if (!(s0 > 0)) return __builtin_nanf("");
    centre = static_cast<float>(k) + s1 / s0;
  }
  return static_cast<float>(at) + centre;
}

// How many pixels from `at` in steps of 1 or -1 the first lies that is not above `level`; most + 1 where none of
// `most`.
template <class T>
static inline __attribute__((always_inline)) int fall(const T* p, int at, int step, int most, float level, bool) {
  int i = 1;
  while (i <= most && static_cast<float>(p[at + i * step]) > level) ++i;
  return i;
}
// Eight bytes at once where there is room for them: a walk costs a mispredicted branch for each flank.
static inline __attribute__((always_inline)) int fall(const unsigned char* p, int at, int step, int most, float level,
                                                      bool room) {
  if (!room) return fall<unsigned char>(p, at, step, most, level, room);
  typedef unsigned char Eight __attribute__((vector_size(8)));
  const unsigned char limit = static_cast<unsigned char>(level);
  const Eight limits = {limit, limit, limit, limit, limit, limit, limit, limit};
  Eight v;
  __builtin_memcpy(&v, p + (step > 0 ? at + 1 : at - 8), sizeof v);
  const auto low = v <= limits;
  unsigned long long bits;
  __builtin_memcpy(&bits, &low, sizeof bits);
  if (bits == 0) return fall<unsigned char>(p, at, step, most, level, room);
  const int zeros = step > 0 ? __builtin_ctzll(bits) : __builtin_clzll(bits);
  const int i = 1 + zeros / 8;
  return i <= most ? i : most + 1;
}

// Where a flank comes down to `level`, px from the peak; NaN where it does not.
template <class T>
static inline __attribute__((always_inline)) float flank(const T* p, int at, int step, int most, float level,
                                                         bool room) {
  const int i = fall(p, at, step, most, level, room);
  if (i > most) return __builtin_nanf("");
  const float above = static_cast<float>(p[at + (i - 1) * step]), below = static_cast<float>(p[at + i * step]);
  return static_cast<float>(i - 1) + (above - level) / (above - below);
}

// Width at half height, and the profile's foot about its top (eq. 9); 0 where the profile does not come down.
template <class T>
static inline __attribute__((always_inline)) void shape(const T* p, int width, int most, LinePeak* r) {
  const bool room = r->at >= 8 && r->at + 8 < width;
  const float height = r->value - r->background;
  float side[3][2];
  const float share[3] = {0.5F, 0.85F, 0.25F};
  for (int k = 0; k < 3; ++k) {
    for (int s = 0; s < 2; ++s)
      side[k][s] = flank(p, r->at, s == 0 ? -1 : 1, most, r->background + height * share[k], room);
  }
  const float across = side[0][0] + side[0][1], foot = side[2][0] + side[2][1], top = side[1][0] + side[1][1];
  r->width = across > 0 ? across / 2.3548F : 0;
  r->asymmetry = foot > 0 && top > 0 ? ((side[2][1] - side[2][0]) - (side[1][1] - side[1][0])) / foot : 0;
}

template <class T>
static inline __attribute__((always_inline)) void line_peak(const T* p, int width, const PlainOptions& o,
                                                            LinePeak* out) {
  Blocks<T> blocks;
  fill(p, width, &blocks);
  const T top = top_of(blocks);
  int at = place_of(blocks, p, width, top), end = at;
  while (end + 1 < width && p[end + 1] == top) ++end;
  at = (at + end) / 2;
  const int half = o.half, reach = 2 * half;
  const float level = static_cast<float>(top);
  LinePeak r = {at, level, level, level, 0, __builtin_nanf(""), 0, 0};
  r.second = static_cast<float>(top_outside(blocks, p, width, at - reach - 1, at + reach + 1));
  if (at - reach >= 0 && at + reach < width) {
    const float each = 1 / static_cast<float>(half);
    const float before = each * static_cast<float>(sum_of(p + at - reach, half));
    const float after = each * static_cast<float>(sum_of(p + at + half + 1, half));
    const float slope = (after - before) / static_cast<float>(3 * half + 1);
    r.background = 0.5F * (before + after);
    r.centre = centroid(p, at, half, r.background, slope, &r.signal);
    if (level > r.background) shape(p, width, reach < 127 ? reach : 127, &r);
  }
  *out = r;
}
