/* Views: every stride reads right, everything unsound is refused before a byte is touched, outputs do not overlap. */
#include "check.h"

enum { kCount = 5 };
static const double kPoints[kCount][3] = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {9, 10, 11}, {12, 13, 15}};

static sgrt_status create(const sgrt_view* points, sgrt_surface** surface) {
  sgrt_surface_data data;
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = *points;
  return sgrt_surface_create(NULL, &data, surface);
}

/* The surface of the view has row i at row_of(i) of kPoints. */
static void check_reads(const sgrt_view* view, int first, int step) {
  sgrt_surface* surface = NULL;
  sgrt_view got;
  int i, k;
  CHECK_OK(create(view, &surface));
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_POINTS, &got));
  CHECK(got.dtype == SGRT_F64 && got.ndim == 2 && got.shape[0] == view->shape[0] && got.shape[1] == 3);
  CHECK(got.strides[0] == 24 && got.strides[1] == 8);
  for (i = 0; got.data && i < view->shape[0]; ++i) {
    for (k = 0; k < 3; ++k) CHECK(((const double*)got.data)[3 * i + k] == kPoints[first + i * step][k]);
  }
  sgrt_surface_free(surface);
}

/* REQ-VIEW-001 */
static void test_strides(void) {
  double wide[kCount][8], columns[3][kCount];
  float single[kCount][3];
  sgrt_view v;
  int i, k;
  for (i = 0; i < kCount; ++i) {
    for (k = 0; k < 3; ++k) {
      wide[i][2 * k] = columns[k][i] = kPoints[i][k];
      single[i][k] = (float)kPoints[i][k];
    }
  }
  v = sgrt_view_of(kPoints, SGRT_F64, kCount, 3, 0);
  check_reads(&v, 0, 1);
  v = sgrt_view_of(single, SGRT_F32, kCount, 3, 0);
  check_reads(&v, 0, 1);
  v = sgrt_view_of(wide, SGRT_F64, kCount, 3, 0); /* a slice */
  v.strides[0] = sizeof wide[0];
  v.strides[1] = 16;
  check_reads(&v, 0, 1);
  v = sgrt_view_of(columns, SGRT_F64, kCount, 3, 0); /* Fortran order */
  v.strides[0] = 8;
  v.strides[1] = sizeof columns[0];
  check_reads(&v, 0, 1);
  v = sgrt_view_of(kPoints[kCount - 1], SGRT_F64, kCount, 3, 0); /* from the end */
  v.strides[0] = -24;
  check_reads(&v, kCount - 1, -1);
  v = sgrt_view_of(kPoints, SGRT_F64, 3, 3, 0); /* every second */
  v.strides[0] = 48;
  check_reads(&v, 0, 2);
  v = sgrt_view_of(kPoints[2], SGRT_F64, 4, 3, 0); /* one row, broadcast */
  v.strides[0] = 0;
  check_reads(&v, 2, 0);
  v = sgrt_view_of(kPoints[3], SGRT_F64, 1, 3, 0); /* the stride of a side of 1 does not count */
  v.strides[0] = INT64_MAX;
  check_reads(&v, 3, 1);
}

static void check_refused(sgrt_view v, sgrt_status status, const char* words) {
  sgrt_surface* surface = CANARY(sgrt_surface);
  CHECK_STATUS(create(&v, &surface), status, words);
  CHECK(surface == CANARY(sgrt_surface));
}

/* REQ-VIEW-002 */
static void test_unsound_inputs(void) {
  const sgrt_view good = sgrt_view_of(kPoints, SGRT_F64, kCount, 3, 0);
  sgrt_view v = good;
  int32_t i;
  v.data = NULL;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "data.points: NULL");
  for (i = 0, v = good; i < 8; ++i) {
    v.dtype = i;
    if (i != SGRT_F32 && i != SGRT_F64) check_refused(v, SGRT_E_INVALID_ARGUMENT, "expected float32 or float64");
  }
  v.dtype = SGRT_I32;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "data.points: int32");
  for (i = -1, v = good; i < 9; ++i) {
    v.ndim = i;
    if (i != 2) check_refused(v, SGRT_E_INVALID_ARGUMENT, "data.points: ");
  }
  v.ndim = INT32_MIN;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "dimensions");
  v = good, v.shape[1] = 2;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "data.points: shape 5 x 2, expected");
  v = good, v.shape[0] = -1;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "data.points: a side of -1");
  v = good, v.shape[0] = INT64_MIN;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "a side of");
  v = good, v.shape[0] = 0;
  check_refused(v, SGRT_E_INSUFFICIENT_DATA, "data.points: no point");
  v = good, v.data = (const char*)kPoints + 4;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "data.points: misaligned data");
  v = good, v.strides[0] = 20;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "data.points: a stride of 20 bytes, expected a multiple of 8");
  v = good, v.strides[1] = -4;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "data.points: a stride of -4");
}

