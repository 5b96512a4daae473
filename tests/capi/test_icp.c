/* Fine registration: a known displacement found, its numbers consistent, planes and misses refused, bad arguments. */
#include "check.h"

enum { kRef = 81, kLive = 61 };
static const double kDegree = 3.14159265358979323846 / 180;
static const double kIso[3] = {10, -20, 30};
static const sgrt_patient_displacement kTrue = {3.5, -2.25, 4, 1.2, -0.8, 1.5, 0};

/* A lumpy hill: nothing in it repeats, no motion leaves it as it was. */
static double hill(double x, double y) {
  return 60 - (x * x + 0.6 * y * y) / 250 + 6 * sin(x / 17 + 0.4) * cos(y / 23) + 3 * sin((x + 2 * y) / 29);
}

/* The reference: a grid of 81 x 81 points, 2.5 mm apart. */
static sgrt_surface* reference_of(double (*height)(double, double)) {
  static double z[kRef * kRef];
  const double origin[2] = {-100, -100}, spacing[2] = {2.5, 2.5};
  sgrt_view view = sgrt_view_of(z, SGRT_F64, kRef, kRef, 0);
  sgrt_surface* surface = NULL;
  int i;
  for (i = 0; i < kRef * kRef; ++i) z[i] = height(2.5 * (i % kRef) - 100, 2.5 * (i / kRef) - 100);
  CHECK_OK(sgrt_surface_from_height_field(NULL, &view, origin, spacing, &surface));
  if (!surface) exit(2);
  return surface;
}

/* The live surface: other samples of it, with noise of 0.05 mm, moved by the true displacement. As a grid or a cloud.
 */
static sgrt_surface* live_of(double (*height)(double, double), const sgrt_patient_displacement* moved, int grid) {
  static double points[kLive * kLive * 3];
  double inverse[16];
  sgrt_surface_data data;
  sgrt_surface* surface = NULL;
  uint32_t state = 7;
  int i, k;
  CHECK_OK(sgrt_frame_pose_from_displacement(moved, kIso, inverse)); /* R^T, -R^T t: its inverse moves the points */
  for (i = 0; i < kLive * kLive; ++i) {
    const double x = 2.9 * (i % kLive) - 87 + chance(&state), y = 2.9 * (i / kLive) - 87 + chance(&state);
    const double noise = 0.05 * (chance(&state) + chance(&state) + chance(&state) + chance(&state) - 2) * 1.7320508;
    const double p[3] = {x - inverse[3], y - inverse[7], height(x, y) + noise - inverse[11]};
    for (k = 0; k < 3; ++k) points[3 * i + k] = inverse[k] * p[0] + inverse[4 + k] * p[1] + inverse[8 + k] * p[2];
  }
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points =
      grid ? sgrt_view_of(points, SGRT_F64, kLive, kLive, 3) : sgrt_view_of(points, SGRT_F64, kLive * kLive, 3, 0);
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  if (!surface) exit(2);
  return surface;
}

static sgrt_icp_info summary_of(const sgrt_icp* result) {
  sgrt_icp_info info;
  memset(&info, 0, sizeof info);
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_icp_summary(result, &info));
  return info;
}

