/* Surfaces: what is kept, what is refused, normals, fusion and the distance map on shapes whose answer is known. */
#include "check.h"

enum { kSide = 41, kPoints = kSide * kSide };

static sgrt_surface_data data_of(const void* points, int64_t n) {
  sgrt_surface_data data;
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, n, 3, 0);
  return data;
}

static sgrt_surface* make(const sgrt_surface_data* data) {
  sgrt_surface* surface = NULL;
  CHECK_OK(sgrt_surface_create(NULL, data, &surface));
  if (!surface) exit(2);
  return surface;
}

static sgrt_view array_of(const sgrt_surface* surface, int32_t field) {
  sgrt_view view;
  CHECK_OK(sgrt_surface_array(surface, field, &view));
  return view;
}

static const double* numbers_of(const sgrt_surface* surface, int32_t field) {
  return (const double*)array_of(surface, field).data;
}

static sgrt_surface_info summary_of(const sgrt_surface* surface) {
  sgrt_surface_info info;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_surface_summary(surface, &info));
  return info;
}

/* A square plane of 41 x 41 points, 2 mm apart, at the height z = offset + slope x, as a grid. */
static sgrt_surface* plane(double offset, double slope, double sigma) {
  static double points[kPoints * 3], sigmas[kPoints];
  sgrt_surface_data data;
  int i;
  for (i = 0; i < kPoints; ++i) {
    points[3 * i] = 2 * (i % kSide) - 40;
    points[3 * i + 1] = 2 * (i / kSide) - 40;
    points[3 * i + 2] = offset + slope * points[3 * i];
    sigmas[i] = sigma;
  }
  data = data_of(points, kPoints);
  data.points = sgrt_view_of(points, SGRT_F64, kSide, kSide, 3);
  if (sigma > 0) data.sigma_mm = sgrt_view_of(sigmas, SGRT_F64, kSide, kSide, 0);
  return make(&data);
}

static sgrt_surface* with_normals(sgrt_surface* surface) {
  sgrt_surface* result = NULL;
  CHECK_OK(sgrt_surface_estimate_normals(NULL, surface, NULL, &result));
  sgrt_surface_free(surface);
  if (!result) exit(2);
  return result;
}

/* Everything that can be given comes back, in its shape. */
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

static void test_normals(void) {
  sgrt_surface_normals_options o;
  sgrt_surface *flat = plane(7, 0.75, 0), *result = CANARY(sgrt_surface);
  const double* n;
  int i;
  CHECK_OK(sgrt_surface_normals_options_init(&o, sizeof o));
  o.neighbours = 5;
  CHECK_INVALID(sgrt_surface_estimate_normals(NULL, flat, &o, &result), "options.neighbours: 5, expected 6 to 200");
  o.neighbours = 201;
  CHECK_INVALID(sgrt_surface_estimate_normals(NULL, flat, &o, &result), "options.neighbours: 201");
  o.neighbours = 12, o.radius_mm = 0;
  CHECK_INVALID(sgrt_surface_estimate_normals(NULL, flat, &o, &result), "options.radius_mm: 0, expected more than 0");
  o.radius_mm = NAN;
  CHECK_INVALID(sgrt_surface_estimate_normals(NULL, flat, &o, &result), "options.radius_mm: nan");
  o.radius_mm = 20, o.viewpoint_mm[2] = NAN;
  CHECK_INVALID(sgrt_surface_estimate_normals(NULL, flat, &o, &result), "options.viewpoint_mm[2]: nan");
  CHECK(result == CANARY(sgrt_surface));
  o.viewpoint_mm[2] = -1000; /* seen from below */
  CHECK_OK(sgrt_surface_estimate_normals(NULL, flat, &o, &result));
  n = numbers_of(result, SGRT_SURFACE_NORMALS);
  for (i = 0; i < kPoints; ++i) {
    CHECK_NEAR(n[3 * i], 0.6, 1e-9);
    CHECK_NEAR(n[3 * i + 1], 0, 1e-9);
    CHECK_NEAR(n[3 * i + 2], -0.8, 1e-9);
  }
  CHECK(summary_of(result).height == kSide && array_of(flat, SGRT_SURFACE_NORMALS).data == NULL);
  sgrt_surface_free(result);
  sgrt_surface_free(flat);
}

