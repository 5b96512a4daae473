/* Laser: stripes, the sweep over a tilted plane at known places, the session, breathing, bad arguments. */
#include "check.h"

enum { kWidth = 320, kHeight = 240, kFrames = 9 };

static const char kRig[] =
    "{\"schema\": \"sgrt-rig/1\", \"id\": \"laser test\", \"room\": \"IEC 61217 fixed, mm\", \"cameras\": ["
    "{\"id\": \"cam\", \"image_size\": [320, 240], \"model\": \"pinhole\", \"intrinsics\": [600, 600, 159.5, 119.5],"
    " \"camera_from_room\": [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]}],"
    "\"lasers\": [{\"id\": \"scanner\", \"camera\": \"cam\", \"fan\": {\"point\": [300, 0, 1000], \"normal\": [0, 0, "
    "1]},"
    " \"mirror\": {\"axis_point\": [300, 0, 1000], \"axis_direction\": [0, 1, 0],"
    " \"normal_at_zero\": [0.5969, 0, -0.8023], \"offset_mm\": 0.5}},"
    "{\"id\": \"flat\", \"camera\": \"cam\", \"fan\": {\"point\": [0, 0, 1000], \"normal\": [1, 0, 0]}},"
    "{\"id\": \"edge on\", \"camera\": \"cam\", \"fan\": {\"point\": [0, 0, 1000], \"normal\": [0.0001, 1, 0]}},"
    "{\"id\": \"broken\", \"camera\": \"cam\", \"fan\": {\"point\": [0, 0], \"normal\": [1, 0, 0]}}]}";

static uint8_t images[kFrames][kHeight][kWidth];
static double angles[kFrames], times[kFrames], centres[kFrames][kHeight];

/* The body: z = height + 0.1 x - 0.05 y. Cuts the ray of a pixel with it. */
static void cut(double height, double column, double row, double x[3]) {
  const double u = (column - 159.5) / 600, v = -(row - 119.5) / 600;
  const double s = (1000 - height) / (1 + 0.1 * u - 0.05 * v);
  x[0] = s * u, x[1] = s * v, x[2] = 1000 - s;
}

static double off_light(const double plane[4], double height, double column, double row) {
  double x[3];
  cut(height, column, row, x);
  return plane[0] * x[0] + plane[1] * x[1] + plane[2] * x[2] - plane[3];
}

static void render(const double plane[4], double height, uint8_t image[kHeight][kWidth], double centre[kHeight]) {
  int i, j, k;
  for (i = 0; i < kHeight; ++i) {
    double low = -50, high = kWidth + 50;
    const double sign = off_light(plane, height, high, i) > 0 ? 1 : -1;
    for (k = 0; k < 60; ++k) {
      const double middle = (low + high) / 2;
      if (sign * off_light(plane, height, middle, i) > 0) {
        high = middle;
      } else {
        low = middle;
      }
    }
    centre[i] = (low + high) / 2;
    for (j = 0; j < kWidth; ++j) {
      const double d = (j - centre[i]) / 1.6;
      image[i][j] = (uint8_t)(15.5 + 180 * exp(-d * d / 2));
    }
  }
}

static sgrt_rig* make_rig(void) {
  sgrt_rig* rig = NULL;
  CHECK_OK(sgrt_rig_from_json(kRig, strlen(kRig), &rig));
  if (!rig) exit(2);
  return rig;
}

static void test_stripe(void) {
  static double truth[kHeight];
  sgrt_view view = sgrt_view_of(images[4], SGRT_U8, kHeight, kWidth, 0), v;
  sgrt_stripe_options options;
  int32_t method;
  int i;
  memcpy(truth, centres[4], sizeof truth);
  for (method = SGRT_STRIPE_CENTROID; method <= SGRT_STRIPE_RIDGE; ++method) {
    sgrt_stripe* stripe = NULL;
    sgrt_stripe_info info;
    CHECK_OK(sgrt_stripe_options_init(&options, sizeof options));
    options.method = method;
    CHECK_OK(sgrt_stripe_extract(NULL, &view, NULL, &options, &stripe));
    info.struct_size = sizeof info;
    CHECK_OK(sgrt_stripe_summary(stripe, &info));
    CHECK(info.line_count == kHeight && info.found_count > kHeight - 20);
    CHECK_OK(sgrt_stripe_array(stripe, SGRT_STRIPE_CENTRE, &v));
    CHECK(v.dtype == SGRT_F64 && v.ndim == 1 && v.shape[0] == kHeight);
    for (i = 0; i < kHeight; ++i) {
      const double c = ((const double*)v.data)[i];
      if (!isnan(c)) CHECK_NEAR(c, truth[i], 0.03);
    }
    CHECK_OK(sgrt_stripe_array(stripe, SGRT_STRIPE_REASON, &v));
    CHECK(v.dtype == SGRT_U8);
    CHECK_STATUS(sgrt_stripe_array(stripe, 77, &v), SGRT_E_INVALID_ARGUMENT, "");
    sgrt_stripe_free(stripe);
  }
}

