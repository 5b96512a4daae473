/* The fit: a plane and a wave through C, its posterior, its arrays and text, bad arguments. */
#include "check.h"

enum { kPoints = 3000, kSide = 10, kSamples = kSide * kSide };
static double wave_points[3 * kPoints], plane_points[3 * kPoints];

static double wave(double x, double y) {
  return 6 * sin(x / 25) * cos(y / 30);
}

/* Uniform in (0, 1); the same on every machine. */
static double uniform(void) {
  static uint32_t state = 12345;
  state = state * 1664525u + 1013904223u;
  return ((state >> 8) + 0.5) / 16777216.0;
}
static double gauss(void) {
  return sqrt(-2 * log(uniform())) * cos(6.283185307179586 * uniform());
}

static void draw(void) {
  int i;
  for (i = 0; i < kPoints; ++i) {
    const double x = 120 * uniform() - 60, y = 120 * uniform() - 60;
    double* p = wave_points + 3 * i;
    p[0] = plane_points[3 * i] = x, p[1] = plane_points[3 * i + 1] = y;
    plane_points[3 * i + 2] = 3 + 0.4 * x - 0.7 * y;
    p[2] = wave(x, y) + 0.2 * gauss();
    if (i % 20 == 0) p[2] += i % 40 ? 5 + 45 * uniform() : -5 - 45 * uniform();
  }
}

static sgrt_surface* surface_of(const double* points, int64_t count) {
  sgrt_surface_data data;
  sgrt_surface* surface = NULL;
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, count, 3, 0);
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  if (!surface) exit(2);
  return surface;
}

static sgrt_nurbs_fit_options upright(void) {
  sgrt_nurbs_fit_options o;
  CHECK_OK(sgrt_nurbs_fit_options_init(&o, sizeof o));
  o.chart = SGRT_NURBS_CHART_PLANE;
  o.axis[2] = 1;
  return o;
}

static void places(double* uv) {
  int i;
  for (i = 0; i < kSamples; ++i) {
    uv[2 * i] = 0.1 + 0.8 * (i % kSide) / (kSide - 1);
    uv[2 * i + 1] = 0.1 + 0.8 * (i / kSide) / (kSide - 1);
  }
}

/* REQ-FIT-001 */
static void test_plane(void) {
  static double uv[2 * kSamples], x[3 * kSamples];
  sgrt_surface* surface = surface_of(plane_points, kPoints);
  sgrt_nurbs_fit* fit = NULL;
  sgrt_nurbs_fit_samples samples;
  const sgrt_view at = sgrt_view_of(uv, SGRT_F64, kSamples, 2, 0);
  int i;
  places(uv);
  CHECK_OK(sgrt_nurbs_fit_create(NULL, surface, NULL, &fit));
  CHECK_OK(sgrt_nurbs_fit_samples_init(&samples, sizeof samples));
  samples.points = sgrt_mut_view_of(x, SGRT_F64, kSamples, 3, 0);
  CHECK_OK(sgrt_nurbs_fit_evaluate(NULL, fit, &at, &samples));
  for (i = 0; i < kSamples; ++i) CHECK_NEAR(x[3 * i + 2], 3 + 0.4 * x[3 * i] - 0.7 * x[3 * i + 1], 1e-10);
  sgrt_nurbs_fit_free(fit);
  sgrt_surface_free(surface);
}

/* Noise of 0.2 mm and 5 % of outliers: errors as the posterior says, every outlier found, the nearest point consistent.
 */
