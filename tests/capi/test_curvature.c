/* Curvature through C: exact on NURBS and on points of a sphere, reasons, and what is refused. */
#include "check.h"

enum { kCount = 1500 };
static double points[kCount][3], normals[kCount][3];

/* A sphere of radius 10, evenly covered. */
static sgrt_surface* sphere(int with_normals) {
  sgrt_surface_data data;
  sgrt_surface* surface = NULL;
  int i, k;
  for (i = 0; i < kCount; ++i) {
    const double z = 1 - (2 * i + 1.0) / kCount, turn = 2.399963229728653 * i, rho = sqrt(1 - z * z);
    normals[i][0] = rho * cos(turn), normals[i][1] = rho * sin(turn), normals[i][2] = z;
    for (k = 0; k < 3; ++k) points[i][k] = 10 * normals[i][k];
  }
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, kCount, 3, 0);
  if (with_normals) data.normals = sgrt_view_of(normals, SGRT_F64, kCount, 3, 0);
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  return surface;
}

static void test_points(void) {
  sgrt_surface* surface = sphere(1);
  sgrt_curvature* result = NULL;
  sgrt_curvature_options options;
  sgrt_curvature_info info;
  sgrt_view view;
  static double persistence[kCount];
  static uint8_t crest[kCount];
  const sgrt_mut_view lines = sgrt_mut_view_of(crest, SGRT_U8, kCount, 0, 0);
  const sgrt_mut_view peaks = sgrt_mut_view_of(persistence, SGRT_F64, kCount, 0, 0);
  const sgrt_mut_view few = sgrt_mut_view_of(persistence, SGRT_F64, 7, 0, 0);
  int i;
  CHECK_OK(sgrt_curvature_options_init(&options, sizeof options));
  options.radius_mm = 4;
  CHECK_OK(sgrt_curvature_compute(NULL, surface, &options, &result));
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_curvature_summary(result, &info));
  CHECK(info.point_count == kCount && info.known_count == kCount && info.reason_count[SGRT_CURVATURE_KNOWN] == kCount);
  CHECK_NEAR(info.spacing_mm, 0.915, 0.2);
  for (i = SGRT_CURVATURE_K1; i <= SGRT_CURVATURE_K2; ++i) {
    CHECK_OK(sgrt_curvature_array(result, i, &view));
    CHECK(view.ndim == 1 && view.shape[0] == kCount && view.dtype == SGRT_F64);
    CHECK_NEAR(((const double*)view.data)[700], 0.1, 1e-4);
  }
  CHECK_OK(sgrt_curvature_array(result, SGRT_CURVATURE_HK, &view));
  CHECK(view.dtype == SGRT_U8 && ((const uint8_t*)view.data)[3] == SGRT_HK_PEAK);
  CHECK_OK(sgrt_curvature_array(result, SGRT_CURVATURE_D1, &view));
  CHECK(view.ndim == 2 && view.shape[1] == 3);
  CHECK_INVALID(sgrt_curvature_array(result, 99, &view), "field");
  CHECK_OK(sgrt_curvature_features(NULL, surface, result, 3, &lines, &peaks));
  CHECK_INVALID(sgrt_curvature_features(NULL, surface, result, 3, NULL, &few), "persistence");
  CHECK_INVALID(sgrt_curvature_features(NULL, surface, result, -1, NULL, NULL), "sigmas");
  CHECK(!strcmp(sgrt_curvature_reason_word(SGRT_CURVATURE_BORDER), "border"));
  CHECK(!strcmp(sgrt_curvature_reason_word(77), "unknown"));
  sgrt_curvature_free(result);
  sgrt_curvature_free(NULL);
  options.radius_mm = 0.1;
  result = NULL;
  CHECK_STATUS(sgrt_curvature_compute(NULL, surface, &options, &result), SGRT_E_INSUFFICIENT_DATA, "too_few");
  CHECK(!result);
  options.degree = 9;
  CHECK_INVALID(sgrt_curvature_compute(NULL, surface, &options, &result), "options.degree");
  sgrt_surface_free(surface);
  surface = sphere(0);
  CHECK_INVALID(sgrt_curvature_compute(NULL, surface, NULL, &result), "without normals");
  CHECK_INVALID(sgrt_curvature_compute(NULL, NULL, NULL, &result), "surface");
  CHECK_INVALID(sgrt_curvature_compute(NULL, surface, NULL, NULL), "result");
  sgrt_surface_free(surface);
}

