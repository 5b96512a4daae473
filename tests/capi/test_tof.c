/* Time of flight through the ABI: a plane of known range, what is lent, the session, calibration, and nonsense. */
#include "check.h"

enum { kWidth = 24, kHeight = 10, kPixels = kWidth * kHeight };
static const double kPi = 3.14159265358979323846, kLight = 299792458e3;

static const char* const kRig =
    "{\"schema\": \"sgrt-rig/1\", \"id\": \"r\", \"room\": \"test\", \"cameras\": [{\"id\": \"c\", \"image_size\": "
    "[24, 10],"
    " \"model\": \"pinhole\", \"intrinsics\": [30, 30, 11.5, 4.5],"
    " \"camera_from_room\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}],"
    " \"tofs\": [{\"id\": \"tof0\", \"camera\": \"c\", \"modulation_hz\": [20e6],"
    " \"tap_phase_rad\": [0, 1.5707963267948966, 3.141592653589793, 4.71238898038469], \"electrons_per_count\": 2,"
    " \"x\": 1}]}";

static uint16_t taps[4][kPixels];
static float calibration_taps[4][4][kPixels];

static double ray_length(int i) {
  const double x = (i % kWidth - 11.5) / 30, y = (i / kWidth - 4.5) / 30;
  return sqrt(x * x + y * y + 1);
}

/* A wall at z mm, 20,000 +- 8,000 counts. */
static double tap_of(double range, int k) {
  return 20000 + 8000 * cos(4 * kPi * 20e6 * 1.00027 * range / kLight - k * kPi / 2);
}

static void wall(double z) {
  int k, i;
  for (k = 0; k < 4; ++k)
    for (i = 0; i < kPixels; ++i) taps[k][i] = (uint16_t)floor(tap_of(z * ray_length(i), k) + 0.5);
}

static sgrt_view view_of(const void* data, int32_t dtype, int64_t taps_count) {
  sgrt_view v = sgrt_view_of(data, dtype, taps_count, kHeight, kWidth);
  v.ndim = 4;
  v.shape[3] = v.shape[2], v.strides[3] = v.strides[2];
  v.shape[2] = v.shape[1], v.strides[2] = v.strides[1];
  v.shape[1] = v.shape[0], v.strides[1] = v.strides[0];
  v.shape[0] = 1;
  return v;
}

static sgrt_rig* make_rig(void) {
  sgrt_rig* rig = NULL;
  CHECK_OK(sgrt_rig_from_json(kRig, strlen(kRig), &rig));
  if (!rig) exit(2);
  return rig;
}

static void test_rig(const sgrt_rig* rig) {
  sgrt_rig_info info = {sizeof info, 0, 0, 0};
  sgrt_rig_tof unit;
  memset(&unit, 0, sizeof unit);
  unit.struct_size = sizeof unit;
  CHECK_OK(sgrt_rig_summary(rig, &info));
  CHECK(info.tof_count == 1);
  CHECK_OK(sgrt_rig_tof_get(rig, 0, &unit));
  CHECK(unit.frequency_count == 1 && unit.tap_count == 4 && unit.differential == 0);
  CHECK_NEAR(unit.modulation_hz[0], 20e6, 0);
  CHECK_NEAR(unit.tap_phase_rad[2], kPi, 1e-15);
  CHECK_NEAR(unit.electrons_per_count, 2, 0);
  CHECK(!strcmp(sgrt_rig_text(rig, SGRT_RIG_TOF_ID, 0), "tof0"));
  CHECK(!strcmp(sgrt_rig_text(rig, SGRT_RIG_TOF_CAMERA, 0), "c"));
  CHECK(!strcmp(sgrt_rig_text(rig, SGRT_RIG_TOF_PIXEL_OFFSET, 0), ""));
  CHECK(sgrt_rig_text(rig, SGRT_RIG_TOF_ID, 1) == NULL);
  CHECK(strstr(sgrt_rig_text(rig, SGRT_RIG_JSON, 0), "\"x\": 1") != NULL);
  CHECK_INVALID(sgrt_rig_tof_get(rig, 1, &unit), "index: 1");
}

