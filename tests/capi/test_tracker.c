/* The tracker through C: a treatment in short, and that info says HOLD whatever goes wrong. */
#include "allocations.h"
#include "surfaces.h"

enum { kSide = 60, kPoints = kSide * kSide };

static const double kIso[3] = {0, 0, 0};

/* A lump without symmetry, a grid of points each 4 mm, shifted by (dx, dy, dz). */
static sgrt_surface* lump(double dx, double dy, double dz) {
  static double x[kPoints * 3];
  sgrt_surface_data data;
  int i, j;
  for (i = 0; i < kSide; ++i) {
    for (j = 0; j < kSide; ++j) {
      double* p = x + 3 * (i * kSide + j);
      const double u = 4.0 * (j - kSide / 2), v = 4.0 * (i - kSide / 2);
      p[0] = u + dx, p[1] = v + dy;
      p[2] = 60 * cos(u / 90) * cos(v / 150) + 9 * sin(u / 23 + 0.4) * cos(v / 31) + dz;
    }
  }
  data = data_of(x, kPoints);
  {
    sgrt_surface *cloud = make(&data), *surface = NULL;
    CHECK_OK(sgrt_surface_estimate_normals(NULL, cloud, NULL, &surface));
    sgrt_surface_free(cloud);
    return surface;
  }
}

static sgrt_tracker_info fresh_info(void) {
  sgrt_tracker_info info;
  memset(&info, 0x5A, sizeof info);
  info.struct_size = sizeof info;
  info.beam = SGRT_BEAM_ON;
  return info;
}

static void check_holds(const sgrt_tracker_info* info) {
  CHECK(info->beam == SGRT_BEAM_HOLD && info->hold != 0);
  CHECK(isnan(info->displacement.lat_mm) && isnan(info->reference_from_live[15]) && isnan(info->covariance[35]));
  CHECK(isnan(info->drift.mag_mm) && isnan(info->sigma_deg[2]) && isnan(info->breathing_mm));
}

static void test_treatment(void) {
  const double corners[8] = {-40, -40, 40, -40, 40, 40, -40, 40};
  const sgrt_view vertices = sgrt_view_of(corners, SGRT_F64, 4, 2, 0);
  sgrt_surface *reference = lump(0, 0, 0), *near = lump(0.5, -0.3, 0.2), *far = lump(0, 0, 1.7),
               *gone = lump(0, 0, 500);
  sgrt_tracker_options options;
  sgrt_tracker* tracker = NULL;
  sgrt_roi* patch = NULL;
  sgrt_tracker_info info = fresh_info();
  CHECK_OK(sgrt_roi_from_polygon(&vertices, &patch));
  CHECK_OK(sgrt_tracker_options_init(&options, sizeof options));
  CHECK(options.profile == SGRT_PROFILE_CONVENTIONAL && options.gated == 0);
  options.profile = SGRT_PROFILE_SRS;
  options.search = 0; /* which would find the one that is gone, 500 mm above */
  options.gated = 1;
  CHECK_OK(sgrt_tracker_create(NULL, reference, kIso, NULL, patch, &options, NULL, &tracker));
  sgrt_surface_free(reference); /* the tracker keeps it */
  CHECK(!strcmp(sgrt_tracker_text(tracker, SGRT_TRACKER_VERDICT), ""));

  CHECK_OK(sgrt_tracker_push(NULL, tracker, near, 0, &info));
  CHECK(info.beam == SGRT_BEAM_ON && info.hold == 0 && info.state == SGRT_TRACK_TRACKING && info.frame == 0);
  CHECK(info.verdict == SGRT_VERDICT_OK);
  CHECK_NEAR(info.displacement.lat_mm, 0.5, 0.05);
  CHECK_NEAR(info.displacement.lng_mm, -0.3, 0.05);
  CHECK_NEAR(info.correction.vrt_mm, -0.2, 0.05);
  CHECK_NEAR(info.breathing_mm, 0.2, 0.12); /* the patch slopes */
  CHECK(info.sigma_mm[0] > 0 && info.sigma_mm[0] < 0.1);
  CHECK(!strcmp(sgrt_tracker_text(tracker, SGRT_TRACKER_HOLD), ""));

  CHECK_OK(sgrt_tracker_push(NULL, tracker, far, 0.1, &info));
  CHECK(info.beam == SGRT_BEAM_HOLD && info.hold == (SGRT_HOLD_TRANSLATION | SGRT_HOLD_BREATHING));
  CHECK_NEAR(info.drift.vrt_mm, 1.5, 0.05);
  CHECK(strstr(sgrt_tracker_text(tracker, SGRT_TRACKER_HOLD), "translation") != NULL);

  info = fresh_info();
  CHECK(sgrt_tracker_push(NULL, tracker, gone, 0.2, &info) == SGRT_E_NOT_FOUND);
  check_holds(&info);
  CHECK(info.status == SGRT_E_NOT_FOUND && info.state == SGRT_TRACK_LOST && info.hold & SGRT_HOLD_NO_POSE);
  info = fresh_info();
  CHECK(sgrt_tracker_push(NULL, tracker, NULL, 0.3, &info) == SGRT_E_INSUFFICIENT_DATA);
  check_holds(&info);
  CHECK_OK(sgrt_tracker_push(NULL, tracker, near, 0.4, &info));
  CHECK(info.beam == SGRT_BEAM_ON && info.state == SGRT_TRACK_FOUND && info.frame == 4);

  /* Time that runs backwards: the call is wrong, and the beam holds. */
  info = fresh_info();
  CHECK_INVALID(sgrt_tracker_push(NULL, tracker, near, 0.1, &info), "time_s: 0.1, expected at least");
  check_holds(&info);
  CHECK(info.struct_size == sizeof info && info.frame == -1);
  info = fresh_info();
  CHECK_INVALID(sgrt_tracker_push(NULL, tracker, near, NAN, &info), "time_s: nan");
  check_holds(&info);
  info = fresh_info();
  CHECK_INVALID(sgrt_tracker_push(NULL, NULL, near, 1, &info), "tracker: NULL");
  check_holds(&info);
  CHECK_INVALID(sgrt_tracker_push(NULL, tracker, near, 1, NULL), "info: NULL");

  /* Where the patient lies now becomes the plan. */
  CHECK_OK(sgrt_tracker_set_reference(NULL, tracker, far, NULL, patch));
  CHECK_OK(sgrt_tracker_push(NULL, tracker, far, 0.5, &info));
  CHECK(info.beam == SGRT_BEAM_ON);
  CHECK_NEAR(info.displacement.mag_mm, 0, 0.05);
  CHECK_INVALID(sgrt_tracker_set_reference(NULL, tracker, far, NULL, NULL), "gate_roi");
  CHECK_INVALID(sgrt_tracker_set_reference(NULL, tracker, NULL, NULL, patch), "reference: NULL");
  CHECK_INVALID(sgrt_tracker_set_reference(NULL, NULL, far, NULL, patch), "tracker: NULL");
  CHECK(sgrt_tracker_text(tracker, 9) == NULL && sgrt_tracker_text(NULL, SGRT_TRACKER_HOLD) == NULL);
  sgrt_tracker_free(tracker);
  sgrt_roi_free(patch);
  sgrt_surface_free(near), sgrt_surface_free(far), sgrt_surface_free(gone);
}