/* Every point of the sweep lies on the body, where its pixel says. */
static void check_points(const sgrt_laser* result) {
  sgrt_laser_info info;
  sgrt_surface* surface = NULL;
  sgrt_view v;
  const double *x, *n;
  double sum2 = 0;
  int64_t i, count = 0;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_laser_summary(result, &info));
  CHECK(info.width == kFrames && info.height == kHeight && info.columns == 0);
  CHECK(info.point_count > kFrames * (kHeight - 20) && info.reason_count[0] == info.point_count);
  CHECK_OK(sgrt_laser_surface(result, &surface));
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_POINTS, &v));
  CHECK(v.ndim == 3 && v.shape[0] == kHeight && v.shape[1] == kFrames);
  x = (const double*)v.data;
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_NORMALS, &v));
  n = (const double*)v.data;
  for (i = 0; i < (int64_t)kHeight * kFrames; ++i) {
    double off;
    if (isnan(x[3 * i])) continue;
    off = x[3 * i + 2] - (20 + 0.1 * x[3 * i] - 0.05 * x[3 * i + 1]);
    sum2 += off * off;
    if (!isnan(n[3 * i])) CHECK(n[3 * i + 2] > 0.98);
    ++count;
  }
  printf("laser: %d points, rms %.4f mm, median sigma %.4f mm\n", (int)count, sqrt(sum2 / count), info.median_sigma_mm);
  CHECK(count == info.point_count && sqrt(sum2 / count) < 0.05);
  CHECK_OK(sgrt_laser_array(result, SGRT_LASER_ANGLE, &v));
  for (i = 1; i < kFrames; ++i) CHECK(((const double*)v.data)[i] > ((const double*)v.data)[i - 1]);
  sgrt_surface_free(surface);
}

static void test_sweep(const sgrt_rig* rig) {
  const sgrt_view frames = sgrt_view_of(images, SGRT_U8, kFrames, kHeight, kWidth);
  const sgrt_view angle = sgrt_view_of(angles, SGRT_F64, kFrames, 0, 0);
  const sgrt_view time = sgrt_view_of(times, SGRT_F64, kFrames, 0, 0);
  sgrt_laser* result = NULL;
  sgrt_laser_session* session = NULL;
  sgrt_laser_column column;
  int i;
  CHECK_OK(sgrt_laser_sweep(NULL, rig, "scanner", &frames, NULL, &angle, &time, NULL, NULL, NULL, NULL, &result));
  check_points(result);
  sgrt_laser_free(result);
  result = NULL;
  CHECK_OK(sgrt_laser_session_create(NULL, rig, "scanner", NULL, NULL, &session));
  CHECK_STATUS(sgrt_laser_session_finish(NULL, session, NULL, NULL, &result), SGRT_E_INSUFFICIENT_DATA, "");
  column.struct_size = sizeof column;
  for (i = kFrames - 1; i >= 0; --i) { /* backwards: sorted */
    const sgrt_view image = sgrt_view_of(images[i], SGRT_U8, kHeight, kWidth, 0);
    CHECK_OK(sgrt_laser_session_push(NULL, session, &image, NULL, angles[i], (double)(kFrames - i), &column));
    CHECK(column.point_count > kHeight - 20 && column.point_count <= column.stripe_count);
    CHECK_STATUS(sgrt_laser_session_push(NULL, session, &image, NULL, angles[i], 100, NULL), SGRT_E_INVALID_ARGUMENT,
                 "");
    CHECK(strstr(sgrt_last_error(), "angle_rad"));
    CHECK_STATUS(sgrt_laser_session_push(NULL, session, &image, NULL, 9, 0.5, NULL), SGRT_E_INVALID_ARGUMENT, "");
    CHECK(strstr(sgrt_last_error(), "time_s"));
  }
  CHECK_OK(sgrt_laser_session_finish(NULL, session, NULL, NULL, &result));
  check_points(result);
  sgrt_laser_free(result);
  sgrt_laser_session_free(session);
}

/* REQ-LASER-004 */
static void test_track(const sgrt_rig* rig) {
  /* The body rises by 8 mm over the sweep; the track knows. */
  static uint8_t moving[kFrames][kHeight][kWidth];
  static double centre[kHeight];
  double track_time[2] = {0, 8}, poses[32] = {0}, plane[4];
  const sgrt_view angle = sgrt_view_of(angles, SGRT_F64, kFrames, 0, 0);
  const sgrt_view time = sgrt_view_of(times, SGRT_F64, kFrames, 0, 0);
  sgrt_view track = sgrt_view_of(track_time, SGRT_F64, 2, 0, 0), pose = sgrt_view_of(poses, SGRT_F64, 2, 4, 4);
  sgrt_view frames = sgrt_view_of(moving, SGRT_U8, kFrames, kHeight, kWidth);
  sgrt_laser* result = NULL;
  int i;
  for (i = 0; i < 8; ++i) poses[i / 4 * 16 + i % 4 * 5] = 1;
  poses[16 + 11] = 8;
  for (i = 0; i < kFrames; ++i) {
    CHECK_OK(sgrt_laser_plane(rig, "scanner", angles[i], plane));
    render(plane, 20 + times[i], moving[i], centre);
  }
  CHECK_OK(sgrt_laser_sweep(NULL, rig, "scanner", &frames, NULL, &angle, &time, &track, &pose, NULL, NULL, &result));
  check_points(result);
  sgrt_laser_free(result);
  result = NULL;
  track_time[1] = 7; /* does not reach to the last frame */
  CHECK_STATUS(sgrt_laser_sweep(NULL, rig, "scanner", &frames, NULL, &angle, &time, &track, &pose, NULL, NULL, &result),
               SGRT_E_INVALID_ARGUMENT, "");
  CHECK(result == NULL);
}