/* REQ-VIEW-002 */
static void test_sizes_beyond_memory(void) {
  const sgrt_view good = sgrt_view_of(kPoints, SGRT_F64, kCount, 3, 0);
  sgrt_view v = good;
  v.shape[0] = INT64_MAX;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "beyond memory");
  v.shape[0] = INT64_MAX / 24 + 1;
  v.strides[0] = 0;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "beyond memory");
  v = good, v.strides[0] = INT64_MAX - 7;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "beyond memory");
  v.strides[0] = INT64_MIN;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "beyond memory");
  v.strides[0] = -((int64_t)1 << 60); /* below address 0 */
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "beyond memory");
  v = sgrt_view_of(kPoints, SGRT_F64, (int64_t)1 << 32, (int64_t)1 << 32, 3); /* the product overflows */
  v.strides[0] = v.strides[1] = v.strides[2] = 0;
  check_refused(v, SGRT_E_INVALID_ARGUMENT, "beyond memory");
  v = good, v.shape[0] = 50000001, v.strides[0] = 0; /* sound, but too many */
  check_refused(v, SGRT_E_LIMIT, "data.points: 50000001, expected at most 50000000");
  v.shape[0] = (int64_t)1 << 40;
  check_refused(v, SGRT_E_LIMIT, "data.points");
}

/* Outputs, by the mask of a box over a grid of 2 x 3 points. */
static sgrt_surface* grid(void) {
  static const double z[6] = {1, 2, 3, 4, 5, 6};
  const double origin[2] = {0, 0}, spacing[2] = {1, 1};
  sgrt_view view = sgrt_view_of(z, SGRT_F64, 2, 3, 0);
  sgrt_surface* surface = NULL;
  CHECK_OK(sgrt_surface_from_height_field(NULL, &view, origin, spacing, &surface));
  return surface;
}

/* REQ-VIEW-003 */
static void test_outputs(void) {
  static const uint8_t kExpected[2][3] = {{0, 0, 0}, {1, 1, 0}};
  const double low[3] = {-1, -1, 3.5}, high[3] = {1.5, 9, 9};
  sgrt_surface* surface = grid();
  sgrt_roi* roi = NULL;
  uint8_t mask[40];
  double numbers[6];
  sgrt_mut_view good = sgrt_mut_view_of(mask, SGRT_U8, 2, 3, 0), v;
  int i, j;
  CHECK_OK(sgrt_roi_from_box(low, high, &roi));
  v = good, v.data = mask + 30, v.strides[0] = -10, v.strides[1] = -3; /* backwards, with gaps that stay */
  memset(mask, 7, sizeof mask);
  CHECK_OK(sgrt_roi_mask(roi, surface, &v));
  for (i = 0; i < 2; ++i) {
    for (j = 0; j < 3; ++j) CHECK(mask[30 - 10 * i - 3 * j] == kExpected[i][j]);
  }
  for (i = 0, j = 0; i < 40; ++i) j += mask[i] == 7;
  CHECK(j == 34);
  memset(mask, 7, sizeof mask);
  CHECK_INVALID(sgrt_roi_mask(roi, surface, NULL), "mask: NULL");
  v = good, v.data = NULL;
  CHECK_INVALID(sgrt_roi_mask(roi, surface, &v), "mask: NULL");
  v = sgrt_mut_view_of(numbers, SGRT_F64, 2, 3, 0);
  CHECK_INVALID(sgrt_roi_mask(roi, surface, &v), "mask: float64, expected uint8");
  v = sgrt_mut_view_of(mask, SGRT_U8, 6, 0, 0);
  CHECK_INVALID(sgrt_roi_mask(roi, surface, &v), "mask: shape 6, expected 2 x 3");
  v = sgrt_mut_view_of(mask, SGRT_U8, 3, 2, 0);
  CHECK_INVALID(sgrt_roi_mask(roi, surface, &v), "mask: shape 3 x 2, expected 2 x 3");
  v = good, v.strides[0] = 0;
  CHECK_INVALID(sgrt_roi_mask(roi, surface, &v), "overlap");
  v = good, v.strides[1] = 0;
  CHECK_INVALID(sgrt_roi_mask(roi, surface, &v), "overlap");
  v = good, v.strides[0] = 2; /* rows run into each other */
  CHECK_INVALID(sgrt_roi_mask(roi, surface, &v), "overlap");
  v = good, v.strides[0] = INT64_MIN;
  CHECK_INVALID(sgrt_roi_mask(roi, surface, &v), "beyond memory");
  for (i = 0; i < 40; ++i) CHECK(mask[i] == 7);
  sgrt_roi_free(roi);
  sgrt_surface_free(surface);
}

static void test_constructors(void) {
  static double x[24];
  sgrt_view v = sgrt_view_of(x, SGRT_F64, 2, 3, 4);
  sgrt_mut_view m = sgrt_mut_view_of(x, SGRT_F32, 5, 0, 0);
  CHECK(v.ndim == 3 && v.shape[0] == 2 && v.shape[1] == 3 && v.shape[2] == 4);
  CHECK(v.strides[0] == 96 && v.strides[1] == 32 && v.strides[2] == 8 && v.shape[5] == 0 && v.strides[5] == 0);
  CHECK(m.ndim == 1 && m.shape[0] == 5 && m.strides[0] == 4 && m.data == x);
  CHECK(sgrt_dtype_size(SGRT_U16) == 2 && sgrt_dtype_size(0) == 0 && sgrt_dtype_size(7) == 0);
}

int main(void) {
  test_strides();
  test_unsound_inputs();
  test_sizes_beyond_memory();
  test_outputs();
  test_constructors();
  return check_result();
}