static void test_measure(const sgrt_rig* rig) {
  sgrt_tof* result = NULL;
  sgrt_surface* surface = NULL;
  sgrt_tof_info info;
  sgrt_view v, range, points;
  int i;
  memset(&info, 0, sizeof info);
  info.struct_size = sizeof info;
  wall(1500);
  v = view_of(taps, SGRT_U16, 4);
  CHECK_OK(sgrt_tof_measure(NULL, rig, "tof0", &v, NULL, &result));
  CHECK_OK(sgrt_tof_summary(result, &info));
  CHECK(info.point_count == kPixels && info.width == kWidth && info.frequency_count == 1);
  CHECK_NEAR(info.ambiguity_mm, kLight / 1.00027 / 40e6, 1e-6);
  CHECK_NEAR(info.range_max_mm, info.ambiguity_mm, 0);
  /* A and B in electrons, and a count's rounding. */
  CHECK_NEAR(info.median_sigma_mm, kLight / 1.00027 / (4 * sqrt(2) * kPi * 20e6) * sqrt(40000.0 + 1. / 3) / 16000,
             1e-2);
  CHECK_OK(sgrt_tof_array(result, SGRT_TOF_RANGE, &range));
  CHECK_OK(sgrt_tof_array(result, SGRT_TOF_POINTS, &points));
  CHECK(points.ndim == 3 && points.shape[2] == 3);
  for (i = 0; i < kPixels; ++i) {
    const char* p = (const char*)points.data + i / kWidth * points.strides[0] + i % kWidth * points.strides[1];
    CHECK_NEAR(((const float*)range.data)[i], 1500 * ray_length(i), 0.2); /* half a count */
    CHECK_NEAR(*(const float*)(p + 2 * points.strides[2]), 1500, 0.2);
  }
  CHECK_OK(sgrt_tof_array(result, SGRT_TOF_SCORE, &v));
  CHECK(v.data == NULL);
  CHECK_INVALID(sgrt_tof_array(result, 10, &v), "field: 10");
  CHECK_OK(sgrt_tof_surface(NULL, result, &surface));
  sgrt_tof_free(result);
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_NORMALS, &v));
  CHECK(v.shape[0] == kHeight && v.shape[1] == kWidth);
  CHECK_NEAR(((const double*)v.data)[3 * (5 * kWidth + 12) + 2], -1, 1e-4);
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_COVARIANCE, &v));
  CHECK(v.data != NULL);
  sgrt_surface_free(surface);
}

static void test_session(const sgrt_rig* rig) {
  sgrt_tof_session* session = NULL;
  const sgrt_tof* lent = NULL;
  sgrt_tof* kept = NULL;
  sgrt_view v = view_of(taps, SGRT_U16, 4), range, old, three;
  CHECK_OK(sgrt_tof_session_create(NULL, rig, "tof0", NULL, &session));
  wall(1000);
  CHECK_OK(sgrt_tof_session_push(NULL, session, &v, 0, &lent));
  CHECK_OK(sgrt_tof_keep(lent, &kept));
  CHECK_OK(sgrt_tof_array(kept, SGRT_TOF_RANGE, &old));
  CHECK_INVALID(sgrt_tof_keep(NULL, &kept), "lent: NULL");
  wall(2000);
  CHECK_OK(sgrt_tof_session_push(NULL, session, &v, 0.02, &lent));
  CHECK_NEAR(((const float*)old.data)[5 * kWidth + 12], 1000 * ray_length(5 * kWidth + 12),
             0.2); /* it is still there */
  sgrt_tof_free(kept);
  CHECK_OK(sgrt_tof_array(lent, SGRT_TOF_RANGE, &range));
  CHECK_NEAR(((const float*)range.data)[5 * kWidth + 12], 2000 * ray_length(5 * kWidth + 12), 0.2);
  CHECK_INVALID(sgrt_tof_session_push(NULL, session, &v, 0.01, &lent), "time_s: 0.01");
  CHECK(lent == NULL);
  three = view_of(taps, SGRT_U16, 3);
  CHECK_INVALID(sgrt_tof_session_push(NULL, session, &three, 0.03, &lent), "taps: shape 1 x 1 x 3 x 10 x 24");
  memset(taps, 255, sizeof taps);
  CHECK_STATUS(sgrt_tof_session_push(NULL, session, &v, 0.03, &lent), SGRT_E_NOT_FOUND, "240 of 240 are saturated");
  CHECK(lent != NULL);
  wall(1000);
  CHECK_OK(sgrt_tof_session_push(NULL, session, &v, 0.04, &lent));
  sgrt_tof_session_free(session);
  sgrt_tof_session_free(NULL);
}

