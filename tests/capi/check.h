/* The checks of the C tests: each prints what failed and goes on; a test ends with `return check_result();`. */
#ifndef SGRT_TESTS_CHECK_H
#define SGRT_TESTS_CHECK_H

#include <math.h>
#include <sgrt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int check_failures = 0;

static inline void check_failed(const char* file, int line, const char* text) {
  ++check_failures;
  fprintf(stderr, "%s:%d: %s\n", file, line, text);
}

#define CHECK(condition)                                            \
  do {                                                              \
    if (!(condition)) check_failed(__FILE__, __LINE__, #condition); \
  } while (0)

static inline void check_near(const char* file, int line, const char* text, double value, double expected,
                              double most) {
  if (fabs(value - expected) <= most) return;
  ++check_failures;
  fprintf(stderr, "%s:%d: %s is %.17g, expected %.17g within %g\n", file, line, text, value, expected, most);
}
#define CHECK_NEAR(value, expected, most) check_near(__FILE__, __LINE__, #value, value, expected, most)

/* The call returns this status and, unless it is SGRT_OK, a message of one line that holds `words`. */
static inline void check_status(const char* file, int line, const char* text, sgrt_status status, sgrt_status expected,
                                const char* words) {
  const char* message = sgrt_last_error();
  if (status == expected && (status == SGRT_OK || (message[0] && strstr(message, words) && !strchr(message, '\n'))))
    return;
  ++check_failures;
  fprintf(stderr, "%s:%d: %s\n  gives %s \"%s\", expected %s \"%s\"\n", file, line, text, sgrt_status_word(status),
          status == SGRT_OK ? "" : message, sgrt_status_word(expected), words);
}
#define CHECK_OK(call) check_status(__FILE__, __LINE__, #call, call, SGRT_OK, "")
#define CHECK_INVALID(call, words) check_status(__FILE__, __LINE__, #call, call, SGRT_E_INVALID_ARGUMENT, words)
#define CHECK_STATUS(call, status, words) check_status(__FILE__, __LINE__, #call, call, status, words)

static inline int check_result(void) {
  if (check_failures) fprintf(stderr, "%d checks failed\n", check_failures);
  return check_failures != 0;
}

/* An output that must not be written. */
#define CANARY(type) ((type*)(uintptr_t)0x5a5a5a5a)

/* A context of so many threads; aborts the test where there is none. */
static inline sgrt_context* context_of(int32_t threads, sgrt_progress_fn progress, void* user) {
  sgrt_context_options options;
  sgrt_context* context = NULL;
  CHECK_OK(sgrt_context_options_init(&options, sizeof options));
  options.threads = threads;
  options.progress = progress;
  options.progress_user = user;
  CHECK_OK(sgrt_context_create(&options, &context));
  if (!context) exit(2);
  return context;
}

static inline int32_t cancel(void* user, double fraction, const char* stage) {
  if (user) ++*(int*)user;
  return fraction >= 0 && fraction <= 1 && stage && stage[0];
}

/* A repeatable number in [0, 1). */
static inline double chance(uint32_t* state) {
  *state = *state * 1664525u + 1013904223u;
  return (*state >> 8) / 16777216.0;
}

#endif
