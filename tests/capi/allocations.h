/* Counts the allocations of the whole program while `counting`; the library's operator new comes by here too. A
 * sanitizer has a malloc of its own, which is left alone: nothing is counted there. Include it in one file of a
 * program. */
#ifndef SGRT_TEST_ALLOCATIONS_H
#define SGRT_TEST_ALLOCATIONS_H

#include "../sanitizers.h"

#include <stddef.h>

static long counting = 0, allocations = 0;
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern void* __libc_malloc(size_t size);
void* malloc(size_t size) {
  allocations += counting;
  return __libc_malloc(size);
}
#endif

#endif