/* Two flat pods, 0.4 mm apart, sigma 0.1 and 0.2: the fused points lie at the mean weighted 4 to 1. */
static void test_fuse(void) {
  sgrt_surface *a = with_normals(plane(10, 0, 0.1)), *b = with_normals(plane(10.4, 0, 0.2)),
               *fused = CANARY(sgrt_surface);
  const sgrt_surface* list[2];
  sgrt_surface_fuse_options o;
  sgrt_surface_fuse_info info;
  const double* p;
  int64_t i, inner = 0;
  int calls = 0;
  sgrt_context* context = context_of(2, cancel, &calls);
  list[0] = a, list[1] = b;
  memset(&info, 0, sizeof info);
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 2, NULL, &fused, &info), "info.struct_size: 0");
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_surface_fuse_options_init(&o, sizeof o));
  o.max_distance_mm = -1;
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 2, &o, &fused, &info), "options.max_distance_mm: -1");
  o.max_distance_mm = 3, o.max_angle_deg = NAN;
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 2, &o, &fused, &info), "options.max_angle_deg: nan");
  o.max_angle_deg = 60, o.reserved = 1;
  CHECK_INVALID(sgrt_surface_fuse(NULL, list, 2, &o, &fused, &info), "options.reserved: 1");
  CHECK_STATUS(sgrt_surface_fuse(context, list, 2, NULL, &fused, &info), SGRT_E_CANCELLED, "cancelled");
  CHECK(fused == CANARY(sgrt_surface) && info.point_count == 0);
  CHECK_OK(sgrt_surface_fuse(NULL, list, 2, NULL, &fused, &info));
  CHECK(info.surface_count == 2 && info.overlap_count > kPoints * 8 / 10 && info.point_count >= kPoints);
  CHECK_NEAR(info.disagreement_mean_mm, 0.4, 1e-6);
  CHECK_NEAR(info.disagreement_rms_mm, 0.4, 1e-6);
  CHECK(info.disagreement_expected_mm > 0.1 && info.disagreement_expected_mm < 0.25);
  p = numbers_of(fused, SGRT_SURFACE_POINTS);
  for (i = 0; i < info.point_count; ++i) {
    if (fabs(p[3 * i]) > 30 || fabs(p[3 * i + 1]) > 30) continue;
    CHECK_NEAR(p[3 * i + 2], 10.08, 1e-6);
    ++inner;
  }
  CHECK(inner == 31 * 31 && summary_of(fused).height == 0);
  sgrt_surface_free(fused);
  CHECK_OK(sgrt_surface_fuse(NULL, list, 1, NULL, &fused, NULL));
  CHECK(summary_of(fused).point_count == kPoints);
  sgrt_surface_free(fused);
  sgrt_surface_free(a);
  sgrt_surface_free(b);
  sgrt_context_free(context);
}

/* A tilted plane moved by a pose: every distance is known, and NaN beyond the border and the reach. */
static void test_distance(void) {
  const double up[16] = {1, 0, 0, 30, 0, 1, 0, 0, 0, 0, 1, 5, 0, 0, 0, 1};
  double bad[16], distance[kSide][kSide];
  sgrt_surface *reference = with_normals(plane(0, 0.75, 0)), *live = plane(1, 0.75, 0);
  sgrt_mut_view out = sgrt_mut_view_of(distance, SGRT_F64, kSide, kSide, 0), flat;
  sgrt_surface_distance_options o;
  sgrt_context* context = context_of(3, cancel, NULL);
  int i, j;
  CHECK_OK(sgrt_surface_distance(NULL, reference, live, NULL, NULL, &out));
  for (i = 2; i < kSide - 2; ++i) {
    for (j = 2; j < kSide - 2; ++j) CHECK_NEAR(distance[i][j], 0.8, 1e-9);
  }
  CHECK_OK(sgrt_surface_distance(NULL, reference, live, up, NULL, &out)); /* 30 mm along x, 5 mm up */
  CHECK_NEAR(distance[20][10], 0.8 * 6 - 0.6 * 30, 1e-9);
  CHECK(isnan(distance[20][38])); /* past the border */
  CHECK_OK(sgrt_surface_distance_options_init(&o, sizeof o));
  o.max_distance_mm = 0.5;
  CHECK_OK(sgrt_surface_distance(NULL, reference, live, NULL, &o, &out));
  CHECK(isnan(distance[20][20])); /* too far */
  memset(distance, 0, sizeof distance);
  o.max_distance_mm = 0;
  CHECK_INVALID(sgrt_surface_distance(NULL, reference, live, NULL, &o, &out), "options.max_distance_mm: 0");
  o.max_distance_mm = INFINITY;
  CHECK_INVALID(sgrt_surface_distance(NULL, reference, live, NULL, &o, &out), "options.max_distance_mm: inf");
  memcpy(bad, up, sizeof bad);
  bad[0] = 1.001;
  CHECK_INVALID(sgrt_surface_distance(NULL, reference, live, bad, NULL, &out), "reference_from_live");
  bad[0] = NAN;
  CHECK_INVALID(sgrt_surface_distance(NULL, reference, live, bad, NULL, &out),
                "reference_from_live[0]: nan, expected a finite");
  bad[0] = 1, bad[3] = 1e9;
  CHECK_INVALID(sgrt_surface_distance(NULL, reference, live, bad, NULL, &out), "reference_from_live[3]: 1e+09");
  flat = sgrt_mut_view_of(distance, SGRT_F64, kPoints, 0, 0);
  CHECK_INVALID(sgrt_surface_distance(NULL, reference, live, NULL, NULL, &flat),
                "distance_mm: shape 1681, expected 41 x 41");
  out.dtype = SGRT_F32;
  CHECK_INVALID(sgrt_surface_distance(NULL, reference, live, NULL, NULL, &out),
                "distance_mm: float32, expected float64");
  out.dtype = SGRT_F64;
  CHECK_STATUS(sgrt_surface_distance(context, reference, live, NULL, NULL, &out), SGRT_E_CANCELLED, "cancelled");
  for (i = 0; i < kPoints; ++i) CHECK(distance[i / kSide][i % kSide] == 0);
  sgrt_surface_free(reference);
  sgrt_surface_free(live);
  sgrt_context_free(context);
}

int main(void) {
  test_round_trip();
  test_grid();
  test_bad_data();
  test_null_arguments();
  test_height_field();
  test_normals();
  test_fuse();
  test_distance();
  return check_result();
}