static void test_nurbs(void) {
  static const double kCentre[3] = {1, 2, 3}, kAxis[3] = {0, 0, 1}, kFar[2] = {7, 0.5};
  static double uv[4][2] = {{0.1, 0.2}, {0.4, 0.9}, {0.77, 0.31}, {0.5, 0.5}}, mean[4], k1[4], normal[4][3];
  const sgrt_view in = sgrt_view_of(uv, SGRT_F64, 4, 2, 0), outside = sgrt_view_of(kFar, SGRT_F64, 1, 2, 0);
  sgrt_nurbs_surface* torus = NULL;
  sgrt_curvature_samples samples;
  int i;
  CHECK_OK(sgrt_nurbs_surface_torus(kCentre, kAxis, 10, 4, &torus));
  CHECK_OK(sgrt_curvature_samples_init(&samples, sizeof samples));
  samples.k1 = sgrt_mut_view_of(k1, SGRT_F64, 4, 0, 0);
  samples.mean = sgrt_mut_view_of(mean, SGRT_F64, 4, 0, 0);
  samples.normals = sgrt_mut_view_of(normal, SGRT_F64, 4, 3, 0);
  CHECK_OK(sgrt_curvature_nurbs_surface(NULL, torus, &in, SGRT_OUTSIDE_REFUSE, &samples));
  for (i = 0; i < 4; ++i) CHECK_NEAR(k1[i], 0.25, 1e-11);
  CHECK(mean[0] == mean[0] && normal[0][0] == normal[0][0]);
  CHECK_INVALID(sgrt_curvature_nurbs_surface(NULL, torus, &outside, SGRT_OUTSIDE_REFUSE, &samples), "");
  samples.k1 = samples.mean;
  CHECK_INVALID(sgrt_curvature_nurbs_surface(NULL, torus, &in, SGRT_OUTSIDE_REFUSE, &samples), "samples.mean");
  CHECK_INVALID(sgrt_curvature_nurbs_surface(NULL, NULL, &in, SGRT_OUTSIDE_REFUSE, &samples), "surface");
  sgrt_nurbs_surface_free(torus);
}

static void test_curves(void) {
  static double circle[24][3], curvature[24], torsion[24], sigma[24];
  static const double kUp[3] = {0, 0, 1}, kNothing[3] = {0, 0, 0};
  const sgrt_view in = sgrt_view_of(circle, SGRT_F64, 24, 3, 0);
  const sgrt_mut_view kappa = sgrt_mut_view_of(curvature, SGRT_F64, 24, 0, 0);
  const sgrt_mut_view tau = sgrt_mut_view_of(torsion, SGRT_F64, 24, 0, 0);
  const sgrt_mut_view spread = sgrt_mut_view_of(sigma, SGRT_F64, 24, 0, 0);
  sgrt_nurbs_curve_data data;
  sgrt_nurbs_curve* curve = NULL;
  static double u[2] = {0.25, 0.5};
  const sgrt_view at = sgrt_view_of(u, SGRT_F64, 2, 0, 0);
  const sgrt_mut_view two = sgrt_mut_view_of(curvature, SGRT_F64, 2, 0, 0);
  int i;
  for (i = 0; i < 24; ++i)
    circle[i][0] = 8 * cos(i * 0.26179938779914943), circle[i][1] = 8 * sin(i * 0.26179938779914943);
  CHECK_OK(sgrt_curvature_points(&in, 1, 3, 4, 0.01, kUp, &kappa, &tau, &spread));
  for (i = 0; i < 24; ++i) CHECK_NEAR(curvature[i], 0.125, 2e-3);
  CHECK(sigma[0] > 0);
  CHECK_INVALID(sgrt_curvature_points(&in, 1, 3, 4, 0, kNothing, &kappa, NULL, NULL), "plane_normal");
  CHECK_INVALID(sgrt_curvature_points(&in, 1, 1, 6, 0, NULL, &kappa, NULL, NULL), "half_window");
  CHECK_OK(sgrt_nurbs_curve_data_init(&data, sizeof data));
  data.control_points = in;
  CHECK_OK(sgrt_nurbs_curve_create(&data, &curve));
  CHECK_OK(sgrt_curvature_nurbs_curve(curve, &at, SGRT_OUTSIDE_REFUSE, NULL, &two, NULL));
  CHECK(curvature[0] > 0.1 && curvature[0] < 0.15);
  CHECK_INVALID(sgrt_curvature_nurbs_curve(NULL, &at, SGRT_OUTSIDE_REFUSE, NULL, &two, NULL), "curve");
  sgrt_nurbs_curve_free(curve);
}

int main(void) {
  test_points();
  test_nurbs();
  test_curves();
  return check_result();
}