static void test_wave(void) {
  static double uv[2 * kSamples], back[2 * kSamples], x[3 * kSamples], n[3 * kSamples], sigma[kSamples],
      support[kSamples], cov[6 * kSamples], ncov[6 * kSamples], d[15 * kSamples], dcov[30 * kSamples];
  sgrt_surface* surface = surface_of(wave_points, kPoints);
  const sgrt_nurbs_fit_options o = upright();
  const sgrt_view at = sgrt_view_of(uv, SGRT_F64, kSamples, 2, 0), foot = sgrt_view_of(x, SGRT_F64, kSamples, 3, 0);
  const sgrt_mut_view found = sgrt_mut_view_of(back, SGRT_F64, kSamples, 2, 0);
  sgrt_nurbs_fit* fit = NULL;
  sgrt_nurbs_surface* nurbs = NULL;
  sgrt_nurbs_fit_info info;
  sgrt_nurbs_fit_samples s;
  sgrt_view view;
  double chi2 = 0, worst = 0;
  int i;
  places(uv);
  CHECK_OK(sgrt_nurbs_fit_create(NULL, surface, &o, &fit));
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_nurbs_fit_summary(fit, &info));
  CHECK(info.chart == SGRT_NURBS_CHART_PLANE && !info.closed && info.point_count == kPoints);
  CHECK(info.inlier_count <= kPoints - kPoints / 20 && info.inlier_count > kPoints * 9 / 10);
  CHECK(info.noise > 0.17 && info.noise < 0.23 && info.rms_mm > 0.15 && info.rms_mm < 0.25);
  CHECK_OK(sgrt_nurbs_fit_samples_init(&s, sizeof s));
  s.points = sgrt_mut_view_of(x, SGRT_F64, kSamples, 3, 0);
  s.normals = sgrt_mut_view_of(n, SGRT_F64, kSamples, 3, 0);
  s.sigma_mm = sgrt_mut_view_of(sigma, SGRT_F64, kSamples, 0, 0);
  s.support = sgrt_mut_view_of(support, SGRT_F64, kSamples, 0, 0);
  s.covariance = sgrt_mut_view_of(cov, SGRT_F64, kSamples, 6, 0);
  s.normal_covariance = sgrt_mut_view_of(ncov, SGRT_F64, kSamples, 6, 0);
  s.derivatives = sgrt_mut_view_of(d, SGRT_F64, kSamples, 5, 3);
  s.derivative_covariance = sgrt_mut_view_of(dcov, SGRT_F64, kSamples, 5, 6);
  CHECK_OK(sgrt_nurbs_fit_evaluate(NULL, fit, &at, &s));
  for (i = 0; i < kSamples; ++i) {
    const double off = (x[3 * i + 2] - wave(x[3 * i], x[3 * i + 1])) * n[3 * i + 2];
    chi2 += off * off / (sigma[i] * sigma[i]) / kSamples;
    CHECK(n[3 * i + 2] > 0.9 && support[i] > 0.7 && sigma[i] < 0.2);
    CHECK_NEAR(sqrt(cov[6 * i + 5]) * n[3 * i + 2], sigma[i], 1e-9);
    CHECK(ncov[6 * i] > 0 && dcov[30 * i + 5] > 0);
  }
  CHECK(chi2 > 0.3 && chi2 < 1.8);
  CHECK_OK(sgrt_nurbs_fit_nearest(NULL, fit, &foot, &found));
  for (i = 0; i < 2 * kSamples; ++i) worst = fmax(worst, fabs(back[i] - uv[i]));
  CHECK(worst < 1e-8);
  CHECK_OK(sgrt_nurbs_fit_array(fit, SGRT_NURBS_FIT_WEIGHT, &view));
  CHECK(view.ndim == 1 && view.shape[0] == kPoints);
  for (i = 0; i < kPoints; i += 20) CHECK(((const double*)view.data)[i] == 0);
  CHECK_OK(sgrt_nurbs_fit_array(fit, SGRT_NURBS_FIT_RESIDUAL, &view));
  CHECK(view.shape[0] == kPoints && fabs(((const double*)view.data)[0]) > 4);
  CHECK_OK(sgrt_nurbs_fit_array(fit, SGRT_NURBS_FIT_PARAMETERS, &view));
  CHECK(view.ndim == 2 && view.shape[1] == 2);
  CHECK_OK(sgrt_nurbs_fit_surface(fit, &nurbs));
  CHECK(strstr(sgrt_nurbs_surface_text(nurbs, SGRT_NURBS_JSON), "sgrt-nurbs/1") != NULL);
  sgrt_nurbs_surface_free(nurbs);
  sgrt_nurbs_fit_free(fit);
  sgrt_surface_free(surface);
}