static void test_bad_arguments(void) {
  sgrt_surface* reference = lump(0, 0, 0);
  sgrt_tracker_options options, bad;
  sgrt_icp_options icp;
  sgrt_tracker* tracker = NULL;
  CHECK_OK(sgrt_tracker_options_init(&options, sizeof options));
  CHECK_OK(sgrt_icp_options_init(&icp, sizeof icp));
  CHECK_INVALID(sgrt_tracker_options_init(NULL, sizeof options), "options: NULL");
  CHECK_INVALID(sgrt_tracker_options_init(&options, 3), "size: 3");
  CHECK_INVALID(sgrt_tracker_create(NULL, NULL, kIso, NULL, NULL, NULL, NULL, &tracker), "reference: NULL");
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, NULL, NULL, NULL, NULL, NULL, &tracker), "isocentre_mm: NULL");
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, NULL, NULL, NULL), "tracker: NULL");
  bad = options, bad.profile = 3;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.profile: 3");
  bad = options, bad.gated = 1;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "gate_roi");
  bad = options, bad.gated = 2;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.gated: 2");
  bad = options, bad.search = 2;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.search: 2");
  bad = options, bad.search_every_s = -1;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.search_every_s");
  bad = options, bad.hysteresis = 0;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.hysteresis: 0");
  bad = options, bad.resume_s = NAN;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.resume_s: nan");
  bad = options, bad.max_gap_s = 0;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.max_gap_s: 0");
  bad = options, bad.gate_low_mm = 2;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.gate_low_mm: 2");
  bad = options, bad.tolerance_deg = 181;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.tolerance_deg");
  bad = options, bad.tolerance_mm = -1;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, &bad, NULL, &tracker), "options.tolerance_mm");
  icp.max_iterations = 0;
  CHECK_INVALID(sgrt_tracker_create(NULL, reference, kIso, NULL, NULL, NULL, &icp, &tracker), "options.max_iterations");
  CHECK(tracker == NULL);
  sgrt_tracker_free(NULL);
  sgrt_surface_free(reference);
}

/* With error modes, covariances or nothing told of the noise; with and without a breathing trace and a pool. */
static void test_the_steady_state_allocates_nothing(void) {
  const double corners[8] = {-40, -40, 40, -40, 40, 40, -40, 40};
  const sgrt_view vertices = sgrt_view_of(corners, SGRT_F64, 4, 2, 0);
  sgrt_surface *reference = lump(0, 0, 0), *live[2];
  sgrt_context* pool = context_of(2, NULL, NULL);
  sgrt_tracker_info info = fresh_info();
  sgrt_roi* patch = NULL;
  int i, kind;
  CHECK_OK(sgrt_roi_from_polygon(&vertices, &patch));
  live[0] = lump(0.5, -0.3, 0.2), live[1] = lump(0.4, 0.1, 0.3);
  for (kind = 0; kind < 3; ++kind) {
    sgrt_context* context = kind == 2 ? pool : NULL;
    sgrt_tracker* tracker = NULL;
    CHECK_OK(sgrt_tracker_create(context, reference, kIso, NULL, kind == 1 ? patch : NULL, NULL, NULL, &tracker));
    for (i = 0; i < 4; ++i) CHECK_OK(sgrt_tracker_push(context, tracker, live[i % 2], 0.1 * i, &info));
    allocations = 0;
    counting = 1;
    for (; i < 12; ++i) CHECK_OK(sgrt_tracker_push(context, tracker, live[i % 2], 0.1 * i, &info));
    counting = 0;
    CHECK(info.beam == SGRT_BEAM_ON);
    CHECK(allocations == 0);
    if (allocations) fprintf(stderr, "%ld allocations in 8 pushes, kind %d\n", allocations, kind);
    sgrt_tracker_free(tracker);
  }
  sgrt_roi_free(patch);
  sgrt_surface_free(reference), sgrt_surface_free(live[0]), sgrt_surface_free(live[1]);
  sgrt_context_free(pool);
}

int main(void) {
  test_treatment();
  test_bad_arguments();
  test_the_steady_state_allocates_nothing();
  return check_result();
}
