/* Registration of a body that is not rigid, through C: a swelling leaves the answer in place; a scale; nonsense. */
#include "surfaces.h"

enum { kSide = 80, kPoints = kSide * kSide };

static const double kIso[3] = {0, 0, 0};

/* A lump without symmetry, a grid of points each 3 mm, lifted by `swelling` within 45 mm of (60, 40) and grown by
 * `scale`. */
static sgrt_surface* lump(double swelling, double scale, double dx) {
  static double x[kPoints * 3];
  sgrt_surface_data data;
  sgrt_surface *cloud, *surface = NULL;
  int i, j;
  for (i = 0; i < kSide; ++i) {
    for (j = 0; j < kSide; ++j) {
      double* p = x + 3 * (i * kSide + j);
      const double u = 3.0 * (j - kSide / 2), v = 3.0 * (i - kSide / 2);
      const double q = ((u - 60) * (u - 60) + (v - 40) * (v - 40)) / (45 * 45);
      p[0] = scale * u + dx, p[1] = scale * v;
      p[2] = 60 * cos(u / 90) * cos(v / 150) + 9 * sin(u / 23 + 0.4) * cos(v / 31);
      if (q < 1) p[2] += swelling * (1 - q) * (1 - q);
      p[2] *= scale;
    }
  }
  data = data_of(x, kPoints);
  cloud = make(&data);
  CHECK_OK(sgrt_surface_estimate_normals(NULL, cloud, NULL, &surface));
  sgrt_surface_free(cloud);
  return surface;
}

static void test_rigid_part(void) {
  sgrt_surface *reference = lump(0, 1, 0), *live = lump(3, 1, 1.5);
  sgrt_deform_options options;
  sgrt_deform* result = NULL;
  sgrt_deform_info info;
  sgrt_view view;
  int64_t i, deformed = 0;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_deform_options_init(&options, sizeof options));
  CHECK(options.mode == SGRT_DEFORM_RIGID && options.min_rigid_share == 0.6);
  options.mode = SGRT_DEFORM_FIELD;
  CHECK_OK(sgrt_deform_align(NULL, reference, live, kIso, NULL, NULL, &options, NULL, &result));
  CHECK_OK(sgrt_deform_summary(result, &info));
  CHECK(info.status == SGRT_OK);
  CHECK_NEAR(info.displacement.lat_mm, 1.5, 0.1);
  CHECK_NEAR(info.displacement.vrt_mm, 0, 0.1);
  CHECK_NEAR(info.correction.lat_mm, -1.5, 0.1);
  CHECK(info.rigid_share > 0.6 && info.rigid_share < 0.97);
  CHECK(info.scale == 1 && isnan(info.scale_sigma));
  CHECK_NEAR(info.deformation_max_mm, 3, 0.7);
  CHECK_OK(sgrt_deform_array(result, SGRT_DEFORM_PART, &view));
  CHECK(view.shape[0] == kPoints && view.dtype == SGRT_U8);
  for (i = 0; i < kPoints; ++i) deformed += ((const uint8_t*)view.data)[i] == 0;
  CHECK(deformed > 100 && deformed < kPoints / 3);
  CHECK_OK(sgrt_deform_array(result, SGRT_DEFORM_MAP, &view));
  CHECK(view.shape[0] == kPoints && view.shape[1] == 3);
  CHECK_OK(sgrt_deform_array(result, SGRT_DEFORM_DISTANCE, &view));
  CHECK(view.shape[0] == kPoints && view.dtype == SGRT_F64);
  CHECK(sgrt_deform_text(result, SGRT_DEFORM_VERDICT, 0) != NULL);
  CHECK(sgrt_deform_text(result, SGRT_DEFORM_WORDS, 0) == NULL);
  CHECK_INVALID(sgrt_deform_array(result, 9, &view), "field: 9");
  CHECK_INVALID(sgrt_deform_array(NULL, SGRT_DEFORM_MAP, &view), "result: NULL");
  CHECK_INVALID(sgrt_deform_array(result, SGRT_DEFORM_MAP, NULL), "view: NULL");
  CHECK_INVALID(sgrt_deform_summary(NULL, &info), "result: NULL");
  CHECK_INVALID(sgrt_deform_summary(result, NULL), "info: NULL");
  CHECK(sgrt_deform_text(NULL, SGRT_DEFORM_VERDICT, 0) == NULL && sgrt_deform_text(result, 7, 0) == NULL);
  sgrt_deform_free(result), result = NULL;

  /* Asked for more than stayed rigid, it says that it cannot tell. */
  options.mode = SGRT_DEFORM_RIGID;
  options.min_rigid_share = 1;
  CHECK(sgrt_deform_align(NULL, reference, live, kIso, NULL, NULL, &options, NULL, &result) == SGRT_E_NOT_FOUND);
  CHECK(strstr(sgrt_last_error(), "cannot tell the rigid motion") != NULL);
  CHECK_OK(sgrt_deform_summary(result, &info));
  CHECK(info.status == SGRT_E_NOT_FOUND && isnan(info.displacement.lat_mm) && isnan(info.reference_from_live[15]));
  CHECK(info.rigid_share < 1);
  sgrt_deform_free(result);
  sgrt_surface_free(live), sgrt_surface_free(reference);
}

