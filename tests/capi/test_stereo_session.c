/* The session: what it lends and for how long, time, errors in between, and that the steady state allocates nothing. */
#include "allocations.h"
#include "scene.h"

static uint8_t left[2][kPixels], right[2][kPixels], blank[kPixels];

/* Two pictures of the plane, at heights of 20 and 30 mm. */
static sgrt_status push(sgrt_context* context, sgrt_stereo_session* session, int which, double time_s,
                        const sgrt_stereo** result) {
  const sgrt_view l = view_u8(left[which]), r = view_u8(right[which]);
  return sgrt_stereo_session_push(context, session, &l, &r, time_s, result);
}

static double mean_height(const sgrt_surface* surface) {
  sgrt_view v;
  double sum = 0;
  int64_t i, n = 0;
  CHECK_OK(sgrt_surface_array(surface, SGRT_SURFACE_POINTS, &v));
  for (i = 0; i < v.shape[0] * v.shape[1]; ++i) {
    const double* x = (const double*)v.data + 3 * i;
    if (!isnan(x[0])) sum += x[2] - plane_z(0, x[0], x[1]), ++n;
  }
  return sum / n;
}

static double height_of(const sgrt_stereo* result) {
  sgrt_surface* surface = NULL;
  double height;
  CHECK_OK(sgrt_stereo_surface(result, &surface));
  if (!surface) return NAN;
  height = mean_height(surface);
  sgrt_surface_free(surface);
  return height;
}

static void test_lending(sgrt_stereo_session* session) {
  const sgrt_stereo *first = NULL, *second = NULL;
  sgrt_surface* kept = NULL;
  double copy[3];
  sgrt_view v;
  CHECK_OK(push(NULL, session, 0, 0, &first));
  CHECK_NEAR(height_of(first), 20, 0.1);
  CHECK_OK(sgrt_stereo_surface(first, &kept));
  CHECK_OK(sgrt_surface_array(kept, SGRT_SURFACE_POINTS, &v));
  memcpy(copy, (const double*)v.data + v.shape[0] / 2 * v.shape[1] * 3, sizeof copy);
  CHECK_OK(push(NULL, session, 1, 0, &second)); /* equal times are fine */
  CHECK_NEAR(height_of(second), 30, 0.1);
  CHECK_NEAR(mean_height(kept), 20, 0.1); /* what was taken outlives the push */
  CHECK(!memcmp(copy, (const double*)v.data + v.shape[0] / 2 * v.shape[1] * 3, sizeof copy));
  CHECK_OK(push(NULL, session, 0, 0.04, &second));
  CHECK_NEAR(mean_height(kept), 20, 0.1);
  sgrt_surface_free(kept);
}

/* REQ-STEREO-008 */
static void test_errors_in_between(sgrt_stereo_session* session) {
  const sgrt_view l = view_u8(left[0]), b = view_u8(blank), small = sgrt_view_of(blank, SGRT_U8, 10, 10, 0);
  const sgrt_stereo* result = CANARY(const sgrt_stereo);
  sgrt_stereo_info info;
  int calls = 0;
  sgrt_context* context = context_of(2, cancel, &calls);
  CHECK_INVALID(sgrt_stereo_session_push(NULL, NULL, &l, &l, 1, &result), "session: NULL");
  CHECK(result == NULL);
  CHECK_INVALID(sgrt_stereo_session_push(NULL, session, &l, &l, 1, NULL), "result: NULL");
  CHECK_INVALID(sgrt_stereo_session_push(NULL, session, NULL, &l, 1, &result), "left: NULL");
  CHECK_INVALID(sgrt_stereo_session_push(NULL, session, &l, NULL, 1, &result), "right: NULL");
  CHECK_INVALID(sgrt_stereo_session_push(NULL, session, &l, &small, 1, &result), "right: 10 x 10");
  CHECK_INVALID(push(NULL, session, 0, NAN, &result), "time_s[0]: nan");
  CHECK_INVALID(push(NULL, session, 0, INFINITY, &result), "time_s[0]: inf");
  CHECK_OK(push(NULL, session, 0, 1, &result));
  CHECK(result != NULL);
  CHECK_INVALID(push(NULL, session, 0, 0.5, &result), "time_s: 0.5, expected at least that of the push before, 1");
  CHECK(result == NULL);
  CHECK_STATUS(push(context, session, 0, 2, &result), SGRT_E_CANCELLED, "cancelled");
  CHECK(result == NULL && calls > 0);
  CHECK_STATUS(sgrt_stereo_session_push(NULL, session, &b, &b, 2, &result), SGRT_E_NOT_FOUND, "matched");
  CHECK(result != NULL); /* it tells why */
  info.struct_size = sizeof info;
  if (result) CHECK_OK(sgrt_stereo_summary(result, &info));
  if (result) CHECK(info.point_count == 0 && info.reason_count[SGRT_REASON_NO_TEXTURE] > 0);
  CHECK_OK(push(NULL, session, 1, 3, &result)); /* and the session goes on */
  CHECK_NEAR(height_of(result), 30, 0.1);
  sgrt_context_free(context);
}

