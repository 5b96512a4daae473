/* Advice on regions through C: forecasts, their order, a proposal, and what is refused. */
#include "surfaces.h"

enum { kSide = 50, kPoints = kSide * kSide };

static const double kIso[3] = {0, 0, 0};

/* A lump without symmetry. */
static sgrt_surface* lump(void) {
  static double x[kPoints * 3];
  sgrt_surface_data data;
  int i, j;
  for (i = 0; i < kSide; ++i) {
    for (j = 0; j < kSide; ++j) {
      double* p = x + 3 * (i * kSide + j);
      p[0] = 4.0 * (j - kSide / 2), p[1] = 4.0 * (i - kSide / 2);
      p[2] = 60 * cos(p[0] / 90) * cos(p[1] / 150) + 9 * sin(p[0] / 23 + 0.4) * cos(p[1] / 31);
    }
  }
  data = data_of(x, kPoints);
  return make(&data);
}

static sgrt_roi* square(double half) {
  const double v[8] = {-half, -half, half, -half, half, half, -half, half};
  const sgrt_view vertices = sgrt_view_of(v, SGRT_F64, 4, 2, 0);
  sgrt_roi* roi = NULL;
  CHECK_OK(sgrt_roi_from_polygon(&vertices, &roi));
  return roi;
}

static void test_ranks(const sgrt_surface* surface) {
  sgrt_roi *small = square(20), *large = square(70), *again = NULL;
  const sgrt_roi* candidates[2];
  sgrt_advice* advice = NULL;
  sgrt_advice_info info;
  sgrt_view view;
  const double* rows;
  candidates[0] = small, candidates[1] = large;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_roi_advise(NULL, surface, kIso, candidates, 2, NULL, &advice));
  CHECK_OK(sgrt_advice_summary(advice, &info));
  CHECK(info.candidate_count == 2 && info.best == 1);
  CHECK_OK(sgrt_advice_array(advice, SGRT_ADVICE_FORECAST, &view));
  CHECK(view.ndim == 2 && view.shape[0] == 3 && view.shape[1] == 5);
  rows = (const double*)view.data;
  CHECK(rows[0] > rows[5] && rows[1] > rows[6] && rows[2] < rows[7] && rows[3] > rows[8]);
  CHECK(rows[10] > 0 && rows[12] < 1.1 * rows[7]);
  CHECK_OK(sgrt_advice_array(advice, SGRT_ADVICE_ORDER, &view));
  CHECK(view.dtype == SGRT_I32 && ((const int32_t*)view.data)[0] == 1 && ((const int32_t*)view.data)[1] == 0);
  CHECK_OK(sgrt_advice_array(advice, SGRT_ADVICE_POLYGON, &view));
  CHECK(view.shape[1] == 2);
  CHECK_OK(sgrt_roi_from_polygon(&view, &again));
  CHECK_INVALID(sgrt_advice_array(advice, 9, &view), "field");
  CHECK(sgrt_advice_text(advice, 0)[0] && sgrt_advice_text(advice, 2)[0]);
  CHECK(!sgrt_advice_text(advice, 3) && !sgrt_advice_text(advice, -1) && !sgrt_advice_text(NULL, 0));
  sgrt_advice_free(advice);
  sgrt_advice_free(NULL);
  advice = NULL;
  CHECK_OK(sgrt_roi_advise(NULL, surface, kIso, NULL, 0, NULL, &advice));
  CHECK_OK(sgrt_advice_summary(advice, &info));
  CHECK(info.candidate_count == 0 && info.best == -1 && info.better == 1);
  sgrt_advice_free(advice);
  sgrt_roi_free(small), sgrt_roi_free(large), sgrt_roi_free(again);
}

static void test_refuses(const sgrt_surface* surface) {
  const sgrt_roi* none[1];
  sgrt_advice* advice = NULL;
  sgrt_advice_options options;
  none[0] = NULL;
  CHECK_INVALID(sgrt_roi_advise(NULL, NULL, kIso, NULL, 0, NULL, &advice), "reference");
  CHECK_INVALID(sgrt_roi_advise(NULL, surface, NULL, NULL, 0, NULL, &advice), "isocentre_mm");
  CHECK_INVALID(sgrt_roi_advise(NULL, surface, kIso, NULL, 1, NULL, &advice), "candidates");
  CHECK_INVALID(sgrt_roi_advise(NULL, surface, kIso, none, 1, NULL, &advice), "candidates[0]");
  CHECK_INVALID(sgrt_roi_advise(NULL, surface, kIso, none, -1, NULL, &advice), "count");
  CHECK_INVALID(sgrt_roi_advise(NULL, surface, kIso, NULL, 0, NULL, NULL), "result");
  CHECK_OK(sgrt_advice_options_init(&options, sizeof options));
  CHECK_NEAR(options.live_sigma_mm, 0.3, 0);
  options.max_share = 2;
  CHECK_INVALID(sgrt_roi_advise(NULL, surface, kIso, NULL, 0, &options, &advice), "options.max_share");
  CHECK(!advice);
}

int main(void) {
  sgrt_surface* surface = lump();
  test_ranks(surface);
  test_refuses(surface);
  sgrt_surface_free(surface);
  return check_result();
}
