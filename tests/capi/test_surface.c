/* Surfaces: what is kept and what is refused. */
#include "surfaces.h"

/* Everything that can be given comes back, in its shape. */
/* REQ-SURF-001 */
static void test_round_trip(void) {
  const double points[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const double normals[12] = {0, 0, 1, 0, 0, -1, 1, 0, 0, 0.6, 0, 0.8};
  const float sigma[4] = {0.5f, 1, 2, 4};
  const double covariance[24] = {1, 0, 0, 1, 0, 1, 2, 0.5, 0, 1, 0, 1, 1, 0, 0, 0, 0, 0, 4, 0, 0, 4, 0, 4};
  const int32_t faces[6] = {0, 1, 2, 0, 2, 3};
  double modes[24];
  sgrt_surface_data data = data_of(points, 4);
  sgrt_surface* surface;
  sgrt_surface_info info;
  sgrt_view v;
  int i;
  for (i = 0; i < 24; ++i) modes[i] = i * 0.25;
  data.normals = sgrt_view_of(normals, SGRT_F64, 4, 3, 0);
  data.sigma_mm = sgrt_view_of(sigma, SGRT_F32, 4, 0, 0);
  data.covariance = sgrt_view_of(covariance, SGRT_F64, 4, 6, 0);
  data.faces = sgrt_view_of(faces, SGRT_I32, 2, 3, 0);
  data.modes = sgrt_view_of(modes, SGRT_F64, 2, 4, 3);
  data.correlation_points = 2.5;
  surface = make(&data);
  info = summary_of(surface);
  CHECK(info.point_count == 4 && info.face_count == 2 && info.mode_count == 2 && info.height == 0 && info.width == 0);
  CHECK(info.correlation_points == 2.5 && info.bounds_min_mm[0] == 0 && info.bounds_max_mm[2] == 1);
  CHECK(!memcmp(numbers_of(surface, SGRT_SURFACE_POINTS), points, sizeof points));
  CHECK(!memcmp(numbers_of(surface, SGRT_SURFACE_NORMALS), normals, sizeof normals));
  CHECK(!memcmp(numbers_of(surface, SGRT_SURFACE_COVARIANCE), covariance, sizeof covariance));
  CHECK(!memcmp(array_of(surface, SGRT_SURFACE_FACES).data, faces, sizeof faces));
  CHECK(!memcmp(numbers_of(surface, SGRT_SURFACE_MODES), modes, sizeof modes));
  for (i = 0; i < 4; ++i) CHECK(numbers_of(surface, SGRT_SURFACE_SIGMA)[i] == sigma[i]);
  v = array_of(surface, SGRT_SURFACE_MODES);
  CHECK(v.ndim == 3 && v.shape[0] == 2 && v.shape[1] == 4 && v.shape[2] == 3 && v.strides[0] == 96);
  v = array_of(surface, SGRT_SURFACE_FACES);
  CHECK(v.dtype == SGRT_I32 && v.ndim == 2 && v.shape[0] == 2 && v.strides[0] == 12);
  v = array_of(surface, SGRT_SURFACE_SIGMA);
  CHECK(v.ndim == 1 && v.shape[0] == 4);
  sgrt_surface_free(surface);
}

/* REQ-SURF-003 */
static void test_grid(void) {
  double points[18], modes[36];
  sgrt_surface_data data;
  sgrt_surface* surface;
  sgrt_surface_info info;
  sgrt_view v;
  int i;
  for (i = 0; i < 18; ++i) points[i] = i;
  for (i = 0; i < 36; ++i) modes[i] = -i;
  points[3] = points[4] = points[5] = NAN; /* an absent point */
  data = data_of(points, 6);
  data.points = sgrt_view_of(points, SGRT_F64, 2, 3, 3);
  data.modes = data.points;
  data.modes.data = modes;
  data.modes.ndim = 4;
  for (i = 3; i > 0; --i) {
    data.modes.shape[i] = data.points.shape[i - 1];
    data.modes.strides[i] = data.points.strides[i - 1];
  }
  data.modes.shape[0] = 2;
  data.modes.strides[0] = 144;
  surface = make(&data);
  info = summary_of(surface);
  CHECK(info.point_count == 5 && info.height == 2 && info.width == 3 && info.bounds_max_mm[2] == 17);
  v = array_of(surface, SGRT_SURFACE_POINTS);
  CHECK(v.ndim == 3 && v.shape[0] == 2 && v.shape[1] == 3 && v.shape[2] == 3 && v.strides[0] == 72);
  v = array_of(surface, SGRT_SURFACE_MODES);
  CHECK(v.ndim == 4 && v.shape[0] == 2 && v.shape[1] == 2 && v.shape[2] == 3 && v.shape[3] == 3);
  CHECK(v.data && ((const double*)v.data)[35] == -35);
  CHECK(array_of(surface, SGRT_SURFACE_NORMALS).data == NULL && array_of(surface, SGRT_SURFACE_FACES).data == NULL);
  sgrt_surface_free(surface);
}

static void refused(const sgrt_surface_data* data, sgrt_status status, const char* words) {
  sgrt_surface* surface = CANARY(sgrt_surface);
  CHECK_STATUS(sgrt_surface_create(NULL, data, &surface), status, words);
  CHECK(surface == CANARY(sgrt_surface));
}

static void test_bad_data(void) {
  double points[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, other[40];
  int32_t faces[3] = {0, 1, 4};
  const sgrt_surface_data good = data_of(points, 4);
  sgrt_surface_data d = good;
  size_t i;
  for (i = 0; i < 40; ++i) other[i] = 0.5;
  d.normals = sgrt_view_of(other, SGRT_F64, 3, 3, 0);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "data.normals: shape 3 x 3, expected 4 x 3");
  d.normals = sgrt_view_of(other, SGRT_F64, 4, 3, 0);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "normals[0]: expected a unit vector");
  d = good, d.sigma_mm = sgrt_view_of(other, SGRT_F64, 4, 1, 0);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "data.sigma_mm: shape 4 x 1, expected 4");
  d.sigma_mm = sgrt_view_of(points, SGRT_F64, 4, 0, 0); /* holds zeros */
  refused(&d, SGRT_E_INVALID_ARGUMENT, "sigma_mm[0]");
  d = good, d.covariance = sgrt_view_of(other, SGRT_F64, 4, 3, 3);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "data.covariance: shape 4 x 3 x 3");
  for (i = 0; i < 24; ++i) other[i] = i % 6 == 1 ? 2 : i % 6 == 2 || i % 6 == 4 ? 0 : 1;
  d.covariance = sgrt_view_of(other, SGRT_F64, 4, 6, 0);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "covariance[0]: expected a positive semi-definite");
  d = good, d.faces = sgrt_view_of(faces, SGRT_I32, 1, 3, 0);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "faces[0, 2]: expected 0 to 3, got 4");
  d.faces = sgrt_view_of(points, SGRT_F64, 1, 3, 0);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "data.faces: float64, expected int32");
  d = good, d.points = sgrt_view_of(points, SGRT_F64, 2, 2, 3), d.faces = sgrt_view_of(faces, SGRT_I32, 1, 3, 0);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "faces");
  d = good, d.modes = sgrt_view_of(other, SGRT_F64, 9, 4, 3), d.modes.strides[0] = 0;
  refused(&d, SGRT_E_INVALID_ARGUMENT, "data.modes: 9 modes, expected at most 8");
  d.modes = sgrt_view_of(other, SGRT_F64, 4, 3, 0);
  refused(&d, SGRT_E_INVALID_ARGUMENT, "data.modes: shape 4 x 3, expected any x 4 x 3");
  d = good, d.correlation_points = 0;
  refused(&d, SGRT_E_INVALID_ARGUMENT, "correlation_points");
  d.correlation_points = NAN;
  refused(&d, SGRT_E_INVALID_ARGUMENT, "correlation_points");
  d = good, d.reserved = 1;
  refused(&d, SGRT_E_INVALID_ARGUMENT, "data.reserved: 1, expected 0");
  points[4] = NAN;
  refused(&good, SGRT_E_INVALID_ARGUMENT, "points[1]");
  points[4] = INFINITY;
  refused(&good, SGRT_E_INVALID_ARGUMENT, "points[1]");
  points[4] = -1.1e5;
  refused(&good, SGRT_E_INVALID_ARGUMENT, "points[1]");
  /* Sound shapes whose copies would take more than 4 GiB: told before memory is asked for. */
  d = good, d.points.shape[0] = 50000000, d.points.strides[0] = 0;
  d.covariance = sgrt_view_of(other, SGRT_F64, 50000000, 6, 0), d.covariance.strides[0] = 0;
  d.normals = d.points, d.modes = sgrt_view_of(other, SGRT_F64, 8, 50000000, 3);
  d.modes.strides[0] = d.modes.strides[1] = 0;
  refused(&d, SGRT_E_LIMIT, "bytes");
}

