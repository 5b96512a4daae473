/* Every number of the options structs beyond its range is refused by name, and nothing is written. */
#include <stddef.h>

#include "surfaces.h"

enum { kSide = 12, kWidth = 64, kHeight = 48 };

static const char kRig[] =
    "{\"schema\": \"sgrt-rig/1\", \"id\": \"options\", \"room\": \"IEC 61217 fixed, mm\", \"cameras\": ["
    "{\"id\": \"l\", \"image_size\": [64, 48], \"model\": \"pinhole\", \"intrinsics\": [120, 120, 31.5, 23.5],"
    " \"camera_from_room\": [[1, 0, 0, 60], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]},"
    "{\"id\": \"r\", \"image_size\": [64, 48], \"model\": \"pinhole\", \"intrinsics\": [120, 120, 31.5, 23.5],"
    " \"camera_from_room\": [[1, 0, 0, -60], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]}],"
    "\"pairs\": [{\"id\": \"pod\", \"left\": \"l\", \"right\": \"r\"}],"
    "\"tofs\": [{\"id\": \"tof\", \"camera\": \"l\", \"modulation_hz\": [20e6], \"tap_phase_rad\": [0, 2, 4]}]}";

/* A member of a struct of options, a value that it may not have, and its name as the message gives it. */
typedef struct Bad {
  size_t at;
  int whole; /* an int32_t, else a double */
  double value;
  const char* name;
} Bad;
#define WHOLE(type, member, value) \
  { offsetof(type, member), 1, value, #member }
#define REAL(type, member, value) \
  { offsetof(type, member), 0, value, #member }
#define EACH(list, options, call) refused_each(list, sizeof list / sizeof *list, &(options), sizeof(options), call)

static sgrt_rig* rig;
static sgrt_surface* surface;
static uint16_t pixels[3 * kWidth * kHeight];

static void refused_each(const Bad* bad, size_t count, void* options, size_t size, sgrt_status (*call)(void)) {
  static unsigned char good[1024];
  size_t i;
  memcpy(good, options, size);
  for (i = 0; i < count; ++i) {
    unsigned char* at = (unsigned char*)options + bad[i].at;
    const int32_t whole = bad[i].whole ? (int32_t)bad[i].value : 0;
    memcpy(at, bad[i].whole ? (const void*)&whole : (const void*)&bad[i].value, bad[i].whole ? sizeof whole : 8);
    CHECK_INVALID(call(), bad[i].name);
    memcpy(options, good, size);
  }
}

static sgrt_nurbs_fit_options fit;
static sgrt_status call_fit(void) {
  sgrt_nurbs_fit* result = CANARY(sgrt_nurbs_fit);
  const sgrt_status status = sgrt_nurbs_fit_create(NULL, surface, &fit, &result);
  CHECK(result == CANARY(sgrt_nurbs_fit));
  return status;
}

static void test_nurbs_fit(void) {
  static const Bad bad[] = {
      WHOLE(sgrt_nurbs_fit_options, chart, 5),
      WHOLE(sgrt_nurbs_fit_options, chart, -1),
      WHOLE(sgrt_nurbs_fit_options, smoothing, 3),
      WHOLE(sgrt_nurbs_fit_options, robust, 2),
      WHOLE(sgrt_nurbs_fit_options, control_points[0], 3),
      WHOLE(sgrt_nurbs_fit_options, control_points[1], 2001),
      WHOLE(sgrt_nurbs_fit_options, max_control_points, 15),
      WHOLE(sgrt_nurbs_fit_options, max_control_points, 100001),
      REAL(sgrt_nurbs_fit_options, lambda, -1),
      REAL(sgrt_nurbs_fit_options, lambda, NAN),
      REAL(sgrt_nurbs_fit_options, lambda, 1e31),
      REAL(sgrt_nurbs_fit_options, tukey, 1.9),
      REAL(sgrt_nurbs_fit_options, tukey, 101),
  };
  CHECK_OK(sgrt_nurbs_fit_options_init(&fit, sizeof fit));
  EACH(bad, fit, call_fit);
  fit.axis[1] = INFINITY;
  CHECK_INVALID(call_fit(), "axis");
}

static sgrt_tof_options tof;
static sgrt_status call_tof(void) {
  sgrt_tof_session* session = CANARY(sgrt_tof_session);
  const sgrt_status status = sgrt_tof_session_create(NULL, rig, "tof", &tof, &session);
  CHECK(session == CANARY(sgrt_tof_session));
  return status;
}

static void test_tof(void) {
  static const Bad bad[] = {
      REAL(sgrt_tof_options, range_min_mm, -1),         REAL(sgrt_tof_options, range_min_mm, 1e5),
      REAL(sgrt_tof_options, range_max_mm, 2e5),        REAL(sgrt_tof_options, saturation, 0),
      REAL(sgrt_tof_options, min_amplitude, -1),        REAL(sgrt_tof_options, max_phase_sigma_rad, 0),
      REAL(sgrt_tof_options, max_sigma_mm, 0),          REAL(sgrt_tof_options, moved_tolerance, -1),
      REAL(sgrt_tof_options, max_incidence_deg, 90),    REAL(sgrt_tof_options, min_unwrap_score, -1),
      REAL(sgrt_tof_options, unwrap_tolerance_mm, 2e4), WHOLE(sgrt_tof_options, normal_window_px, 4),
      WHOLE(sgrt_tof_options, normal_window_px, 33),    WHOLE(sgrt_tof_options, chapter_c, 2),
  };
  CHECK_OK(sgrt_tof_options_init(&tof, sizeof tof));
  EACH(bad, tof, call_tof);
}

static sgrt_stripe_options stripe;
static sgrt_status call_stripe(void) {
  const sgrt_view image = sgrt_view_of(pixels, SGRT_U16, kHeight, kWidth, 0);
  sgrt_stripe* result = CANARY(sgrt_stripe);
  const sgrt_status status = sgrt_stripe_extract(NULL, &image, NULL, &stripe, &result);
  CHECK(result == CANARY(sgrt_stripe));
  return status;
}

static void test_stripe(void) {
  static const Bad bad[] = {
      WHOLE(sgrt_stripe_options, method, 3),          WHOLE(sgrt_stripe_options, method, -1),
      WHOLE(sgrt_stripe_options, columns, 2),         WHOLE(sgrt_stripe_options, min_length, 0),
      WHOLE(sgrt_stripe_options, min_length, 1001),   REAL(sgrt_stripe_options, half_width_px, 1),
      REAL(sgrt_stripe_options, half_width_px, 101),  REAL(sgrt_stripe_options, min_signal, -1),
      REAL(sgrt_stripe_options, noise, NAN),          REAL(sgrt_stripe_options, gain, -1),
      REAL(sgrt_stripe_options, saturation, 1e10),    REAL(sgrt_stripe_options, max_asymmetry, 0),
      REAL(sgrt_stripe_options, max_asymmetry, 1.01),
  };
  CHECK_OK(sgrt_stripe_options_init(&stripe, sizeof stripe));
  EACH(bad, stripe, call_stripe);
}

static sgrt_surface_filter_options filter;
static sgrt_status call_filter(void) {
  sgrt_surface* result = CANARY(sgrt_surface);
  const sgrt_status status = sgrt_surface_filter(NULL, surface, &filter, &result, NULL, NULL);
  CHECK(result == CANARY(sgrt_surface));
  return status;
}
static sgrt_filter_session_options temporal;
static sgrt_status call_temporal(void) {
  sgrt_filter_session* result = CANARY(sgrt_filter_session);
  const sgrt_status status = sgrt_filter_session_create(&temporal, &result);
  CHECK(result == CANARY(sgrt_filter_session));
  return status;
}

static void test_filters(void) {
  static const Bad space[] = {
      REAL(sgrt_surface_filter_options, radius_mm, -1),   REAL(sgrt_surface_filter_options, radius_mm, NAN),
      REAL(sgrt_surface_filter_options, max_sigmas, 0.5), REAL(sgrt_surface_filter_options, max_sigmas, 101),
      REAL(sgrt_surface_filter_options, min_support, -1), REAL(sgrt_surface_filter_options, min_support, NAN),
  };
  static const Bad time[] = {
      REAL(sgrt_filter_session_options, motion_sigmas, 0.5),
      REAL(sgrt_filter_session_options, motion_sigmas, 101),
      REAL(sgrt_filter_session_options, drift_mm, -1),
      REAL(sgrt_filter_session_options, drift_mm, 1001),
  };
  CHECK_OK(sgrt_surface_filter_options_init(&filter, sizeof filter));
  EACH(space, filter, call_filter);
  CHECK_OK(sgrt_filter_session_options_init(&temporal, sizeof temporal));
  EACH(time, temporal, call_temporal);
}

static sgrt_deform_options deform;
static sgrt_status call_deform(void) {
  const double isocentre[3] = {0, 0, 0};
  sgrt_deform* result = CANARY(sgrt_deform);
  const sgrt_status status = sgrt_deform_align(NULL, surface, surface, isocentre, NULL, NULL, &deform, NULL, &result);
  CHECK(result == CANARY(sgrt_deform));
  return status;
}
static sgrt_curvature_options curvature;
static sgrt_status call_curvature(void) {
  sgrt_curvature* result = CANARY(sgrt_curvature);
  const sgrt_status status = sgrt_curvature_compute(NULL, surface, &curvature, &result);
  CHECK(result == CANARY(sgrt_curvature));
  return status;
}
static sgrt_landmark_learn_options learn;
static sgrt_status call_learn(void) {
  sgrt_landmark_model* result = CANARY(sgrt_landmark_model);
  const sgrt_status status = sgrt_landmark_model_learn(NULL, surface, NULL, &learn, &result);
  CHECK(result == CANARY(sgrt_landmark_model));
  return status;
}

static void test_surfaces(void) {
  static const Bad bodies[] = {
      WHOLE(sgrt_deform_options, mode, 3),
      WHOLE(sgrt_deform_options, mode, -1),
      REAL(sgrt_deform_options, min_rigid_share, 1.1),
      REAL(sgrt_deform_options, max_structure_mm, NAN),
      REAL(sgrt_deform_options, max_rivalry, -1),
      REAL(sgrt_deform_options, stiffness, 0),
  };
  static const Bad forms[] = {
      WHOLE(sgrt_curvature_options, degree, 1),    WHOLE(sgrt_curvature_options, degree, 5),
      REAL(sgrt_curvature_options, radius_mm, -1), REAL(sgrt_curvature_options, max_radius_mm, NAN),
      REAL(sgrt_curvature_options, noise_mm, -1),  REAL(sgrt_curvature_options, max_sigma_per_mm, NAN),
  };
  static const Bad places[] = {
      WHOLE(sgrt_landmark_learn_options, count, 3),    WHOLE(sgrt_landmark_learn_options, count, 65),
      REAL(sgrt_landmark_learn_options, scale_mm, -1), REAL(sgrt_landmark_learn_options, patch_mm, 4),
      REAL(sgrt_landmark_learn_options, patch_mm, 51),
  };
  CHECK_OK(sgrt_deform_options_init(&deform, sizeof deform));
  EACH(bodies, deform, call_deform);
  CHECK_OK(sgrt_curvature_options_init(&curvature, sizeof curvature));
  EACH(forms, curvature, call_curvature);
  CHECK_OK(sgrt_landmark_learn_options_init(&learn, sizeof learn));
  EACH(places, learn, call_learn);
}

static sgrt_stereo_options stereo;
static sgrt_status call_stereo(void) {
  sgrt_stereo_session* session = CANARY(sgrt_stereo_session);
  const sgrt_status status = sgrt_stereo_session_create(NULL, rig, "pod", &stereo, &session);
  CHECK(session == CANARY(sgrt_stereo_session));
  return status;
}
static sgrt_tracker_options tracking;
static sgrt_status call_tracker(void) {
  const double isocentre[3] = {0, 0, 0};
  sgrt_tracker* tracker = CANARY(sgrt_tracker);
  const sgrt_status status = sgrt_tracker_create(NULL, surface, isocentre, NULL, NULL, &tracking, NULL, &tracker);
  CHECK(tracker == CANARY(sgrt_tracker));
  return status;
}

static void test_sessions(void) {
  static const Bad pairs[] = {
      WHOLE(sgrt_stereo_options, window_px, 8),      WHOLE(sgrt_stereo_options, window_px, 43),
      WHOLE(sgrt_stereo_options, stride_px, 0),      WHOLE(sgrt_stereo_options, stride_px, 33),
      REAL(sgrt_stereo_options, min_correlation, 1), REAL(sgrt_stereo_options, max_left_right_px, 0),
      REAL(sgrt_stereo_options, max_sigma_px, NAN),  REAL(sgrt_stereo_options, max_epipolar_px, -1),
      WHOLE(sgrt_stereo_options, min_component, -1),
  };
  static const Bad beams[] = {
      WHOLE(sgrt_tracker_options, profile, 3),        WHOLE(sgrt_tracker_options, gated, 1),
      WHOLE(sgrt_tracker_options, search, 2),         REAL(sgrt_tracker_options, tolerance_mm, -1),
      REAL(sgrt_tracker_options, tolerance_deg, NAN), REAL(sgrt_tracker_options, hysteresis, 1.1),
      REAL(sgrt_tracker_options, resume_s, -1),       REAL(sgrt_tracker_options, max_gap_s, -1),
      REAL(sgrt_tracker_options, search_every_s, -1),
  };
  CHECK_OK(sgrt_stereo_options_init(&stereo, sizeof stereo));
  EACH(pairs, stereo, call_stereo);
  CHECK_OK(sgrt_tracker_options_init(&tracking, sizeof tracking));
  EACH(beams, tracking, call_tracker);
}

static sgrt_contours_options contours;
static sgrt_status call_contours(void) {
  static const double points[] = {0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 3, 9, 0, 3, 0, 9, 3};
  static const int32_t three[] = {3, 3};
  const sgrt_view p = sgrt_view_of(points, SGRT_F64, 6, 3, 0), n = sgrt_view_of(three, SGRT_I32, 2, 0, 0);
  sgrt_volume* result = CANARY(sgrt_volume);
  const sgrt_status status = sgrt_contours_close(NULL, &p, &n, &contours, &result);
  CHECK(result == CANARY(sgrt_volume));
  return status;
}
static sgrt_volume_options skin;
static sgrt_status call_skin(void) {
  const double frame[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const sgrt_view voxels = sgrt_view_of(pixels, SGRT_U16, 3, kHeight, kWidth);
  sgrt_volume* result = CANARY(sgrt_volume);
  const sgrt_status status = sgrt_volume_skin(NULL, &voxels, frame, &skin, &result);
  CHECK(result == CANARY(sgrt_volume));
  return status;
}

static void test_volumes(void) {
  static const Bad slices[] = {
      REAL(sgrt_contours_options, pixel_mm, 0.05),
      REAL(sgrt_contours_options, pixel_mm, 11),
      REAL(sgrt_contours_options, smoothing_mm, 51),
  };
  static const Bad voxels[] = {
      REAL(sgrt_volume_options, rescale_slope, NAN), REAL(sgrt_volume_options, rescale_intercept, INFINITY),
      REAL(sgrt_volume_options, closing_mm, 51),     REAL(sgrt_volume_options, smoothing_mm, 51),
      REAL(sgrt_volume_options, down[1], NAN),
  };
  CHECK_OK(sgrt_contours_options_init(&contours, sizeof contours));
  EACH(slices, contours, call_contours);
  CHECK_OK(sgrt_volume_options_init(&skin, sizeof skin));
  EACH(voxels, skin, call_skin);
}

int main(void) {
  static double z[kSide * kSide];
  const sgrt_view heights = sgrt_view_of(z, SGRT_F64, kSide, kSide, 0);
  const double zero[2] = {0, 0}, spacing[2] = {5, 5};
  int i;
  for (i = 0; i < kSide * kSide; ++i) z[i] = 6 * cos(0.5 * (i % kSide)) * sin(0.4 * i / kSide);
  CHECK_OK(sgrt_rig_from_json(kRig, sizeof kRig - 1, &rig));
  CHECK_OK(sgrt_surface_from_height_field(NULL, &heights, zero, spacing, &surface));
  if (!rig || !surface) return 1;
  test_nurbs_fit();
  test_tof();
  test_stripe();
  test_filters();
  test_surfaces();
  test_sessions();
  test_volumes();
  sgrt_surface_free(surface);
  sgrt_rig_free(rig);
  return check_result();
}