static void test_accuracy(const sgrt_surface* reference) {
  sgrt_surface* live = live_of(hill, &kTrue, 1);
  sgrt_icp* result = NULL;
  sgrt_icp_info info;
  sgrt_patient_displacement d;
  sgrt_couch_correction c;
  sgrt_view distance, inlier;
  double sum2 = 0;
  int64_t i, taken = 0, seen = 0;
  CHECK_OK(sgrt_icp_align(NULL, reference, live, kIso, NULL, NULL, NULL, &result));
  if (!result) exit(2);
  info = summary_of(result);
  CHECK(info.status == SGRT_OK && info.verdict == SGRT_VERDICT_OK && info.free_count == 0 && info.iterations > 1);
  CHECK(strcmp(sgrt_icp_text(result, SGRT_ICP_VERDICT, 0), "ok") == 0);
  CHECK_NEAR(info.displacement.lat_mm, kTrue.lat_mm, 0.03);
  CHECK_NEAR(info.displacement.lng_mm, kTrue.lng_mm, 0.03);
  CHECK_NEAR(info.displacement.vrt_mm, kTrue.vrt_mm, 0.03);
  CHECK_NEAR(info.displacement.pitch_deg, kTrue.pitch_deg, 0.03);
  CHECK_NEAR(info.displacement.roll_deg, kTrue.roll_deg, 0.03);
  CHECK_NEAR(info.displacement.rtn_deg, kTrue.rtn_deg, 0.03);
  for (i = 0; i < 3; ++i) {
    CHECK(info.sigma_mm[i] > 0 && info.sigma_mm[i] < 0.1 && info.sigma_deg[i] > 0 && info.sigma_deg[i] < 0.1);
    CHECK_NEAR(info.sigma_deg[i] * kDegree, sqrt(info.covariance[7 * i]), 1e-15);
    CHECK_NEAR(info.sigma_mm[i], sqrt(info.covariance[7 * (i + 3)]), 1e-15);
    CHECK(info.isocentre_mm[i] == kIso[i]);
  }
  for (i = 0; i < 36; ++i) CHECK_NEAR(info.covariance[i], info.covariance[i % 6 * 6 + i / 6], 1e-18);
  /* The numbers are those of the pose. */
  CHECK_OK(sgrt_frame_shift_from_pose(info.reference_from_live, kIso, &d, &c));
  CHECK_NEAR(d.lat_mm, info.displacement.lat_mm, 1e-12);
  CHECK_NEAR(c.vrt_mm, info.correction.vrt_mm, 1e-12);
  CHECK_NEAR(c.rtn_deg, info.correction.rtn_deg, 1e-12);
  CHECK_NEAR(info.displacement.mag_mm, hypot(hypot(d.lat_mm, d.lng_mm), d.vrt_mm), 1e-12);
  CHECK_OK(sgrt_icp_array(result, SGRT_ICP_DISTANCE, &distance));
  CHECK_OK(sgrt_icp_array(result, SGRT_ICP_INLIER, &inlier));
  CHECK(distance.dtype == SGRT_F64 && distance.ndim == 2 && distance.shape[0] == kLive && distance.shape[1] == kLive);
  CHECK(inlier.dtype == SGRT_U8 && inlier.ndim == 2 && inlier.shape[0] == kLive);
  for (i = 0; i < kLive * kLive; ++i) {
    const double h = ((const double*)distance.data)[i];
    taken += ((const uint8_t*)inlier.data)[i];
    if (!isnan(h)) sum2 += h * h, ++seen;
  }
  CHECK(taken == info.pair_count && seen > kLive * kLive * 9 / 10 && info.inlier_share > 0.9);
  CHECK(sqrt(sum2 / (double)seen) < 0.08 && info.rms_mm < 0.07 && info.rms_mm > 0.02);
  printf("icp: %d iterations, lat %.4f lng %.4f vrt %.4f mm off\n", (int)info.iterations, d.lat_mm - kTrue.lat_mm,
         d.lng_mm - kTrue.lng_mm, d.vrt_mm - kTrue.vrt_mm);
  sgrt_icp_free(result);
  sgrt_surface_free(live);
}

/* The same bytes at any number of threads, also of a cloud. */
/* REQ-DET-002 */
static void test_threads(const sgrt_surface* reference) {
  sgrt_surface* live = live_of(hill, &kTrue, 0);
  sgrt_icp_info one, many;
  sgrt_icp* result = NULL;
  sgrt_view distance;
  int32_t threads;
  CHECK_OK(sgrt_icp_align(NULL, reference, live, kIso, NULL, NULL, NULL, &result));
  one = summary_of(result);
  CHECK_OK(sgrt_icp_array(result, SGRT_ICP_DISTANCE, &distance));
  CHECK(distance.ndim == 1 && distance.shape[0] == kLive * kLive);
  sgrt_icp_free(result);
  for (threads = 2; threads <= 4; ++threads) {
    sgrt_context* context = context_of(threads, NULL, NULL);
    CHECK_OK(sgrt_icp_align(context, reference, live, kIso, NULL, NULL, NULL, &result));
    many = summary_of(result);
    CHECK(!memcmp(&one, &many, sizeof one));
    sgrt_icp_free(result);
    sgrt_context_free(context);
  }
  sgrt_surface_free(live);
}