/* The numbers of a push are those of a match, at any number of threads. */
/* REQ-STEREO-007 */
static void test_the_session_matches_as_a_single_call(const sgrt_rig* rig, sgrt_stereo_session* session) {
  const sgrt_view l = view_u8(left[1]), r = view_u8(right[1]);
  const sgrt_stereo* lent = NULL;
  sgrt_stereo* alone = NULL;
  sgrt_context* context = context_of(3, NULL, NULL);
  sgrt_view a, b;
  CHECK_OK(sgrt_stereo_match(NULL, rig, "pod", &l, &r, NULL, &alone));
  CHECK_OK(push(context, session, 1, 10, &lent));
  CHECK_OK(sgrt_stereo_array(alone, SGRT_STEREO_RIGHT_PX, &a));
  CHECK_OK(sgrt_stereo_array(lent, SGRT_STEREO_RIGHT_PX, &b));
  CHECK(!memcmp(a.data, b.data, (size_t)(a.shape[0] * a.strides[0])));
  sgrt_stereo_free(alone);
  sgrt_context_free(context);
}

/* REQ-STEREO-007 */
static void test_the_steady_state_allocates_nothing(sgrt_stereo_session* session) {
  const sgrt_stereo* result = NULL;
  int i;
  CHECK_OK(push(NULL, session, 0, 40, &result));
  CHECK_OK(push(NULL, session, 1, 40, &result));
  allocations = 0;
  counting = 1;
  for (i = 0; i < 4; ++i) CHECK_OK(push(NULL, session, i % 2, 40, &result));
  counting = 0;
  CHECK(allocations == 0);
  if (allocations) fprintf(stderr, "%ld allocations in 4 pushes\n", allocations);
}

/* Live mode: near an earlier surface, in a part of it; then everywhere again. */
static void test_a_prior(sgrt_stereo_session* session) {
  const double low[3] = {-30, -30, -500}, high[3] = {30, 30, 500};
  sgrt_stereo_prior_options options;
  sgrt_stereo_info all, part;
  const sgrt_stereo* result = NULL;
  sgrt_surface* prior = NULL;
  sgrt_roi* roi = NULL;
  all.struct_size = part.struct_size = sizeof all;
  CHECK_OK(push(NULL, session, 0, 40, &result));
  CHECK_OK(sgrt_stereo_summary(result, &all));
  CHECK_OK(sgrt_stereo_surface(result, &prior));
  CHECK_OK(sgrt_roi_from_box(low, high, &roi));
  CHECK_OK(sgrt_stereo_prior_options_init(&options, sizeof options));
  CHECK(options.follow == 0 && options.band_mm == 25);
  CHECK_INVALID(sgrt_stereo_session_set_prior(NULL, NULL, prior, roi, &options), "session: NULL");
  CHECK_INVALID(sgrt_stereo_session_set_prior(NULL, session, NULL, roi, &options), "roi: given without a prior");
  options.follow = 2;
  CHECK_INVALID(sgrt_stereo_session_set_prior(NULL, session, prior, roi, &options), "follow: 2");
  options.follow = 1;
  options.band_mm = NAN;
  CHECK_INVALID(sgrt_stereo_session_set_prior(NULL, session, prior, roi, &options), "band_mm: nan");
  options.band_mm = 20;
  CHECK_OK(sgrt_stereo_session_set_prior(NULL, session, prior, roi, &options));
  CHECK_OK(push(NULL, session, 1, 40, &result)); /* 10 mm higher than the prior */
  CHECK_OK(sgrt_stereo_summary(result, &part));
  CHECK(part.point_count > 50 && part.point_count < all.point_count / 2);
  CHECK(part.width < all.width && part.height < all.height);
  CHECK_NEAR(height_of(result), 30, 0.1);
  test_the_steady_state_allocates_nothing(session);
  CHECK_OK(sgrt_stereo_session_set_prior(NULL, session, NULL, NULL, NULL));
  CHECK_OK(push(NULL, session, 0, 40, &result));
  CHECK_OK(sgrt_stereo_summary(result, &part));
  CHECK(part.point_count == all.point_count);
  sgrt_roi_free(roi);
  sgrt_surface_free(prior);
}

static void test_bad_arguments(const sgrt_rig* rig) {
  sgrt_stereo_session* session = CANARY(sgrt_stereo_session);
  CHECK_INVALID(sgrt_stereo_session_create(NULL, NULL, "pod", NULL, &session), "rig: NULL");
  CHECK_INVALID(sgrt_stereo_session_create(NULL, rig, NULL, NULL, &session), "pair_id: NULL");
  CHECK_INVALID(sgrt_stereo_session_create(NULL, rig, "none", NULL, &session), "none");
  CHECK_INVALID(sgrt_stereo_session_create(NULL, rig, "pod", NULL, NULL), "session: NULL");
  CHECK_STATUS(sgrt_stereo_session_create(NULL, rig, "in line", NULL, &session), SGRT_E_DEGENERATE, "baseline");
  CHECK(session == CANARY(sgrt_stereo_session));
  sgrt_stereo_session_free(NULL);
}

int main(void) {
  sgrt_rig* rig = scene_rig();
  sgrt_stereo_session* session = NULL;
  render_u8(-75, 20, left[0]);
  render_u8(75, 20, right[0]);
  render_u8(-75, 30, left[1]);
  render_u8(75, 30, right[1]);
  memset(blank, 128, sizeof blank);
  CHECK_OK(sgrt_stereo_session_create(NULL, rig, "pod", NULL, &session));
  if (!session) return 2;
  test_lending(session);
  test_errors_in_between(session);
  test_the_session_matches_as_a_single_call(rig, session);
  test_the_steady_state_allocates_nothing(session);
  test_a_prior(session);
  test_bad_arguments(rig);
  sgrt_stereo_session_free(session);
  sgrt_rig_free(rig);
  return check_result();
}
