/* Stereo: positions on a rendered plane, reasons, types and strides of images, bad arguments. */
#include "scene.h"

static uint8_t left[kPixels], right[kPixels], blank[kPixels];

static sgrt_stereo* match(sgrt_context* context, const sgrt_rig* rig, const sgrt_view* l, const sgrt_view* r) {
  sgrt_stereo* result = NULL;
  CHECK_OK(sgrt_stereo_match(context, rig, "pod", l, r, NULL, &result));
  if (!result) exit(2);
  return result;
}

static sgrt_view array_of(const sgrt_stereo* result, int32_t field) {
  sgrt_view view;
  CHECK_OK(sgrt_stereo_array(result, field, &view));
  return view;
}

static sgrt_stereo_info summary_of(const sgrt_stereo* result) {
  sgrt_stereo_info info;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_stereo_summary(result, &info));
  return info;
}

/* Every point lies on the plane as well as its sigma says, and where its pixel says. */
static void test_positions(const sgrt_rig* rig) {
  const sgrt_view l = view_u8(left), r = view_u8(right);
  sgrt_stereo* result = match(NULL, rig, &l, &r);
  const sgrt_stereo_info info = summary_of(result);
  sgrt_surface* surface = NULL;
  sgrt_view v;
  const double *x, *pixel, *n, *sigma;
  double sum = 0, sum2 = 0, chi2 = 0;
  int64_t i, count = 0;
  CHECK_OK(sgrt_stereo_surface(result, &surface));
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_POINTS, &v));
  CHECK(v.ndim == 3 && v.shape[0] == info.height && v.shape[1] == info.width);
  x = (const double*)v.data;
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_NORMALS, &v));
  n = (const double*)v.data;
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_SIGMA, &v));
  sigma = (const double*)v.data;
  v = array_of(result, SGRT_STEREO_LEFT_PX);
  CHECK(v.dtype == SGRT_F64 && v.ndim == 3 && v.shape[2] == 2);
  pixel = (const double*)v.data;
  for (i = 0; i < (int64_t)info.height * info.width; ++i) {
    double off;
    if (isnan(x[3 * i])) continue;
    off = (x[3 * i + 2] - plane_z(20, x[3 * i], x[3 * i + 1])) / sqrt(1 + 0.1 * 0.1 + 0.05 * 0.05);
    sum += off, sum2 += off * off, chi2 += off * off / (sigma[i] * sigma[i]);
    CHECK_NEAR(pixel[2 * i], 600 * (x[3 * i] + 75) / (1000 - x[3 * i + 2]) + 159.5, 0.01);
    CHECK_NEAR(pixel[2 * i + 1], 600 * -x[3 * i + 1] / (1000 - x[3 * i + 2]) + 119.5, 0.01);
    if (!isnan(n[3 * i])) CHECK(n[3 * i + 2] > 0.95);
    ++count;
  }
  /* Grey levels are whole numbers, 0.3 levels of noise on a contrast of 40: about 0.01 px, and 0.1 mm here. */
  printf("stereo: %d points, mean %.4f mm, rms %.4f mm, rms / sigma %.2f, median sigma %.4f px\n", (int)count,
         sum / count, sqrt(sum2 / count), sqrt(chi2 / count), info.median_sigma_px);
  CHECK(count == info.point_count && count > 1500);
  CHECK(fabs(sum / count) < 0.05);
  CHECK(sqrt(sum2 / count) < 0.25);
  sgrt_surface_free(surface);
  sgrt_stereo_free(result);
}