static void test_threads(void) {
  sgrt_surface* surface = surface_of(wave_points, kPoints);
  sgrt_nurbs_fit *one = NULL, *many = NULL;
  sgrt_nurbs_surface *a = NULL, *b = NULL;
  sgrt_context_options o;
  sgrt_context* context = NULL;
  CHECK_OK(sgrt_context_options_init(&o, sizeof o));
  o.threads = 4;
  CHECK_OK(sgrt_context_create(&o, &context));
  CHECK_OK(sgrt_nurbs_fit_create(NULL, surface, NULL, &one));
  CHECK_OK(sgrt_nurbs_fit_create(context, surface, NULL, &many));
  CHECK_OK(sgrt_nurbs_fit_surface(one, &a));
  CHECK_OK(sgrt_nurbs_fit_surface(many, &b));
  CHECK(!strcmp(sgrt_nurbs_surface_text(a, SGRT_NURBS_JSON), sgrt_nurbs_surface_text(b, SGRT_NURBS_JSON)));
  sgrt_nurbs_surface_free(a);
  sgrt_nurbs_surface_free(b);
  sgrt_nurbs_fit_free(one);
  sgrt_nurbs_fit_free(many);
  sgrt_context_free(context);
  sgrt_surface_free(surface);
}

#define BAD_OPTION(member, value, words)                                  \
  do {                                                                    \
    CHECK_OK(sgrt_nurbs_fit_options_init(&o, sizeof o));                  \
    o.member = value;                                                     \
    CHECK_INVALID(sgrt_nurbs_fit_create(NULL, surface, &o, &fit), words); \
  } while (0)

