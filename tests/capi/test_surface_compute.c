/* Normals, fusion and the distance map on planes, whose answers are known. */
#include "surfaces.h"

enum { kSide = 41, kPoints = kSide * kSide };

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

/* Points, normals and covariance turn; sigma stays. */
/* REQ-SURF-012 */
static void test_move(void) {
  const double point[3] = {1, 2, 3}, normal[3] = {1, 0, 0}, sigma = 0.5, covariance[6] = {1, 0.1, 0.2, 2, 0.3, 3};
  const double turned[6] = {2, -0.1, -0.3, 1, 0.2, 3}, iso[3] = {1, 0, 0};
  double pose[16];
  sgrt_surface_data data = data_of(point, 1);
  sgrt_surface *surface, *result = NULL;
  int i;
  data.normals = sgrt_view_of(normal, SGRT_F64, 1, 3, 0);
  data.sigma_mm = sgrt_view_of(&sigma, SGRT_F64, 1, 0, 0);
  data.covariance = sgrt_view_of(covariance, SGRT_F64, 1, 6, 0);
  surface = make(&data);
  CHECK_OK(sgrt_frame_couch_turn(90, iso, pose));
  CHECK_OK(sgrt_surface_move(NULL, surface, pose, &result));
  CHECK_NEAR(numbers_of(result, SGRT_SURFACE_POINTS)[0], -1, 1e-12);
  CHECK_NEAR(numbers_of(result, SGRT_SURFACE_POINTS)[1], 0, 1e-12);
  CHECK_NEAR(numbers_of(result, SGRT_SURFACE_NORMALS)[1], 1, 1e-12);
  CHECK_NEAR(numbers_of(result, SGRT_SURFACE_SIGMA)[0], 0.5, 0);
  for (i = 0; i < 6; ++i) CHECK_NEAR(numbers_of(result, SGRT_SURFACE_COVARIANCE)[i], turned[i], 1e-12);
  sgrt_surface_free(result), result = NULL;
  pose[7] = 1e5;
  CHECK_INVALID(sgrt_surface_move(NULL, surface, pose, &result), "points[0]");
  pose[0] = 2;
  CHECK_INVALID(sgrt_surface_move(NULL, surface, pose, &result), "pose");
  CHECK_INVALID(sgrt_surface_move(NULL, NULL, pose, &result), "surface: NULL");
  CHECK_INVALID(sgrt_surface_move(NULL, surface, NULL, &result), "pose: NULL");
  CHECK_INVALID(sgrt_surface_move(NULL, surface, pose, NULL), "result: NULL");
  CHECK(result == NULL);
  sgrt_surface_free(surface);
}

int main(void) {
  test_move();
  test_normals();
  test_fuse();
  test_distance();
  return check_result();
}