static void test_arrays_and_reasons(const sgrt_rig* rig) {
  const sgrt_view l = view_u8(left), r = view_u8(right);
  sgrt_stereo* result = match(NULL, rig, &l, &r);
  const sgrt_stereo_info info = summary_of(result);
  const sgrt_view reason = array_of(result, SGRT_STEREO_REASON), zncc = array_of(result, SGRT_STEREO_CORRELATION);
  const sgrt_view sigma = array_of(result, SGRT_STEREO_SIGMA_PX), rpx = array_of(result, SGRT_STEREO_RIGHT_PX);
  int64_t i, sum = 0, counted[16] = {0};
  CHECK(reason.dtype == SGRT_U8 && zncc.dtype == SGRT_F32 && sigma.dtype == SGRT_F32 && rpx.dtype == SGRT_F64);
  CHECK(reason.ndim == 2 && reason.shape[0] == info.height && reason.shape[1] == info.width);
  for (i = 0; i < (int64_t)info.height * info.width; ++i) {
    const uint8_t why = ((const uint8_t*)reason.data)[i];
    const float c = ((const float*)zncc.data)[i];
    CHECK(why < SGRT_REASON_COUNT);
    ++counted[why < 16 ? why : 15];
    if (why == SGRT_REASON_NONE) CHECK(c >= 0.8f && c <= 1.0001f && ((const float*)sigma.data)[i] > 0);
    if (why != SGRT_REASON_NONE) CHECK(isnan(((const double*)rpx.data)[2 * i]));
  }
  for (i = 0; i < 16; ++i) {
    CHECK(info.reason_count[i] == counted[i]);
    sum += info.reason_count[i];
  }
  CHECK(sum == (int64_t)info.height * info.width && info.reason_count[0] == info.point_count);
  sgrt_stereo_free(result);
}

/* The same picture as u8, u16, f32, and by strides: the same surface. */
static void test_types_and_strides(const sgrt_rig* rig) {
  static uint16_t wide[2][kPixels];
  static float single[2][kPixels];
  static uint8_t upside_down[2][kHeight][2 * kWidth];
  sgrt_view views[4][2];
  double expected[3] = {NAN, NAN, NAN};
  int i, k, j;
  for (i = 0; i < kPixels; ++i) {
    for (k = 0; k < 2; ++k) {
      wide[k][i] = (k ? right : left)[i];
      single[k][i] = (k ? right : left)[i];
      upside_down[k][kHeight - 1 - i / kWidth][2 * (i % kWidth)] = (k ? right : left)[i];
    }
  }
  for (k = 0; k < 2; ++k) {
    views[0][k] = view_u8(k ? right : left);
    views[1][k] = sgrt_view_of(wide[k], SGRT_U16, kHeight, kWidth, 0);
    views[2][k] = sgrt_view_of(single[k], SGRT_F32, kHeight, kWidth, 0);
    views[3][k] = sgrt_view_of(upside_down[k][kHeight - 1], SGRT_U8, kHeight, kWidth, 0);
    views[3][k].strides[0] = -2 * kWidth;
    views[3][k].strides[1] = 2;
  }
  for (i = 0; i < 4; ++i) {
    sgrt_stereo* result = match(NULL, rig, &views[i][0], &views[i][1]);
    sgrt_surface* surface = NULL;
    sgrt_surface_info info;
    info.struct_size = sizeof info;
    CHECK_OK(sgrt_stereo_surface(result, &surface));
    CHECK_OK(sgrt_surface_summary(surface, &info));
    for (j = 0; j < 3; ++j) {
      if (i == 0) expected[j] = info.bounds_max_mm[j];
      CHECK(info.bounds_max_mm[j] == expected[j]);
    }
    sgrt_surface_free(surface);
    sgrt_stereo_free(result);
  }
}

static void test_threads(const sgrt_rig* rig) {
  const sgrt_view l = view_u8(left), r = view_u8(right);
  sgrt_stereo* one = match(NULL, rig, &l, &r);
  int32_t threads;
  for (threads = 2; threads <= 4; ++threads) {
    sgrt_context* context = context_of(threads, NULL, NULL);
    sgrt_stereo* many = match(context, rig, &l, &r);
    const sgrt_view a = array_of(one, SGRT_STEREO_RIGHT_PX), b = array_of(many, SGRT_STEREO_RIGHT_PX);
    CHECK(a.shape[0] == b.shape[0] && !memcmp(a.data, b.data, (size_t)(a.shape[0] * a.strides[0])));
    sgrt_stereo_free(many);
    sgrt_context_free(context);
  }
  sgrt_stereo_free(one);
}

