/* Memory that runs out has its status, leaves the outputs alone, and the same call answers once there is memory again.
 * Where a sanitizer has a malloc of its own there is nothing to fail: skipped. */
#include "../sanitizers.h"

#include "surfaces.h"

static int failing = 0, onwards = 0; /* allocation number `failing` from now fails, and all after it */
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
enum { kHook = 1 };
extern void* __libc_malloc(size_t size);
static int refuses(void) {
  if (failing == 0) return 0;
  if (failing > 1) return --failing, 0;
  if (!onwards) failing = 0;
  return 1;
}
/* The library's operator new comes by here. */
void* malloc(size_t size) {
  return refuses() ? NULL : __libc_malloc(size);
}
#else
enum { kHook = 0 };
#endif

static double points[3000];

/* A text that is written at the first wish for it: on a model of its own for each allocation that fails. */
static void first_text(int k, int after_it_too) {
  sgrt_landmark_model* model = NULL;
  const char* text;
  int hungry;
  CHECK_OK(sgrt_landmark_model_head(&model));
  failing = k, onwards = after_it_too;
  text = sgrt_landmark_model_text(model, SGRT_LANDMARK_MODEL_JSON, 0);
  hungry = failing == (after_it_too ? 1 : 0);
  failing = 0;
  CHECK(hungry == !text);
  if (hungry) CHECK(!strcmp(sgrt_last_error(), "out of memory"));
  text = sgrt_landmark_model_text(model, SGRT_LANDMARK_MODEL_JSON, 0);
  CHECK(text && text[strlen(text) - 1] == '}');
  sgrt_landmark_model_free(model);
}

int main(void) {
  sgrt_surface_data data = data_of(points, 1000);
  sgrt_surface* surface = CANARY(sgrt_surface);
  sgrt_status status;
  int i;
  if (!kHook) return 77;
  for (i = 0; i < 3000; ++i) points[i] = i;
  failing = onwards = 1;
  status = sgrt_surface_create(NULL, &data, &surface);
  failing = 0;
  CHECK(status == SGRT_E_OUT_OF_MEMORY);
  CHECK(!strcmp(sgrt_last_error(), "out of memory"));
  CHECK(surface == CANARY(sgrt_surface));
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  CHECK(summary_of(surface).point_count == 1000);
  sgrt_surface_free(surface);
  for (i = 1; i < 300; i = i < 20 ? i + 1 : i + 7) {
    first_text(i, 1);
    first_text(i, 0);
  }
  return check_result();
}
