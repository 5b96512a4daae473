// Peak and centroid of one line, see kernels.hpp; docs/theory/laser.md eq. 1-3. Two passes over a line that the first
// has brought into the cache: the maximum, then its place.
typedef unsigned char Bytes __attribute__((vector_size(32)));
typedef float Floats __attribute__((vector_size(32)));
typedef unsigned long long Words __attribute__((vector_size(32)));

template <class T>
struct Vector;
template <>
struct Vector<unsigned char> {
  typedef Bytes Type;
};
template <>
struct Vector<float> {
  typedef Floats Type;
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
static inline __attribute__((always_inline)) T largest(const T* p, int n) {
  constexpr int lanes = 32 / static_cast<int>(sizeof(T));
  T best = p[0];
  if (n < lanes) {
    for (int i = 1; i < n; ++i) best = p[i] > best ? p[i] : best;
    return best;
  }
  auto m = load(p), other = load(p + n - lanes);
  int i = lanes;
  for (; i + 2 * lanes <= n; i += 2 * lanes) {
    const auto v = load(p + i), w = load(p + i + lanes);
    m = v > m ? v : m;
    other = w > other ? w : other;
  }
  for (; i + lanes <= n; i += lanes) {
    const auto v = load(p + i);
    m = v > m ? v : m;
  }
  return top_of(other > m ? other : m);
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
    if ((w[0] | w[1]) | (w[2] | w[3])) break;
  }
  while (i < n - 1 && p[i] != value) ++i;
  return i;
}

template <class T>
static inline __attribute__((always_inline)) float mean_of(const T* p, int n) {
  float sum = 0;
  for (int i = 0; i < n; ++i) sum += static_cast<float>(p[i]);
  return sum / static_cast<float>(n);
}

// The centroid of [centre - half - 1/2, centre + half + 1/2] over the background, its border pixels by their share.
template <class T>
static inline __attribute__((always_inline)) float centroid(const T* p, int width, float centre, int half, float level,
                                                            float slope, int origin, float* signal) {
  const float low = centre - static_cast<float>(half) - 0.5F, high = centre + static_cast<float>(half) + 0.5F;
  if (!(low >= -0.5F && high <= static_cast<float>(width) - 0.5F)) return __builtin_nanf("");
  const int first = static_cast<int>(low + 0.5F), last = static_cast<int>(high + 0.5F);
  float s0 = 0, s1 = 0;
  for (int i = first; i <= last && i < width; ++i) {
    const float a = static_cast<float>(i) - 0.5F, b = static_cast<float>(i) + 0.5F;
    const float share = (b < high ? b : high) - (a > low ? a : low);
    const float d = static_cast<float>(i - origin);
    const float v = share * (static_cast<float>(p[i]) - level - slope * d);
    s0 += v;
    s1 += v * d;
  }
  *signal = s0;
  return s0 > 0 ? static_cast<float>(origin) + s1 / s0 : __builtin_nanf("");
}

template <class T>
static inline __attribute__((always_inline)) void line_peak(const T* p, int width, const PlainOptions& o,
                                                            LinePeak* out) {
  const T top = largest(p, width);
  int at = first_at(p, width, top), end = at;
  while (end + 1 < width && p[end + 1] == top) ++end;
  at = (at + end) / 2;
  const int half = o.half, reach = 2 * half;
  LinePeak r = {at, static_cast<float>(top), 0, static_cast<float>(top), 0, __builtin_nanf("")};
  const int left = at - reach - 1, right = at + reach + 1;
  float second = 0;
  if (left > 0) second = static_cast<float>(largest(p, left));
  if (right < width) {
    const float other = static_cast<float>(largest(p + right, width - right));
    second = other > second ? other : second;
  }
  r.second = second;
  if (at - reach >= 0 && at + reach < width) {
    const float before = mean_of(p + at - reach, half), after = mean_of(p + at + half + 1, half);
    const float slope = (after - before) / static_cast<float>(3 * half + 1);
    r.background = 0.5F * (before + after);
    float centre = static_cast<float>(at);
    for (int pass = 0; pass < 3 && centre == centre; ++pass)
      centre = centroid(p, width, centre, half, r.background, slope, at, &r.signal);
    r.centre = centre;
  }
  *out = r;
}