/* Pictures without texture: a status, and a result that says why. */
static void test_not_found(const sgrt_rig* rig) {
  const sgrt_view b = view_u8(blank);
  sgrt_stereo* result = NULL;
  sgrt_stereo_info info;
  CHECK_STATUS(sgrt_stereo_match(NULL, rig, "pod", &b, &b, NULL, &result), SGRT_E_NOT_FOUND, "matched");
  CHECK(result != NULL);
  if (!result) return;
  info = summary_of(result);
  CHECK(info.point_count == 0 && info.reason_count[SGRT_REASON_NONE] == 0);
  CHECK(info.reason_count[SGRT_REASON_NO_TEXTURE] > info.width * info.height / 2);
  CHECK(isnan(info.noise_left) && isnan(info.median_sigma_px) && isnan(info.median_sigma_mm));
  sgrt_stereo_free(result);
}

static void test_volume(const sgrt_rig* rig) {
  const sgrt_view l = view_u8(left), r = view_u8(right);
  sgrt_stereo_options o;
  sgrt_stereo* result = NULL;
  sgrt_surface* surface = NULL;
  sgrt_surface_info info;
  CHECK_OK(sgrt_stereo_options_init(&o, sizeof o));
  o.volume_max_mm[0] = 10;
  CHECK_OK(sgrt_stereo_match(NULL, rig, "pod", &l, &r, &o, &result));
  CHECK_OK(sgrt_stereo_surface(result, &surface));
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_surface_summary(surface, &info));
  CHECK(info.point_count > 100 && info.bounds_max_mm[0] <= 10);
  CHECK(summary_of(result).reason_count[SGRT_REASON_OUT_OF_VOLUME] > 100);
  sgrt_surface_free(surface);
  sgrt_stereo_free(result);
}

