/* The filters through the ABI: a noisy plane with an outlier, and the same plane over time. */
#include "allocations.h"
#include "surfaces.h"

#define SIDE 32
static double points[SIDE * SIDE][3], normals[SIDE * SIDE][3], sigma[SIDE * SIDE];
static uint8_t reason[SIDE * SIDE];

/* Uniform noise of so many mm, one sigma; the same on every machine. */
static double noise(double mm) {
  static uint32_t state = 1;
  state = state * 1664525U + 1013904223U;
  return mm * 3.4641016 * (state / 4294967296.0 - 0.5);
}

static sgrt_surface* plane(double z) {
  sgrt_surface_data data;
  int i;
  for (i = 0; i < SIDE * SIDE; ++i) {
    points[i][0] = i % SIDE;
    points[i][1] = i / SIDE;
    points[i][2] = z + noise(0.2);
    normals[i][0] = normals[i][1] = 0;
    normals[i][2] = 1;
    sigma[i] = 0.2;
  }
  points[100][2] += 5;
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, SIDE, SIDE, 3);
  data.normals = sgrt_view_of(normals, SGRT_F64, SIDE, SIDE, 3);
  data.sigma_mm = sgrt_view_of(sigma, SGRT_F64, SIDE, SIDE, 0);
  return make(&data);
}

static void test_space(void) {
  sgrt_surface *surface = plane(3), *result = NULL;
  sgrt_surface_filter_options options;
  sgrt_surface_filter_info info;
  sgrt_mut_view map = sgrt_mut_view_of(reason, SGRT_U8, SIDE, SIDE, 0);
  const double* z;
  CHECK_OK(sgrt_surface_filter_options_init(&options, sizeof options));
  options.radius_mm = 4;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_surface_filter(NULL, surface, &options, &result, &map, &info));
  CHECK(info.count[SGRT_FILTER_OUTLIER] == 1 && reason[100] == SGRT_FILTER_OUTLIER);
  CHECK(info.count[SGRT_FILTER_FILTERED] == SIDE * SIDE - 1);
  CHECK(info.radius_mm == 4);
  CHECK(info.sigma_after_mm < 0.5 * info.sigma_before_mm && info.correlation_points > 4);
  CHECK(summary_of(result).point_count == SIDE * SIDE - 1);
  z = numbers_of(result, SGRT_SURFACE_POINTS) + 2;
  CHECK(isnan(z[300]));
  CHECK_NEAR(z[3 * (16 * SIDE + 16)], 3, 0.3);
  sgrt_surface_free(result);
  result = NULL;

  options.radius_mm = -2;
  CHECK_INVALID(sgrt_surface_filter(NULL, surface, &options, &result, NULL, NULL), "radius_mm is -2");
  CHECK_INVALID(sgrt_surface_filter(NULL, NULL, NULL, &result, NULL, NULL), "surface");
  CHECK_INVALID(sgrt_surface_filter(NULL, surface, NULL, NULL, NULL, NULL), "result");
  map.dtype = SGRT_F64;
  CHECK_INVALID(sgrt_surface_filter(NULL, surface, NULL, &result, &map, NULL), "reason");
  info.struct_size = 3;
  CHECK_INVALID(sgrt_surface_filter(NULL, surface, NULL, &result, NULL, &info), "info.struct_size");
  CHECK(result == NULL);
  sgrt_surface_free(surface);
}

static void test_time(void) {
  sgrt_filter_session* session = NULL;
  sgrt_filter_session_options options;
  sgrt_filter_session_info info;
  sgrt_surface *frame[2], *result = NULL, *moved = NULL;
  sgrt_view states;
  int k;
  CHECK_OK(sgrt_filter_session_options_init(&options, sizeof options));
  options.drift_mm = 0;
  CHECK_OK(sgrt_filter_session_create(&options, &session));
  info.struct_size = sizeof info;
  CHECK_STATUS(sgrt_filter_session_surface(session, &result), SGRT_E_NOT_FOUND, "nothing has been pushed");
  CHECK_OK(sgrt_filter_session_states(session, &states));
  CHECK(states.data == NULL);
  for (k = 0; k < 2; ++k) frame[k] = plane(3);
  CHECK_OK(sgrt_filter_session_push(NULL, session, frame[0], 0, &info));
  CHECK(info.count[SGRT_TEMPORAL_STARTED] == SIDE * SIDE);
  CHECK_OK(sgrt_filter_session_push(NULL, session, frame[1], 0.1, &info));
  counting = 1;
  for (k = 2; k < 10; ++k) CHECK_OK(sgrt_filter_session_push(NULL, session, frame[k % 2], 0.1 * k, &info));
  counting = 0;
  CHECK(allocations == 0);
  CHECK(info.count[SGRT_TEMPORAL_AVERAGED] > SIDE * SIDE - 20);
  CHECK_OK(sgrt_filter_session_surface(session, &result));
  CHECK_NEAR(numbers_of(result, SGRT_SURFACE_SIGMA)[500], 0.2 / sqrt(10), 1e-9);

  sgrt_surface_free(frame[1]);
  frame[1] = plane(4);
  CHECK_OK(sgrt_filter_session_push(NULL, session, frame[1], 1, &info));
  CHECK(info.count[SGRT_TEMPORAL_MOVED] == SIDE * SIDE);
  CHECK_OK(sgrt_filter_session_states(session, &states));
  CHECK(((const uint8_t*)states.data)[77] == SGRT_TEMPORAL_MOVED && states.shape[1] == SIDE);
  CHECK_OK(sgrt_filter_session_surface(session, &moved));
  CHECK_NEAR(numbers_of(moved, SGRT_SURFACE_POINTS)[2], 4, 0.5);
  CHECK_NEAR(numbers_of(result, SGRT_SURFACE_POINTS)[2], 3, 0.4); /* the older handle kept its own */

  CHECK_INVALID(sgrt_filter_session_push(NULL, session, frame[0], 0.5, NULL), "time_s is 0.5");
  CHECK_INVALID(sgrt_filter_session_push(NULL, NULL, frame[0], 2, NULL), "session");
  CHECK_INVALID(sgrt_filter_session_push(NULL, session, NULL, 2, NULL), "frame");
  options.motion_sigmas = 0;
  CHECK_INVALID(sgrt_filter_session_create(&options, &session), "motion_sigmas is 0");
  for (k = 0; k < 2; ++k) sgrt_surface_free(frame[k]);
  sgrt_surface_free(result);
  sgrt_surface_free(moved);
  sgrt_filter_session_free(session);
  sgrt_filter_session_free(NULL);
}

int main(void) {
  test_space();
  test_time();
  return check_result();
}