static void test_bad_arguments(void) {
  static double line[300], uv[4] = {0.5, 0.5, 1.5, 0}, out[8];
  sgrt_surface *surface = surface_of(wave_points, kPoints), *few = surface_of(wave_points, 15), *thin;
  sgrt_nurbs_fit* const canary = (sgrt_nurbs_fit*)(void*)uv;
  sgrt_nurbs_fit* fit = canary;
  sgrt_nurbs_surface* nurbs = NULL;
  sgrt_nurbs_fit_options o;
  sgrt_nurbs_fit_info info;
  sgrt_nurbs_fit_samples s;
  sgrt_nurbs_fit* twin = NULL;
  int64_t count = 0;
  sgrt_view view, at = sgrt_view_of(uv, SGRT_F64, 1, 2, 0), two = sgrt_view_of(uv, SGRT_F64, 2, 2, 0);
  sgrt_mut_view place = sgrt_mut_view_of(out, SGRT_F64, 1, 2, 0);
  int i;
  for (i = 0; i < 100; ++i) line[3 * i] = i, line[3 * i + 1] = 2 * i;
  thin = surface_of(line, 100);
  BAD_OPTION(chart, 5, "options.chart: 5");
  BAD_OPTION(chart, SGRT_NURBS_CHART_GRID, "not organised");
  BAD_OPTION(smoothing, -1, "options.smoothing: -1");
  BAD_OPTION(robust, 2, "options.robust: 2");
  BAD_OPTION(reserved, 1, "options.reserved: 1");
  BAD_OPTION(control_points[1], 3, "options.control_points[1]: 3, expected 4 to 2000");
  BAD_OPTION(max_control_points, 4, "options.max_control_points: 4");
  BAD_OPTION(axis[0], NAN, "options.axis");
  BAD_OPTION(lambda, -1, "options.lambda: -1");
  BAD_OPTION(tukey, 1, "options.tukey: 1");
  BAD_OPTION(struct_size, 4, "options.struct_size: 4");
  CHECK_INVALID(sgrt_nurbs_fit_create(NULL, NULL, NULL, &fit), "surface: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_create(NULL, surface, NULL, NULL), "fit: NULL");
  CHECK_STATUS(sgrt_nurbs_fit_create(NULL, few, NULL, &fit), SGRT_E_INSUFFICIENT_DATA,
               "15 points, expected at least 16");
  CHECK_STATUS(sgrt_nurbs_fit_create(NULL, thin, NULL, &fit), SGRT_E_DEGENERATE, "line");
  CHECK(fit == canary);
  CHECK_OK(sgrt_nurbs_fit_create(NULL, surface, NULL, &fit));
  info.struct_size = 4;
  CHECK_INVALID(sgrt_nurbs_fit_summary(fit, &info), "info.struct_size: 4");
  CHECK_INVALID(sgrt_nurbs_fit_summary(fit, NULL), "info: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_summary(NULL, &info), "fit: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_array(fit, 4, &view), "field: 4");
  CHECK_INVALID(sgrt_nurbs_fit_surface(fit, NULL), "surface: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_surface(NULL, &nurbs), "fit: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_array(fit, 1, NULL), "view: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_array(NULL, 1, &view), "fit: NULL");
  CHECK_OK(sgrt_nurbs_fit_samples_init(&s, sizeof s));
  CHECK_OK(sgrt_nurbs_fit_evaluate(NULL, fit, &at, &s));
  CHECK_INVALID(sgrt_nurbs_fit_evaluate(NULL, NULL, &at, &s), "fit: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_evaluate(NULL, fit, NULL, &s), "uv: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_evaluate(NULL, fit, &at, NULL), "samples: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_evaluate(NULL, fit, &two, &s), "uv: 1.5, expected parameters from 0 to 1");
  s.points = place;
  CHECK_INVALID(sgrt_nurbs_fit_evaluate(NULL, fit, &at, &s), "samples.points: shape 1 x 2");
  s.points = sgrt_mut_view_of(uv, SGRT_F64, 1, 3, 0);
  CHECK_INVALID(sgrt_nurbs_fit_evaluate(NULL, fit, &at, &s), "samples.points");
  view = sgrt_view_of(wave_points, SGRT_F64, 1, 3, 0);
  CHECK_OK(sgrt_nurbs_fit_nearest(NULL, fit, &view, &place));
  CHECK_INVALID(sgrt_nurbs_fit_nearest(NULL, fit, NULL, &place), "points");
  CHECK_INVALID(sgrt_nurbs_fit_nearest(NULL, fit, &view, NULL), "uv: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_nearest(NULL, NULL, &view, &place), "fit: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_state(NULL, NULL, &count), "fit: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_state(fit, NULL, NULL), "count: NULL");
  CHECK_OK(sgrt_nurbs_fit_state(fit, NULL, &count));
  CHECK(count > 100);
  CHECK_INVALID(sgrt_nurbs_fit_state(fit, &place, NULL), "numbers: shape 1 x 2");
  CHECK_INVALID(sgrt_nurbs_fit_from_state(NULL, &twin), "numbers: NULL");
  view = sgrt_view_of(wave_points, SGRT_F64, 7, 0, 0);
  CHECK_INVALID(sgrt_nurbs_fit_from_state(&view, NULL), "fit: NULL");
  CHECK_INVALID(sgrt_nurbs_fit_from_state(&view, &twin), "expected the state of a fit");
  CHECK(twin == NULL);
  sgrt_nurbs_fit_free(fit);
  sgrt_nurbs_fit_free(NULL);
  sgrt_surface_free(surface);
  sgrt_surface_free(few);
  sgrt_surface_free(thin);
}

/* There and back: the same numbers again. */
/* REQ-FIT-005 */
static void test_state(void) {
  sgrt_surface* surface = surface_of(wave_points, 500);
  sgrt_nurbs_fit *fit = NULL, *twin = NULL;
  int64_t count = 0, again = 0;
  double *a, *b;
  sgrt_mut_view out;
  sgrt_view in;
  CHECK_OK(sgrt_nurbs_fit_create(NULL, surface, NULL, &fit));
  CHECK_OK(sgrt_nurbs_fit_state(fit, NULL, &count));
  a = malloc((size_t)count * sizeof *a), b = malloc((size_t)count * sizeof *b);
  out = sgrt_mut_view_of(a, SGRT_F64, count, 0, 0);
  CHECK_OK(sgrt_nurbs_fit_state(fit, &out, NULL));
  in = sgrt_view_of(a, SGRT_F64, count, 0, 0);
  CHECK_OK(sgrt_nurbs_fit_from_state(&in, &twin));
  out = sgrt_mut_view_of(b, SGRT_F64, count, 0, 0);
  CHECK_OK(sgrt_nurbs_fit_state(twin, &out, &again));
  CHECK(again == count && memcmp(a, b, (size_t)count * sizeof *a) == 0);
  free(a), free(b);
  sgrt_nurbs_fit_free(fit);
  sgrt_nurbs_fit_free(twin);
  sgrt_surface_free(surface);
}

int main(void) {
  draw();
  test_plane();
  test_wave();
  test_threads();
  test_state();
  test_bad_arguments();
  return check_result();
}