#define BAD_OPTION(member, value, words)                                              \
  do {                                                                                \
    CHECK_OK(sgrt_stereo_options_init(&o, sizeof o));                                 \
    o.member = value;                                                                 \
    CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", &l, &r, &o, &result), words);   \
    CHECK_INVALID(sgrt_stereo_session_create(NULL, rig, "pod", &o, &session), words); \
  } while (0)

static void test_bad_options(const sgrt_rig* rig) {
  const sgrt_view l = view_u8(left), r = view_u8(right);
  sgrt_stereo* result = CANARY(sgrt_stereo);
  sgrt_stereo_session* session = CANARY(sgrt_stereo_session);
  sgrt_stereo_options o;
  BAD_OPTION(window_px, 16, "window_px: 16, expected an odd number from 9 to 41");
  BAD_OPTION(window_px, 7, "window_px: 7");
  BAD_OPTION(window_px, 43, "window_px: 43");
  BAD_OPTION(stride_px, 0, "stride_px: 0, expected 1 to 32");
  BAD_OPTION(stride_px, 33, "stride_px: 33");
  BAD_OPTION(min_component, 0, "min_component: 0");
  BAD_OPTION(min_correlation, -0.1, "min_correlation: -0.1");
  BAD_OPTION(min_correlation, 1.1, "min_correlation: 1.1");
  BAD_OPTION(min_correlation, NAN, "min_correlation: nan");
  BAD_OPTION(max_left_right_px, 0, "max_left_right_px: 0");
  BAD_OPTION(max_left_right_px, NAN, "max_left_right_px: nan");
  BAD_OPTION(max_sigma_px, -1, "max_sigma_px: -1");
  BAD_OPTION(max_sigma_px, NAN, "max_sigma_px: nan");
  BAD_OPTION(volume_min_mm[1], NAN, "volume_min_mm");
  BAD_OPTION(volume_max_mm[2], -INFINITY, "volume_m");
  BAD_OPTION(struct_size, 8, "options.struct_size: 8");
  BAD_OPTION(struct_size, 8192, "options.struct_size: 8192");
  CHECK(result == CANARY(sgrt_stereo) && session == CANARY(sgrt_stereo_session));
}

/* REQ-ABI-006 */
static void test_bad_arguments(const sgrt_rig* rig) {
  const sgrt_view l = view_u8(left), r = view_u8(right);
  static double f64[kPixels];
  sgrt_view small = sgrt_view_of(left, SGRT_U8, kHeight, kWidth - 1, 0),
            wrong = sgrt_view_of(f64, SGRT_F64, kHeight, kWidth, 0);
  sgrt_stereo* result = CANARY(sgrt_stereo);
  sgrt_stereo_info info;
  sgrt_view view = l;
  sgrt_surface* surface = CANARY(sgrt_surface);
  sgrt_context* context = context_of(2, cancel, NULL);
  info.struct_size = sizeof info;
  CHECK_INVALID(sgrt_stereo_match(NULL, NULL, "pod", &l, &r, NULL, &result), "rig: NULL");
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, NULL, &l, &r, NULL, &result), "pair_id: NULL");
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", NULL, &r, NULL, &result), "left: NULL");
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", &l, NULL, NULL, &result), "right: NULL");
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", &l, &r, NULL, NULL), "result: NULL");
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod 2", &l, &r, NULL, &result), "pod 2");
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", &small, &r, NULL, &result), "left: 319 x 240");
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", &l, &small, NULL, &result), "right: 319 x 240");
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", &l, &wrong, NULL, &result),
                "right: float64, expected uint8, uint16 or float32");
  wrong = l, wrong.ndim = 3, wrong.shape[2] = 3;
  CHECK_INVALID(sgrt_stereo_match(NULL, rig, "pod", &wrong, &r, NULL, &result),
                "left: shape 240 x 320 x 3, expected any x any");
  wrong = l, wrong.shape[0] = 40000, wrong.strides[0] = 0;
  CHECK_STATUS(sgrt_stereo_match(NULL, rig, "pod", &wrong, &r, NULL, &result), SGRT_E_LIMIT, "left: 40000");
  CHECK_STATUS(sgrt_stereo_match(NULL, rig, "in line", &l, &r, NULL, &result), SGRT_E_DEGENERATE, "baseline");
  CHECK_STATUS(sgrt_stereo_match(context, rig, "pod", &l, &r, NULL, &result), SGRT_E_CANCELLED, "cancelled");
  CHECK(result == CANARY(sgrt_stereo));
  CHECK_INVALID(sgrt_stereo_summary(NULL, &info), "result: NULL");
  CHECK_INVALID(sgrt_stereo_array(NULL, 1, &view), "result: NULL");
  CHECK_INVALID(sgrt_stereo_surface(NULL, &surface), "result: NULL");
  result = match(NULL, rig, &l, &r);
  CHECK_INVALID(sgrt_stereo_summary(result, NULL), "info: NULL");
  CHECK_INVALID(sgrt_stereo_array(result, 1, NULL), "view: NULL");
  CHECK_INVALID(sgrt_stereo_array(result, 0, &view), "field: 0");
  CHECK_INVALID(sgrt_stereo_array(result, 6, &view), "field: 6");
  CHECK_INVALID(sgrt_stereo_surface(result, NULL), "surface: NULL");
  info.struct_size = 4;
  CHECK_INVALID(sgrt_stereo_summary(result, &info), "info.struct_size: 4");
  CHECK(view.data == left && surface == CANARY(sgrt_surface));
  sgrt_stereo_free(result);
  sgrt_stereo_free(NULL);
  sgrt_context_free(context);
}

int main(void) {
  sgrt_rig* rig = scene_rig();
  render_u8(-75, 20, left);
  render_u8(75, 20, right);
  memset(blank, 128, sizeof blank);
  test_positions(rig);
  test_arrays_and_reasons(rig);
  test_types_and_strides(rig);
  test_threads(rig);
  test_not_found(rig);
  test_volume(rig);
  test_bad_options(rig);
  test_bad_arguments(rig);
  sgrt_rig_free(rig);
  return check_result();
}