static void check_no_pose(const sgrt_icp* result, sgrt_status status) {
  const sgrt_icp_info info = summary_of(result);
  int i;
  CHECK(info.status == status && info.verdict == SGRT_VERDICT_NONE);
  for (i = 0; i < 16; ++i) CHECK(isnan(info.reference_from_live[i]) || (i >= 12));
  for (i = 0; i < 36; ++i) CHECK(isnan(info.covariance[i]));
  for (i = 0; i < 3; ++i) CHECK(isnan(info.sigma_mm[i]) && isnan(info.sigma_deg[i]) && info.isocentre_mm[i] == kIso[i]);
  CHECK(isnan(info.displacement.lat_mm) && isnan(info.displacement.rtn_deg) && isnan(info.displacement.mag_mm));
  CHECK(isnan(info.correction.lat_mm) && isnan(info.correction.roll_deg) && isnan(info.correction.mag_mm));
  CHECK(isnan(info.rms_mm));
  CHECK(sgrt_icp_text(result, SGRT_ICP_VERDICT, 0)[0] != '\0');
  CHECK(strcmp(sgrt_icp_text(result, SGRT_ICP_VERDICT, 0), "ok") != 0);
}

static double flat(double x, double y) {
  (void)x, (void)y;
  return 30;
}

static double gutter(double x, double y) {
  (void)y;
  return 40 - x * x / 150 + 3 * sin(x / 9);
}

/* A plane slides two ways and turns about its normal; a gutter slides along itself. */
/* REQ-ICP-003 */
static void test_degenerate(void) {
  const sgrt_patient_displacement still = {0, 0, 0, 0, 0, 0, 0};
  double (*const shapes[2])(double, double) = {flat, gutter};
  const int free_count[2] = {3, 1};
  int i, k;
  for (i = 0; i < 2; ++i) {
    sgrt_surface *reference = reference_of(shapes[i]), *live = live_of(shapes[i], &still, 1);
    sgrt_icp* result = NULL;
    CHECK_STATUS(sgrt_icp_align(NULL, reference, live, kIso, NULL, NULL, NULL, &result), SGRT_E_DEGENERATE, "free");
    CHECK(result != NULL);
    if (result) {
      const sgrt_icp_info info = summary_of(result);
      check_no_pose(result, SGRT_E_DEGENERATE);
      CHECK(info.free_count == free_count[i] && info.pair_count > 1000);
      for (k = 0; k < info.free_count; ++k) CHECK(sgrt_icp_text(result, SGRT_ICP_WORDS, k)[0] != '\0');
      CHECK(sgrt_icp_text(result, SGRT_ICP_WORDS, info.free_count) == NULL);
      if (i == 1)
        CHECK(strstr(sgrt_icp_text(result, SGRT_ICP_WORDS, 0), "LNG") && fabs(fabs(info.free_motion[4]) - 1) < 0.05);
    }
    sgrt_icp_free(result);
    sgrt_surface_free(reference);
    sgrt_surface_free(live);
  }
}

/* REQ-ICP-005 */
static void test_no_answer(const sgrt_surface* reference) {
  const sgrt_patient_displacement far_away = {600, 0, 0, 0, 0, 0, 0};
  const double five[15] = {0, 0, 60, 5, 0, 60, 0, 5, 60, 5, 5, 60, 9, 9, 60}, low[3] = {900, 900, 900},
               high[3] = {901, 901, 901};
  sgrt_surface *live = live_of(hill, &kTrue, 1), *away = live_of(hill, &far_away, 1), *few = NULL;
  sgrt_surface_data data;
  sgrt_roi* nowhere = NULL;
  sgrt_icp_options o;
  sgrt_icp* result = NULL;
  CHECK_STATUS(sgrt_icp_align(NULL, reference, away, kIso, NULL, NULL, NULL, &result), SGRT_E_NOT_FOUND, "overlap");
  CHECK(result != NULL);
  if (result) check_no_pose(result, SGRT_E_NOT_FOUND);
  sgrt_icp_free(result);
  result = NULL;
  CHECK_OK(sgrt_icp_options_init(&o, sizeof o));
  o.max_iterations = 2;
  CHECK_STATUS(sgrt_icp_align(NULL, reference, live, kIso, NULL, NULL, &o, &result), SGRT_E_NOT_CONVERGED,
               "2 iterations");
  CHECK(result != NULL);
  if (result) check_no_pose(result, SGRT_E_NOT_CONVERGED);
  sgrt_icp_free(result);
  result = NULL;
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(five, SGRT_F64, 5, 3, 0);
  CHECK_OK(sgrt_surface_create(NULL, &data, &few));
  CHECK_STATUS(sgrt_icp_align(NULL, reference, few, kIso, NULL, NULL, NULL, &result), SGRT_E_INSUFFICIENT_DATA, "6");
  CHECK(result != NULL);
  if (result) check_no_pose(result, SGRT_E_INSUFFICIENT_DATA);
  sgrt_icp_free(result);
  result = NULL;
  CHECK_OK(sgrt_roi_from_box(low, high, &nowhere));
  CHECK_STATUS(sgrt_icp_align(NULL, reference, live, kIso, nowhere, NULL, NULL, &result), SGRT_E_INSUFFICIENT_DATA,
               "6");
  if (result) check_no_pose(result, SGRT_E_INSUFFICIENT_DATA);
  sgrt_icp_free(result);
  sgrt_roi_free(nowhere);
  sgrt_surface_free(few);
  sgrt_surface_free(live);
  sgrt_surface_free(away);
}

