/* Making and reading surfaces in the tests, each step checked. */
#ifndef SGRT_TEST_SURFACES_H
#define SGRT_TEST_SURFACES_H

#include "check.h"

static inline sgrt_surface_data data_of(const void* points, int64_t n) {
  sgrt_surface_data data;
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, n, 3, 0);
  return data;
}

static inline sgrt_surface* make(const sgrt_surface_data* data) {
  sgrt_surface* surface = NULL;
  CHECK_OK(sgrt_surface_create(NULL, data, &surface));
  if (!surface) exit(2);
  return surface;
}

static inline sgrt_view array_of(const sgrt_surface* surface, int32_t field) {
  sgrt_view view;
  CHECK_OK(sgrt_surface_array(surface, field, &view));
  return view;
}

static inline const double* numbers_of(const sgrt_surface* surface, int32_t field) {
  return (const double*)array_of(surface, field).data;
}

static inline sgrt_surface_info summary_of(const sgrt_surface* surface) {
  sgrt_surface_info info;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_surface_summary(surface, &info));
  return info;
}

#endif
