/* The context: its options, progress and cancel, callbacks, many threads on one, fork. */
#define _POSIX_C_SOURCE 200112L
#include "../sanitizers.h"

#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include "check.h"

enum { kSide = 120 };

/* A dome, so that its normals are known: z = 100 - (x^2 + y^2) / 1000. */
static sgrt_surface* dome(void) {
  static double z[kSide * kSide];
  const double origin[2] = {-119, -119}, spacing[2] = {2, 2};
  sgrt_view view = sgrt_view_of(z, SGRT_F64, kSide, kSide, 0);
  sgrt_surface* surface = NULL;
  int i, j;
  for (i = 0; i < kSide; ++i) {
    for (j = 0; j < kSide; ++j) {
      double x = origin[0] + 2 * j, y = origin[1] + 2 * i;
      z[i * kSide + j] = 100 - (x * x + y * y) / 1000;
    }
  }
  CHECK_OK(sgrt_surface_from_height_field(NULL, &view, origin, spacing, &surface));
  if (!surface) exit(2);
  return surface;
}

/* REQ-CTX-008 */
static void test_options(void) {
  sgrt_context_options o;
  sgrt_context* context = CANARY(sgrt_context);
  CHECK_INVALID(sgrt_context_create(NULL, NULL), "context: NULL");
  CHECK_OK(sgrt_context_options_init(&o, sizeof o));
  o.threads = -1;
  CHECK_INVALID(sgrt_context_create(&o, &context), "options.threads: -1, expected 0 to 256");
  o.threads = 257;
  CHECK_INVALID(sgrt_context_create(&o, &context), "options.threads: 257");
  o.threads = 1;
  o.max_isa = 3;
  CHECK_INVALID(sgrt_context_create(&o, &context), "options.max_isa: 3, expected 0 to 2");
  o.max_isa = -1;
  CHECK_INVALID(sgrt_context_create(&o, &context), "options.max_isa");
  o.max_isa = SGRT_ISA_BASELINE;
  o.reserved = 7;
  CHECK_INVALID(sgrt_context_create(&o, &context), "options.reserved: 7, expected 0");
  CHECK(context == CANARY(sgrt_context));
  o.reserved = 0;
  for (o.threads = 0; o.threads <= 256; o.threads += 64) {
    CHECK_OK(sgrt_context_create(&o, &context));
    sgrt_context_free(context);
  }
  CHECK_OK(sgrt_context_create(NULL, &context));
  sgrt_context_free(context);
  sgrt_context_free(NULL);
}

typedef struct {
  pthread_t caller;
  int calls, elsewhere, outside;
  double last;
} watch;

static int32_t look(void* user, double fraction, const char* stage) {
  watch* w = (watch*)user;
  ++w->calls;
  w->elsewhere += !pthread_equal(pthread_self(), w->caller);
  w->outside += !(fraction >= 0 && fraction <= 1) || !stage || !stage[0];
  w->last = fraction;
  return 0;
}

/* REQ-CTX-001 */
static void test_progress_comes_on_the_calling_thread(const sgrt_surface* surface) {
  watch w = {pthread_self(), 0, 0, 0, -1};
  sgrt_context* context = context_of(4, look, &w);
  sgrt_surface* result = NULL;
  CHECK_OK(sgrt_surface_estimate_normals(context, surface, NULL, &result));
  CHECK(w.calls > 0 && w.elsewhere == 0 && w.outside == 0);
  sgrt_surface_free(result);
  sgrt_context_free(context);
}

/* REQ-CTX-002 */
static void test_cancel(const sgrt_surface* surface) {
  int32_t threads;
  for (threads = 1; threads <= 4; ++threads) {
    int calls = 0;
    sgrt_context* context = context_of(threads, cancel, &calls);
    sgrt_surface* result = CANARY(sgrt_surface);
    CHECK_STATUS(sgrt_surface_estimate_normals(context, surface, NULL, &result), SGRT_E_CANCELLED, "cancelled");
    CHECK(result == CANARY(sgrt_surface) && calls == 1);
    sgrt_context_free(context);
  }
}

/* A callback that calls the library: with its own context it is refused, with NULL it works. */
typedef struct {
  sgrt_context* context;
  const sgrt_surface* surface;
  sgrt_status with_own, with_none;
  int calls;
} nested;