/* REQ-ABI-006 */
static void test_null_arguments(void) {
  const double points[3] = {0, 0, 0}, two[2] = {1, 1};
  const sgrt_surface_data data = data_of(points, 1);
  const sgrt_surface* list[2] = {NULL, NULL};
  sgrt_surface *surface = make(&data), *out = CANARY(sgrt_surface);
  sgrt_surface_info info;
  sgrt_view view = sgrt_view_of(two, SGRT_F64, 1, 1, 0);
  sgrt_mut_view target = sgrt_mut_view_of(&info, SGRT_F64, 1, 0, 0);
  info.struct_size = sizeof info;
  CHECK_INVALID(sgrt_surface_create(NULL, NULL, &out), "data: NULL");
  CHECK_INVALID(sgrt_surface_create(NULL, &data, NULL), "surface: NULL");
  CHECK_INVALID(sgrt_surface_from_height_field(NULL, NULL, two, two, &out), "z_mm: NULL");
  CHECK_INVALID(sgrt_surface_from_height_field(NULL, &view, NULL, two, &out), "origin_mm: NULL");
  CHECK_INVALID(sgrt_surface_from_height_field(NULL, &view, two, NULL, &out), "spacing_mm: NULL");
  CHECK_INVALID(sgrt_surface_from_height_field(NULL, &view, two, two, NULL), "surface: NULL");
  CHECK_INVALID(sgrt_surface_summary(NULL, &info), "surface: NULL");
  CHECK_INVALID(sgrt_surface_summary(surface, NULL), "info: NULL");
  CHECK_INVALID(sgrt_surface_array(NULL, SGRT_SURFACE_POINTS, &view), "surface: NULL");
  CHECK_INVALID(sgrt_surface_array(surface, SGRT_SURFACE_POINTS, NULL), "view: NULL");
  CHECK_INVALID(sgrt_surface_array(surface, 0, &view), "field: 0, expected");
  CHECK_INVALID(sgrt_surface_array(surface, 7, &view), "field: 7, expected");
  CHECK(view.data == two);
  CHECK_INVALID(sgrt_surface_estimate_normals(NULL, NULL, NULL, &out), "surface: NULL");
  CHECK_INVALID(sgrt_surface_estimate_normals(NULL, surface, NULL, NULL), "result: NULL");
  CHECK_STATUS(sgrt_surface_estimate_normals(NULL, surface, NULL, &out), SGRT_E_INSUFFICIENT_DATA, "6");
  CHECK_INVALID(sgrt_surface_fuse(NULL, NULL, 1, NULL, &out, NULL), "surfaces: NULL");
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 1, NULL, &out, NULL), "surfaces[0]: NULL");
  list[0] = surface;
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 1, NULL, &out, NULL), "surfaces[0]: a surface without normals");
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 0, NULL, &out, NULL), "count: 0, expected 1 to 64");
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 65, NULL, &out, NULL), "count: 65");
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 1, NULL, NULL, NULL), "result: NULL");
  CHECK_INVALID(sgrt_surface_distance(NULL, NULL, surface, NULL, NULL, &target), "reference: NULL");
  CHECK_INVALID(sgrt_surface_distance(NULL, surface, NULL, NULL, NULL, &target), "live: NULL");
  CHECK_INVALID(sgrt_surface_distance(NULL, surface, surface, NULL, NULL, &target),
                "reference: a surface without normals");
  CHECK(out == CANARY(sgrt_surface) && info.struct_size == sizeof info);
  sgrt_surface_free(surface);
  sgrt_surface_free(NULL);
}