/* A region and a first guess: the same answer, from fewer pairs and from farther away. */
static void test_roi_and_initial(const sgrt_surface* reference) {
  const sgrt_patient_displacement wide = {60, 45, 20, 10, -8, 25, 0};
  const double square[8] = {-60, -60, 60, -60, 60, 60, -60, 60};
  const sgrt_view view = sgrt_view_of(square, SGRT_F64, 4, 2, 0);
  sgrt_surface* live = live_of(hill, &wide, 1);
  sgrt_patient_displacement guess = wide;
  double initial[16];
  sgrt_roi* roi = NULL;
  sgrt_icp* result = NULL;
  sgrt_icp_info info;
  guess.lat_mm -= 3, guess.rtn_deg += 1;
  CHECK_OK(sgrt_frame_pose_from_displacement(&guess, kIso, initial));
  CHECK_OK(sgrt_roi_from_polygon(&view, &roi));
  CHECK_OK(sgrt_icp_align(NULL, reference, live, kIso, roi, initial, NULL, &result));
  if (!result) exit(2);
  info = summary_of(result);
  CHECK_NEAR(info.displacement.lat_mm, wide.lat_mm, 0.05);
  CHECK_NEAR(info.displacement.lng_mm, wide.lng_mm, 0.05);
  CHECK_NEAR(info.displacement.vrt_mm, wide.vrt_mm, 0.05);
  CHECK_NEAR(info.displacement.rtn_deg, wide.rtn_deg, 0.05);
  CHECK(info.pair_count < 2000 && info.pair_count > 1000);
  sgrt_icp_free(result);
  sgrt_roi_free(roi);
  sgrt_surface_free(live);
}

#define BAD_OPTION(member, value, words)                                                        \
  do {                                                                                          \
    CHECK_OK(sgrt_icp_options_init(&o, sizeof o));                                              \
    o.member = value;                                                                           \
    CHECK_INVALID(sgrt_icp_align(NULL, reference, live, kIso, NULL, NULL, &o, &result), words); \
  } while (0)

static void test_bad_options(const sgrt_surface* reference, const sgrt_surface* live) {
  sgrt_icp_options o;
  sgrt_icp* result = CANARY(sgrt_icp);
  BAD_OPTION(max_iterations, 0, "options.max_iterations: 0, expected 1 to");
  BAD_OPTION(max_iterations, INT32_MAX, "options.max_iterations");
  BAD_OPTION(max_distance_mm, 0, "options.max_distance_mm: 0");
  BAD_OPTION(max_distance_mm, INFINITY, "options.max_distance_mm: inf");
  BAD_OPTION(max_angle_deg, -1, "options.max_angle_deg: -1");
  BAD_OPTION(max_angle_deg, 91, "options.max_angle_deg: 91, expected more than 0, at most 90");
  BAD_OPTION(min_inlier_share, -0.1, "options.min_inlier_share: -0.1, expected 0 to 1");
  BAD_OPTION(min_inlier_share, 1.1, "options.min_inlier_share");
  BAD_OPTION(min_inlier_share, NAN, "options.min_inlier_share: nan");
  BAD_OPTION(step_tolerance_mm, 0, "options.step_tolerance_mm: 0");
  BAD_OPTION(weak_sigma_mm, NAN, "options.weak_sigma_mm: nan");
  BAD_OPTION(degenerate_sigma_mm, -5, "options.degenerate_sigma_mm: -5");
  BAD_OPTION(struct_size, 0, "options.struct_size: 0");
  BAD_OPTION(struct_size, sizeof o + 8, "options.struct_size");
  CHECK(result == CANARY(sgrt_icp));
}