/* Walls from 800 to 2000 mm whose ranges are measured 12 mm too long. */
static void test_calibration(const sgrt_rig* rig) {
  sgrt_calibration_tof_options options;
  sgrt_calibration* result = NULL;
  sgrt_rig* calibrated = NULL;
  static double poses[4][16];
  sgrt_view views[4], pose_view = sgrt_view_of(poses, SGRT_F64, 4, 4, 4), v, range;
  sgrt_tof* measured = NULL;
  int j, k, i;
  CHECK_OK(sgrt_calibration_tof_options_init(&options, sizeof options));
  for (j = 0; j < 4; ++j) {
    const double z = 800 + 400 * j;
    for (k = 0; k < 4; ++k) {
      for (i = 0; i < kPixels; ++i) calibration_taps[j][k][i] = (float)tap_of(z * ray_length(i) + 12, k);
      poses[j][5 * k] = 1;
    }
    poses[j][11] = z;
    views[j] = view_of(calibration_taps[j], SGRT_F32, 4);
  }
  CHECK_INVALID(sgrt_calibration_tof(NULL, rig, "tof0", views, 4, &pose_view, NULL, &options, &result), "board_mm");
  options.board_mm[0] = options.board_mm[1] = -2000;
  options.board_mm[2] = options.board_mm[3] = 2000;
  CHECK_INVALID(sgrt_calibration_tof(NULL, rig, "tof1", views, 4, &pose_view, NULL, &options, &result), "tof1");
  CHECK_INVALID(sgrt_calibration_tof(NULL, rig, "tof0", views, 4, NULL, NULL, &options, &result), "data");
  CHECK_OK(sgrt_calibration_tof(NULL, rig, "tof0", views, 4, &pose_view, NULL, &options, &result));
  CHECK_OK(sgrt_calibration_rig(result, &calibrated));
  CHECK_OK(sgrt_calibration_array(result, SGRT_CALIBRATION_PIXEL_OFFSET, &v));
  wall(1500);
  v = view_of(taps, SGRT_U16, 4);
  CHECK_OK(sgrt_tof_measure(NULL, calibrated, "tof0", &v, NULL, &measured));
  CHECK_OK(sgrt_tof_array(measured, SGRT_TOF_RANGE, &range));
  for (i = 0; i < kPixels; ++i) CHECK_NEAR(((const float*)range.data)[i], 1500 * ray_length(i) - 12, 0.3);
  sgrt_tof_free(measured);
  sgrt_rig_free(calibrated);
  sgrt_calibration_free(result);
}

static void test_nonsense(const sgrt_rig* rig) {
  sgrt_tof_options options;
  sgrt_tof* result = CANARY(sgrt_tof);
  sgrt_view v = view_of(taps, SGRT_U16, 4), wrong = view_of(taps, SGRT_I32, 2);
  CHECK_OK(sgrt_tof_options_init(&options, sizeof options));
  CHECK_INVALID(sgrt_tof_measure(NULL, NULL, "tof0", &v, NULL, &result), "rig: NULL");
  CHECK_INVALID(sgrt_tof_measure(NULL, rig, "tof9", &v, NULL, &result), "'tof9' is not in the rig");
  CHECK_INVALID(sgrt_tof_measure(NULL, rig, "tof0", NULL, NULL, &result), "taps: NULL");
  CHECK_INVALID(sgrt_tof_measure(NULL, rig, "tof0", &wrong, NULL, &result), "uint16, int16 or float32");
  options.range_min_mm = -1;
  CHECK_INVALID(sgrt_tof_measure(NULL, rig, "tof0", &v, &options, &result), "range_min_mm: -1");
  options.range_min_mm = 0;
  options.max_incidence_deg = NAN;
  CHECK_INVALID(sgrt_tof_measure(NULL, rig, "tof0", &v, &options, &result), "max_incidence_deg");
  CHECK(result == CANARY(sgrt_tof));
  CHECK_INVALID(sgrt_tof_summary(NULL, NULL), "result: NULL");
  CHECK_INVALID(sgrt_tof_surface(NULL, NULL, NULL), "result: NULL");
  sgrt_tof_free(NULL);
}

int main(void) {
  sgrt_rig* rig = make_rig();
  test_rig(rig);
  test_measure(rig);
  test_session(rig);
  test_calibration(rig);
  test_nonsense(rig);
  sgrt_rig_free(rig);
  return check_result();
}