/* REQ-SURF-006 */
static void test_height_field(void) {
  const float z[6] = {1, 2, 3, 5, 6, NAN};
  const double origin[2] = {10, 20}, spacing[2] = {2, -3}, zero[2] = {1, 0}, bad[2] = {NAN, 1};
  const double *p, *n;
  sgrt_view view = sgrt_view_of(z, SGRT_F32, 2, 3, 0), cube = sgrt_view_of(z, SGRT_F32, 1, 2, 3);
  sgrt_surface* surface = CANARY(sgrt_surface);
  CHECK_INVALID(sgrt_surface_from_height_field(NULL, &view, bad, spacing, &surface),
                "origin_mm[0]: nan, expected a finite");
  CHECK_INVALID(sgrt_surface_from_height_field(NULL, &view, origin, bad, &surface), "spacing_mm[0]: nan");
  CHECK_INVALID(sgrt_surface_from_height_field(NULL, &view, origin, zero, &surface), "spacing_mm");
  CHECK_INVALID(sgrt_surface_from_height_field(NULL, &cube, origin, spacing, &surface), "z_mm: shape 1 x 2 x 3");
  CHECK(surface == CANARY(sgrt_surface));
  CHECK_OK(sgrt_surface_from_height_field(NULL, &view, origin, spacing, &surface));
  p = numbers_of(surface, SGRT_SURFACE_POINTS);
  n = numbers_of(surface, SGRT_SURFACE_NORMALS);
  CHECK(p[3] == 12 && p[4] == 20 && p[5] == 2);   /* row 0, column 1 */
  CHECK(p[9] == 10 && p[10] == 17 && p[11] == 5); /* row 1, column 0 */
  CHECK(isnan(p[15]) && isnan(p[17]) && summary_of(surface).point_count == 5);
  CHECK_NEAR(n[3] / n[5], -0.5, 1e-12);    /* dz/dx = 1 / 2 */
  CHECK_NEAR(n[4] / n[5], 4.0 / 3, 1e-12); /* dz/dy = 4 / -3 */
  CHECK(n[5] > 0);
  sgrt_surface_free(surface);
}

int main(void) {
  test_round_trip();
  test_grid();
  test_bad_data();
  test_null_arguments();
  test_height_field();
  return check_result();
}
