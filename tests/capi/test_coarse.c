/* Landmarks through C: the motion comes back, and what has none is a status. */
#include "check.h"

static const double kFace[8][3] = {{0, 0, 25},  {-17, -8, 8}, {17, -8, 8},    {-16, 38, 2},
                                   {16, 38, 2}, {0, -60, 5},  {-65, 30, -50}, {65, 32, -48}};
static const int32_t kIds[8] = {1, 2, 3, 4, 5, 6, 7, 8};
static const double kIso[3] = {5, 0, -40};

/* Turned by 90 deg about Z and shifted. */
static void move(const double from[8][3], double to[8][3]) {
  int i;
  for (i = 0; i < 8; ++i) to[i][0] = -from[i][1] + 10, to[i][1] = from[i][0] - 20, to[i][2] = from[i][2] + 30;
}

static sgrt_status align(const sgrt_view* a, const sgrt_view* b, const sgrt_view* ids, const sgrt_view* noise,
                         sgrt_coarse** result) {
  return sgrt_coarse_align(NULL, a, ids, noise, b, ids, NULL, kIso, NULL, result);
}

static void test_finds(void) {
  static double live[8][3], covariance[8][9];
  const sgrt_view a = sgrt_view_of(kFace, SGRT_F64, 8, 3, 0), ids = sgrt_view_of(kIds, SGRT_I32, 8, 0, 0);
  const sgrt_view b = sgrt_view_of(live, SGRT_F64, 8, 3, 0), noise = sgrt_view_of(covariance, SGRT_F64, 8, 3, 3);
  sgrt_coarse* result = NULL;
  sgrt_coarse_info info;
  sgrt_view view;
  int i;
  move(kFace, live);
  for (i = 0; i < 8; ++i) covariance[i][0] = covariance[i][4] = covariance[i][8] = 1;
  info.struct_size = sizeof info;
  CHECK_OK(align(&a, &b, &ids, &noise, &result));
  CHECK_OK(sgrt_coarse_summary(result, &info));
  CHECK(info.status == SGRT_OK && info.verdict == SGRT_VERDICT_OK && info.used_count == 8 && info.common_count == 8);
  CHECK_NEAR(info.reference_from_live[1], 1, 1e-12);
  CHECK_NEAR(info.displacement.rtn_deg, 90, 1e-9);
  CHECK(info.sigma_mm[0] > 0.1 && info.sigma_mm[0] < 5 && info.covariance[35] > 0);
  CHECK_OK(sgrt_coarse_array(result, SGRT_COARSE_DISTANCE, &view));
  CHECK(view.dtype == SGRT_F64 && view.ndim == 1 && view.shape[0] == 8 && ((const double*)view.data)[3] < 1e-9);
  CHECK_OK(sgrt_coarse_array(result, SGRT_COARSE_INLIER, &view));
  CHECK(view.dtype == SGRT_U8 && ((const uint8_t*)view.data)[7] == 1);
  CHECK_INVALID(sgrt_coarse_array(result, 9, &view), "field");
  CHECK(!strcmp(sgrt_coarse_text(result, SGRT_COARSE_VERDICT), "ok"));
  CHECK(!sgrt_coarse_text(result, 7) && !sgrt_coarse_text(NULL, SGRT_COARSE_VERDICT));
  sgrt_coarse_free(result);
  sgrt_coarse_free(NULL);
}

static void test_refuses(void) {
  static double live[8][3];
  const sgrt_view a = sgrt_view_of(kFace, SGRT_F64, 8, 3, 0), ids = sgrt_view_of(kIds, SGRT_I32, 8, 0, 0);
  const sgrt_view b = sgrt_view_of(live, SGRT_F64, 8, 3, 0), two = sgrt_view_of(live, SGRT_F64, 2, 3, 0);
  const sgrt_view two_ids = sgrt_view_of(kIds, SGRT_I32, 2, 0, 0), flat = sgrt_view_of(live, SGRT_F64, 8, 2, 0);
  sgrt_coarse* result = NULL;
  sgrt_coarse_info info;
  sgrt_coarse_options options;
  move(kFace, live);
  info.struct_size = sizeof info;
  CHECK_STATUS(sgrt_coarse_align(NULL, &a, &ids, NULL, &two, &two_ids, NULL, kIso, NULL, &result),
               SGRT_E_INSUFFICIENT_DATA, "2 landmarks");
  CHECK_OK(sgrt_coarse_summary(result, &info));
  CHECK(info.verdict == SGRT_VERDICT_NONE && info.common_count == 2 && isnan(info.reference_from_live[15]));
  CHECK(isnan(info.displacement.mag_mm) && isnan(info.covariance[0]) && isnan(info.rms_mm));
  sgrt_coarse_free(result);
  result = NULL;
  CHECK_INVALID(align(NULL, &b, &ids, NULL, &result), "reference_mm");
  CHECK_INVALID(align(&a, &flat, &ids, NULL, &result), "live_mm");
  CHECK_INVALID(align(&a, &b, NULL, NULL, &result), "reference_ids");
  CHECK_INVALID(align(&a, &b, &two_ids, NULL, &result), "reference_ids");
  CHECK_INVALID(align(&a, &b, &ids, &ids, &result), "reference_covariance_mm2");
  CHECK_INVALID(align(&a, &b, &ids, NULL, NULL), "result");
  CHECK_INVALID(sgrt_coarse_align(NULL, &a, &ids, NULL, &b, &ids, NULL, NULL, NULL, &result), "isocentre_mm");
  CHECK_OK(sgrt_coarse_options_init(&options, sizeof options));
  CHECK_NEAR(options.sigma_mm, 2, 0);
  options.sigma_mm = 0;
  CHECK_INVALID(sgrt_coarse_align(NULL, &a, &ids, NULL, &b, &ids, NULL, kIso, &options, &result), "options.sigma_mm");
  CHECK(!result);
}

int main(void) {
  test_finds();
  test_refuses();
  return check_result();
}