static void test_similarity(void) {
  sgrt_surface *reference = lump(0, 1, 0), *live = lump(0, 1 / 1.04, 0);
  sgrt_deform_options options;
  sgrt_deform* result = NULL;
  sgrt_deform_info info;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_deform_options_init(&options, sizeof options));
  options.mode = SGRT_DEFORM_SIMILARITY;
  CHECK_OK(sgrt_deform_align(NULL, reference, live, kIso, NULL, NULL, &options, NULL, &result));
  CHECK_OK(sgrt_deform_summary(result, &info));
  CHECK_NEAR(info.scale, 1.04, 2e-3);
  CHECK(info.scale_sigma > 0 && info.scale_sigma < 1e-2);
  CHECK_NEAR(info.displacement.mag_mm, 0, 0.2);
  sgrt_deform_free(result);
  sgrt_surface_free(live), sgrt_surface_free(reference);
}

static void test_bad_arguments(void) {
  sgrt_surface* s = lump(0, 1, 0);
  sgrt_deform_options options, bad;
  sgrt_deform* result = NULL;
  CHECK_OK(sgrt_deform_options_init(&options, sizeof options));
  CHECK_INVALID(sgrt_deform_options_init(NULL, sizeof options), "options: NULL");
  CHECK_INVALID(sgrt_deform_align(NULL, NULL, s, kIso, NULL, NULL, NULL, NULL, &result), "reference: NULL");
  CHECK_INVALID(sgrt_deform_align(NULL, s, NULL, kIso, NULL, NULL, NULL, NULL, &result), "live: NULL");
  CHECK_INVALID(sgrt_deform_align(NULL, s, s, NULL, NULL, NULL, NULL, NULL, &result), "isocentre_mm: NULL");
  CHECK_INVALID(sgrt_deform_align(NULL, s, s, kIso, NULL, NULL, NULL, NULL, NULL), "result: NULL");
  bad = options, bad.mode = 3;
  CHECK_INVALID(sgrt_deform_align(NULL, s, s, kIso, NULL, NULL, &bad, NULL, &result), "options.mode: 3");
  bad = options, bad.min_rigid_share = 1.5;
  CHECK_INVALID(sgrt_deform_align(NULL, s, s, kIso, NULL, NULL, &bad, NULL, &result), "options.min_rigid_share: 1.5");
  bad = options, bad.max_structure_mm = NAN;
  CHECK_INVALID(sgrt_deform_align(NULL, s, s, kIso, NULL, NULL, &bad, NULL, &result), "options.max_structure_mm: nan");
  bad = options, bad.max_rivalry = -1;
  CHECK_INVALID(sgrt_deform_align(NULL, s, s, kIso, NULL, NULL, &bad, NULL, &result), "options.max_rivalry: -1");
  bad = options, bad.stiffness = 0;
  CHECK_INVALID(sgrt_deform_align(NULL, s, s, kIso, NULL, NULL, &bad, NULL, &result), "options.stiffness: 0");
  CHECK(result == NULL);
  sgrt_deform_free(NULL);
  sgrt_surface_free(s);
}

int main(void) {
  test_rigid_part();
  test_similarity();
  test_bad_arguments();
  return check_result();
}