static void test_signal(const sgrt_rig* rig) {
  const sgrt_view image = sgrt_view_of(images[4], SGRT_U8, kHeight, kWidth, 0);
  double point[3], axis[3] = {0, 0, 1}, value = -1, sigma = -1;
  cut(17, centres[4][120], 120, point);
  point[2] -= 2;
  CHECK_OK(sgrt_laser_signal(NULL, rig, "scanner", &image, NULL, angles[4], NULL, point, axis, 15, &value, &sigma));
  CHECK_NEAR(value, 20 + 0.1 * point[0] - 0.05 * point[1] - point[2], 0.3);
  CHECK(sigma > 0 && sigma < 0.1);
  point[0] += 100;
  CHECK_STATUS(sgrt_laser_signal(NULL, rig, "scanner", &image, NULL, angles[4], NULL, point, axis, 15, &value, &sigma),
               SGRT_E_NOT_FOUND, "");
  CHECK(isnan(value) && isnan(sigma));
}

static void test_bad(const sgrt_rig* rig) {
  static uint8_t dark[kHeight][kWidth];
  const sgrt_view frames = sgrt_view_of(images, SGRT_U8, kFrames, kHeight, kWidth);
  const sgrt_view black = sgrt_view_of(dark, SGRT_U8, 1, kHeight, kWidth);
  const sgrt_view angle = sgrt_view_of(angles, SGRT_F64, kFrames, 0, 0), one = sgrt_view_of(angles, SGRT_F64, 1, 0, 0);
  double twice[kFrames] = {0}, plane[4];
  const sgrt_view same = sgrt_view_of(twice, SGRT_F64, kFrames, 0, 0);
  sgrt_laser* result = NULL;
  sgrt_surface* surface = NULL;
  CHECK_STATUS(sgrt_laser_plane(rig, "nobody", 0, plane), SGRT_E_INVALID_ARGUMENT, "");
  CHECK_STATUS(sgrt_laser_plane(rig, "broken", 0, plane), SGRT_E_FORMAT, "");
  CHECK_STATUS(sgrt_laser_plane(NULL, "flat", 0, plane), SGRT_E_INVALID_ARGUMENT, "");
  CHECK_OK(sgrt_laser_plane(rig, "flat", 3, plane));
  CHECK_NEAR(plane[0], 1, 1e-12);
  CHECK_STATUS(sgrt_laser_sweep(NULL, rig, "scanner", &frames, NULL, &same, NULL, NULL, NULL, NULL, NULL, &result),
               SGRT_E_INVALID_ARGUMENT, "");
  CHECK_STATUS(sgrt_laser_sweep(NULL, rig, "scanner", &frames, NULL, &one, NULL, NULL, NULL, NULL, NULL, &result),
               SGRT_E_INVALID_ARGUMENT, "");
  CHECK_STATUS(sgrt_laser_sweep(NULL, rig, "scanner", NULL, NULL, &angle, NULL, NULL, NULL, NULL, NULL, &result),
               SGRT_E_INVALID_ARGUMENT, "");
  CHECK(result == NULL);
  CHECK_STATUS(sgrt_laser_sweep(NULL, rig, "scanner", &black, NULL, &one, NULL, NULL, NULL, NULL, NULL, &result),
               SGRT_E_NOT_FOUND, "");
  CHECK(result != NULL);
  CHECK_STATUS(sgrt_laser_surface(result, &surface), SGRT_E_NOT_FOUND, "");
  sgrt_laser_free(result);
  result = NULL;
  CHECK_STATUS(sgrt_laser_sweep(NULL, rig, "flat", &frames, NULL, &angle, NULL, NULL, NULL, NULL, NULL, &result),
               SGRT_E_DEGENERATE, ""); /* through the camera's centre: parallel to its rays */
  sgrt_laser_free(result);
  sgrt_laser_free(NULL);
  sgrt_stripe_free(NULL);
  sgrt_laser_session_free(NULL);
}

int main(void) {
  sgrt_rig* rig = make_rig();
  int i;
  for (i = 0; i < kFrames; ++i) {
    double plane[4];
    angles[i] = -0.02 + 0.005 * i;
    times[i] = i;
    CHECK_OK(sgrt_laser_plane(rig, "scanner", angles[i], plane));
    render(plane, 20, images[i], centres[i]);
  }
  test_stripe();
  test_sweep(rig);
  test_track(rig);
  test_signal(rig);
  test_bad(rig);
  sgrt_rig_free(rig);
  return check_result();
}