/* REQ-ABI-006 */
static void test_bad_arguments(const sgrt_surface* reference) {
  const double bad_iso[3] = {0, NAN, 0};
  double initial[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2};
  sgrt_surface* live = live_of(hill, &kTrue, 1);
  sgrt_icp* result = CANARY(sgrt_icp);
  sgrt_icp_info info;
  sgrt_view view;
  int32_t threads;
  memset(&view, 0, sizeof view);
  info.struct_size = sizeof info;
  CHECK_INVALID(sgrt_icp_align(NULL, NULL, live, kIso, NULL, NULL, NULL, &result), "reference: NULL");
  CHECK_INVALID(sgrt_icp_align(NULL, reference, NULL, kIso, NULL, NULL, NULL, &result), "live: NULL");
  CHECK_INVALID(sgrt_icp_align(NULL, reference, live, NULL, NULL, NULL, NULL, &result), "isocentre_mm: NULL");
  CHECK_INVALID(sgrt_icp_align(NULL, reference, live, kIso, NULL, NULL, NULL, NULL), "result: NULL");
  CHECK_INVALID(sgrt_icp_align(NULL, reference, live, bad_iso, NULL, NULL, NULL, &result),
                "isocentre_mm[1]: nan, expected a finite number");
  CHECK_INVALID(sgrt_icp_align(NULL, reference, live, kIso, NULL, initial, NULL, &result),
                "initial_reference_from_live");
  initial[15] = 1, initial[0] = NAN;
  CHECK_INVALID(sgrt_icp_align(NULL, reference, live, kIso, NULL, initial, NULL, &result),
                "initial_reference_from_live[0]: nan");
  for (threads = 1; threads <= 3; ++threads) {
    sgrt_context* context = context_of(threads, cancel, NULL);
    CHECK_STATUS(sgrt_icp_align(context, reference, live, kIso, NULL, NULL, NULL, &result), SGRT_E_CANCELLED,
                 "cancelled");
    sgrt_context_free(context);
  }
  CHECK(result == CANARY(sgrt_icp));
  test_bad_options(reference, live);
  CHECK_INVALID(sgrt_icp_summary(NULL, &info), "result: NULL");
  CHECK_INVALID(sgrt_icp_array(NULL, SGRT_ICP_DISTANCE, &view), "result: NULL");
  CHECK(sgrt_icp_text(NULL, SGRT_ICP_VERDICT, 0) == NULL);
  CHECK_OK(sgrt_icp_align(NULL, reference, live, kIso, NULL, NULL, NULL, &result));
  CHECK_INVALID(sgrt_icp_summary(result, NULL), "info: NULL");
  CHECK_INVALID(sgrt_icp_array(result, SGRT_ICP_DISTANCE, NULL), "view: NULL");
  CHECK_INVALID(sgrt_icp_array(result, 3, &view), "field: 3, expected");
  info.struct_size = sizeof info - 8;
  CHECK_INVALID(sgrt_icp_summary(result, &info), "info.struct_size");
  CHECK(view.data == NULL && !sgrt_icp_text(result, 0, 0) && !sgrt_icp_text(result, SGRT_ICP_VERDICT, 1));
  CHECK(!sgrt_icp_text(result, SGRT_ICP_WORDS, 0) && !sgrt_icp_text(result, SGRT_ICP_WORDS, -1));
  sgrt_icp_free(result);
  sgrt_icp_free(NULL);
  sgrt_surface_free(live);
}

