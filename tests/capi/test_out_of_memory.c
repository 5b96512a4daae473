/* Memory that runs out has its status, leaves the outputs alone, and the same call answers once there is memory again.
 * Where a sanitizer has a malloc of its own there is nothing to fail: skipped. */
#include "../sanitizers.h"

#include "surfaces.h"

static int failing = 0;
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
enum { kHook = 1 };
extern void* __libc_malloc(size_t size);
/* The library's operator new comes by here. */
void* malloc(size_t size) {
  return failing ? NULL : __libc_malloc(size);
}
#else
enum { kHook = 0 };
#endif

static double points[3000];

int main(void) {
  sgrt_surface_data data = data_of(points, 1000);
  sgrt_surface* surface = CANARY(sgrt_surface);
  sgrt_status status;
  int i;
  if (!kHook) return 77;
  for (i = 0; i < 3000; ++i) points[i] = i;
  failing = 1;
  status = sgrt_surface_create(NULL, &data, &surface);
  failing = 0;
  CHECK(status == SGRT_E_OUT_OF_MEMORY);
  CHECK(!strcmp(sgrt_last_error(), "out of memory"));
  CHECK(surface == CANARY(sgrt_surface));
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  CHECK(summary_of(surface).point_count == 1000);
  sgrt_surface_free(surface);
  return check_result();
}