static int32_t call_inside(void* user, double fraction, const char* stage) {
  nested* n = (nested*)user;
  sgrt_surface* result = NULL;
  (void)fraction, (void)stage;
  if (n->calls++ > 0) return 0;
  n->with_own = sgrt_surface_estimate_normals(n->context, n->surface, NULL, &result);
  CHECK(result == NULL);
  n->with_none = sgrt_surface_estimate_normals(NULL, n->surface, NULL, &result);
  sgrt_surface_free(result);
  return 0;
}

/* REQ-CTX-003 */
static void test_a_callback_may_call(const sgrt_surface* surface) {
  nested n = {NULL, NULL, -1, -1, 0};
  sgrt_surface* result = NULL;
  n.surface = surface;
  n.context = context_of(3, call_inside, &n);
  CHECK_OK(sgrt_surface_estimate_normals(n.context, surface, NULL, &result));
  CHECK(n.with_own == SGRT_E_INVALID_ARGUMENT && n.with_none == SGRT_OK);
  sgrt_surface_free(result);
  sgrt_context_free(n.context);
}

/* Many threads share a context and a surface; each gets the bytes of a single one. */
typedef struct {
  sgrt_context* context;
  const sgrt_surface* surface;
  const double* expected;
} shared;

static void* use_shared(void* user) {
  const shared* s = (const shared*)user;
  int i;
  for (i = 0; i < 3; ++i) {
    sgrt_surface* result = NULL;
    sgrt_view normals;
    if (sgrt_surface_estimate_normals(s->context, s->surface, NULL, &result) != SGRT_OK) return (void*)1;
    if (sgrt_surface_array(result, SGRT_SURFACE_NORMALS, &normals) != SGRT_OK) return (void*)1;
    if (memcmp(normals.data, s->expected, sizeof(double) * 3 * kSide * kSide)) return (void*)1;
    sgrt_surface_free(result);
  }
  return NULL;
}

/* REQ-CTX-007 */
static void test_threads(const sgrt_surface* surface) {
  sgrt_surface* alone = NULL;
  sgrt_view normals;
  pthread_t threads[6];
  shared s;
  size_t i;
  CHECK_OK(sgrt_surface_estimate_normals(NULL, surface, NULL, &alone));
  CHECK_OK(sgrt_surface_array(alone, SGRT_SURFACE_NORMALS, &normals));
  s.context = context_of(3, NULL, NULL);
  s.surface = surface;
  s.expected = (const double*)normals.data;
  for (i = 0; i < 6; ++i) CHECK(pthread_create(&threads[i], NULL, use_shared, &s) == 0);
  for (i = 0; i < 6; ++i) {
    void* wrong = (void*)1;
    CHECK(pthread_join(threads[i], &wrong) == 0 && wrong == NULL);
  }
  sgrt_context_free(s.context);
  sgrt_surface_free(alone);
}

#if !defined(__SANITIZE_THREAD__) /* which does not follow a child that starts threads */
/* REQ-CTX-005 */
static void test_the_context_works_after_a_fork(const sgrt_surface* surface) {
  sgrt_context* context = context_of(3, NULL, NULL);
  sgrt_surface* result = NULL;
  int status = -1;
  pid_t child;
  CHECK_OK(sgrt_surface_estimate_normals(context, surface, NULL, &result)); /* starts the threads */
  sgrt_surface_free(result);
  child = fork();
  if (child == 0) {
    result = NULL;
    if (sgrt_surface_estimate_normals(context, surface, NULL, &result) != SGRT_OK || !result) _exit(1);
    sgrt_surface_free(result);
    sgrt_context_free(context);
    _exit(0);
  }
  CHECK(child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
  sgrt_context_free(context);
}
#endif

int main(void) {
  sgrt_surface* surface = dome();
  test_options();
  test_progress_comes_on_the_calling_thread(surface);
  test_cancel(surface);
  test_a_callback_may_call(surface);
  test_threads(surface);
#if !defined(__SANITIZE_THREAD__)
  test_the_context_works_after_a_fork(surface);
#endif
  sgrt_surface_free(surface);
  return check_result();
}
