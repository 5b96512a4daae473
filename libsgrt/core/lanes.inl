// Eight float lanes by compiler vectors: one source for every instruction set. Included inside a namespace of its own.
typedef float Lanes __attribute__((vector_size(32)));
typedef int IntLanes __attribute__((vector_size(32)));

static inline __attribute__((always_inline)) Lanes load8(const float* p) {
  Lanes v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
static inline __attribute__((always_inline)) void store8(float* p, Lanes v) {
  __builtin_memcpy(p, &v, sizeof v);
}
static inline __attribute__((always_inline)) Lanes all(float x) {
  return Lanes{x, x, x, x, x, x, x, x};
}
static inline __attribute__((always_inline)) float total(Lanes v) {
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}