/* A prepared reference gives the same, from anywhere too, and says before what it can tell. */
static void test_reference(const sgrt_surface* reference) {
  sgrt_surface* live = live_of(hill, &kTrue, 1);
  sgrt_reference* prepared = NULL;
  sgrt_icp *a = NULL, *b = NULL;
  sgrt_icp_info one, two;
  sgrt_icp_options o;
  int i;
  CHECK_OK(sgrt_reference_create(NULL, reference, NULL, &prepared));
  CHECK_OK(sgrt_icp_align(NULL, reference, live, kIso, NULL, NULL, NULL, &a));
  CHECK_OK(sgrt_reference_align(NULL, prepared, live, kIso, NULL, NULL, &b));
  if (!a || !b) exit(2);
  one = summary_of(a), two = summary_of(b);
  CHECK(!memcmp(one.reference_from_live, two.reference_from_live, sizeof one.reference_from_live));
  CHECK(one.direction_count == 6 && isnan(one.coarse_score) && one.chi2 > 0.5 && one.chi2 < 2);
  for (i = 0; i < 6; ++i) {
    CHECK_NEAR(one.direction_detectable_mm[i], 3.6048 * one.direction_sigma_mm[i], 1e-3 * one.direction_sigma_mm[i]);
    CHECK(sgrt_icp_text(a, SGRT_ICP_DIRECTION, i)[0] != '\0');
  }
  CHECK(sgrt_icp_text(a, SGRT_ICP_DIRECTION, 6) == NULL);
  for (i = 0; i < 36; ++i) CHECK_NEAR(one.covariance_random[i] + one.covariance_shared[i], one.covariance[i], 1e-12);
  sgrt_icp_free(a);
  sgrt_icp_free(b);
  a = b = NULL;
  CHECK_OK(sgrt_icp_options_init(&o, sizeof o));
  o.anywhere = 1;
  CHECK_OK(sgrt_reference_align(NULL, prepared, live, kIso, NULL, &o, &a));
  if (!a) exit(2);
  two = summary_of(a);
  CHECK(two.coarse_score > 0.5 && two.coarse_runner_up < two.coarse_score);
  CHECK_NEAR(two.displacement.vrt_mm, kTrue.vrt_mm, 0.03);
  sgrt_icp_free(a);
  a = NULL;
  CHECK_OK(sgrt_reference_predict(NULL, prepared, kIso, 0.05, &a));
  if (!a) exit(2);
  two = summary_of(a);
  CHECK(two.direction_count == 6 && two.sigma_mm[0] > 0 && two.sigma_mm[0] < 1 && isnan(two.displacement.lat_mm));
  sgrt_icp_free(a);
  a = CANARY(sgrt_icp);
  CHECK_INVALID(sgrt_reference_predict(NULL, prepared, kIso, 0, &a), "live_sigma_mm: 0");
  CHECK_INVALID(sgrt_reference_predict(NULL, NULL, kIso, 1, &a), "reference: NULL");
  CHECK_INVALID(sgrt_reference_predict(NULL, prepared, NULL, 1, &a), "isocentre_mm: NULL");
  CHECK_INVALID(sgrt_reference_align(NULL, NULL, live, kIso, NULL, NULL, &a), "reference: NULL");
  CHECK_INVALID(sgrt_reference_align(NULL, prepared, NULL, kIso, NULL, NULL, &a), "live: NULL");
  CHECK_INVALID(sgrt_reference_align(NULL, prepared, live, kIso, NULL, NULL, NULL), "result: NULL");
  o.anywhere = 2;
  CHECK_INVALID(sgrt_reference_align(NULL, prepared, live, kIso, NULL, &o, &a), "options.anywhere: 2");
  CHECK(a == CANARY(sgrt_icp));
  CHECK_INVALID(sgrt_reference_create(NULL, NULL, NULL, &prepared), "surface: NULL");
  CHECK_INVALID(sgrt_reference_create(NULL, reference, NULL, NULL), "reference: NULL");
  sgrt_reference_free(prepared);
  sgrt_reference_free(NULL);
  sgrt_surface_free(live);
}

/* Names of error modes come back; one a mode. */
static void test_mode_names(void) {
  const double points[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, modes[18] = {0};
  const char *names[2] = {"room/0", ""}, *missing[2] = {"room/0", NULL};
  sgrt_surface_data data;
  sgrt_surface* surface = NULL;
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, 3, 3, 0);
  data.modes = sgrt_view_of(modes, SGRT_F64, 2, 3, 3);
  data.mode_names = missing;
  CHECK_INVALID(sgrt_surface_create(NULL, &data, &surface), "data.mode_names[1]: NULL");
  data.mode_names = names;
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  CHECK(strcmp(sgrt_surface_text(surface, SGRT_SURFACE_MODE_NAME, 0), "room/0") == 0);
  CHECK(sgrt_surface_text(surface, SGRT_SURFACE_MODE_NAME, 1)[0] == '\0');
  CHECK(!sgrt_surface_text(surface, SGRT_SURFACE_MODE_NAME, 2) && !sgrt_surface_text(surface, 0, 0));
  CHECK(!sgrt_surface_text(NULL, SGRT_SURFACE_MODE_NAME, 0) && !sgrt_surface_text(surface, 1, -1));
  sgrt_surface_free(surface);
}

int main(void) {
  sgrt_surface* reference = reference_of(hill);
  test_accuracy(reference);
  test_threads(reference);
  test_roi_and_initial(reference);
  test_degenerate();
  test_no_answer(reference);
  test_bad_arguments(reference);
  test_reference(reference);
  test_mode_names();
  sgrt_surface_free(reference);
  return check_result();
}
