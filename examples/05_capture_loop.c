/* A treatment room from images to the beam: two cameras, the reference captured at the setup, then frame by frame the
 * skin near it, the patient's displacement, and whether the beam may be on. docs/howto-c.md explains it step by step.
 *
 * The cameras are simulated at the end of this file; `capture` is what a vendor replaces. */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <sgrt.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { kWidth = 640, kHeight = 480, kLeft = 0, kRight = 1, kFrames = 10 };

/* Where the patient is: lifted by breathing, slid along the couch. */
typedef struct Patient {
  double breath_mm, slide_mm;
} Patient;

static void capture(int side, Patient patient, uint8_t* image); /* kHeight x kWidth grey levels */

/* A real room's comes from its calibration (calib/README.md) and lies in a file. */
static const char kRig[] =
    "{\"schema\": \"sgrt-rig/1\", \"id\": \"example\", \"room\": \"IEC 61217 fixed, mm\", \"cameras\": ["
    "{\"id\": \"left\", \"image_size\": [640, 480], \"model\": \"pinhole\", \"intrinsics\": [1200, 1200, 319.5, 239.5],"
    " \"distortion\": [], \"camera_from_room\": [[1, 0, 0, 80], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]},"
    "{\"id\": \"right\", \"image_size\": [640, 480], \"model\": \"pinhole\", \"intrinsics\": [1200, 1200, 319.5, "
    "239.5],"
    " \"distortion\": [], \"camera_from_room\": [[1, 0, 0, -80], [0, -1, 0, 0], [0, 0, -1, 1000], [0, 0, 0, 1]]}],"
    "\"pairs\": [{\"id\": \"pod\", \"left\": \"left\", \"right\": \"right\"}]}";

/* [deadline] */
/* The library has no clock; its progress callback is asked every 10 ms and may stop the call. */
typedef struct Deadline {
  double end_s;
} Deadline;

static double now_s(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int32_t past(void* user, double fraction, const char* stage) {
  (void)fraction, (void)stage;
  return now_s() > ((const Deadline*)user)->end_s;
}
/* [deadline] */

/* A real system commands the machine here; the machine holds on its own when this is not called for 100 ms. */
static void command_beam(int on) {
  printf(on ? "beam ON  " : "beam HOLD");
}

/* [session] */
typedef struct Room {
  sgrt_context* context;
  sgrt_rig* rig;
  sgrt_stereo_session* stereo;
  sgrt_surface* reference;
  sgrt_roi *region, *patch; /* what is tracked; over which breathing is measured */
  sgrt_tracker* tracker;
} Room;

/* The images of one instant as a surface; *surface stays NULL where there is none. */
static sgrt_status look(Room* room, Patient patient, double time_s, sgrt_surface** surface) {
  static uint8_t images[2][kHeight][kWidth];
  const sgrt_stereo* pod = NULL; /* lent by the session until its next push */
  capture(kLeft, patient, images[kLeft][0]);
  capture(kRight, patient, images[kRight][0]);
  const sgrt_view left = sgrt_view_of(images[kLeft], SGRT_U8, kHeight, kWidth, 0);
  const sgrt_view right = sgrt_view_of(images[kRight], SGRT_U8, kHeight, kWidth, 0);
  sgrt_status status = sgrt_stereo_session_push(room->context, room->stereo, &left, &right, time_s, &pod);
  sgrt_stereo_info info = {.struct_size = sizeof info};
  if (!status) status = sgrt_stereo_summary(pod, &info);
  /* The images contradict the rig: depths are wrong by an unknown amount, so there is no surface. */
  if (!status && info.out_of_calibration) return SGRT_E_NOT_FOUND;
  if (!status) status = sgrt_stereo_surface(pod, surface);
  return status;
}
/* [session] */

/* [setup] */
/* Once a patient: the reference, what counts of it, and the tracker. */
static sgrt_status set_up(Room* room, Deadline* deadline) {
  const double isocentre_mm[3] = {0, 0, 0};
  const double low[3] = {-110, -130, 5}, high[3] = {110, 130, 200};         /* the tracked region, mm */
  const double patch_low[3] = {-40, -40, 5}, patch_high[3] = {40, 40, 200}; /* the breathing patch */
  const Patient planned = {0, 0};
  sgrt_context_options context;
  sgrt_stereo_options stereo;
  sgrt_tracker_options tracker;
  sgrt_context_options_init(&context, sizeof context);
  context.threads = 0; /* one a core */
  context.progress = past;
  context.progress_user = deadline;
  sgrt_stereo_options_init(&stereo, sizeof stereo);
  memcpy(stereo.volume_min_mm, (const double[]){-300, -300, -50}, sizeof stereo.volume_min_mm);
  memcpy(stereo.volume_max_mm, (const double[]){300, 300, 200}, sizeof stereo.volume_max_mm);
  sgrt_tracker_options_init(&tracker, sizeof tracker);
  tracker.profile = SGRT_PROFILE_CONVENTIONAL; /* 2 mm and 1 deg */
  tracker.gated = 1;                           /* and breathing within 1.5 mm of the reference's */

  sgrt_status status = sgrt_context_create(&context, &room->context);
  if (!status) status = sgrt_rig_from_json(kRig, sizeof kRig - 1, &room->rig);
  if (!status) status = sgrt_stereo_session_create(room->context, room->rig, "pod", &stereo, &room->stereo);
  if (!status) status = look(room, planned, 0, &room->reference);
  if (!status) status = sgrt_roi_from_box(low, high, &room->region);
  if (!status) status = sgrt_roi_from_box(patch_low, patch_high, &room->patch);
  /* From now on only the skin near the reference is searched for: a few milliseconds a frame. */
  if (!status) {
    status = sgrt_stereo_session_set_prior(room->context, room->stereo, room->reference, room->region, NULL);
  }
  if (!status) {
    status = sgrt_tracker_create(room->context, room->reference, isocentre_mm, room->region, room->patch, &tracker,
                                 NULL, &room->tracker);
  }
  return status;
}
/* [setup] */

/* [frame] */
/* One frame. The beam is on only if every call said SGRT_OK and the tracker says so. */
static sgrt_status frame(Room* room, Patient patient, double time_s) {
  sgrt_tracker_info info = {.struct_size = sizeof info};
  sgrt_surface* live = NULL;
  sgrt_status status = look(room, patient, time_s, &live);
  if (status == SGRT_OK || status == SGRT_E_NOT_FOUND) { /* without a surface the tracker has to know it, too */
    status = sgrt_tracker_push(room->context, room->tracker, live, time_s, &info);
  }
  command_beam(status == SGRT_OK && info.beam == SGRT_BEAM_ON);
  if (status == SGRT_OK) {
    printf("  %.1f s  LNG %+5.2f  VRT %+5.2f mm  breath %+5.2f mm  %s\n", time_s, info.displacement.lng_mm,
           info.displacement.vrt_mm, info.breathing_mm, sgrt_tracker_text(room->tracker, SGRT_TRACKER_HOLD));
  } else {
    printf("  %.1f s  %s\n", time_s, sgrt_last_error());
  }
  sgrt_surface_free(live);
  return status;
}
/* [frame] */

/* [loop] */
int main(void) {
  /* Breathing, a cough, a patient who slides, a hand before the lens (NAN), a frame that takes too long. */
  const Patient patient[kFrames] = {{0.1, 0.0}, {0.6, 0.1}, {1.0, 0.1}, {6.0, 2.0}, {0.4, 0.1},
                                    {0.3, 4.0}, {0.3, 0.2}, {NAN, 0},   {0.2, 0.1}, {0.1, 0.0}};
  const int late = 6;
  Deadline deadline = {now_s() + 60};
  Room room = {0};
  sgrt_status status = set_up(&room, &deadline);
  for (int i = 0; !status && i < kFrames; ++i) {
    deadline.end_s = now_s() + (i == late ? -1 : 10); /* a real loop: 0.1 s. This one simulates the cameras, too */
    const sgrt_status seen = frame(&room, patient[i], 0.2 * (i + 1));
    /* 10-19: the patient cannot be seen; cancelled: too late. Both are life. All else is a defect: stop. */
    if (seen != SGRT_OK && seen != SGRT_E_CANCELLED && (seen < 10 || seen > 19)) status = seen;
  }
  if (status) {
    command_beam(0);
    fprintf(stderr, "\n%s: %s\n", sgrt_status_word(status), sgrt_last_error());
  }
  sgrt_tracker_free(room.tracker);
  sgrt_roi_free(room.patch), sgrt_roi_free(room.region);
  sgrt_surface_free(room.reference);
  sgrt_stereo_session_free(room.stereo);
  sgrt_rig_free(room.rig);
  sgrt_context_free(room.context);
  return status != SGRT_OK;
}
/* [loop] */

/* ---- The simulated cameras: they look straight down from 1 m, 160 mm apart, on skin with speckle. */

static double height(double x, double y) {
  return 70 * exp(-(x * x + 2 * y * y) / 9000) + 18 * exp(-(pow(x - 60, 2) + pow(y - 50, 2)) / 1200);
}

/* Random numbers from 0 to 1 on a grid of 3 mm, smooth between. */
static double lattice(int x, int y) {
  uint32_t h = (uint32_t)x * 374761393U + (uint32_t)y * 668265263U;
  h = (h ^ (h >> 13)) * 1274126177U;
  return (double)((h ^ (h >> 16)) & 0xffffU) / 65535;
}

static double speckle(double x, double y) {
  const double u = x / 3, v = y / 3, s = u - floor(u), t = v - floor(v);
  const int i = (int)floor(u), j = (int)floor(v);
  const double a = s * s * (3 - 2 * s), b = t * t * (3 - 2 * t);
  return (1 - b) * ((1 - a) * lattice(i, j) + a * lattice(i + 1, j)) +
         b * ((1 - a) * lattice(i, j + 1) + a * lattice(i + 1, j + 1));
}

static void capture(int side, Patient patient, uint8_t* image) {
  const double centre = side == kLeft ? -80 : 80;
  for (int i = 0; i < kHeight * kWidth; ++i) {
    const int row = i / kWidth, column = i % kWidth;
    const double dx = (column - 319.5) / 1200, dy = -(row - 239.5) / 1200;
    double x = 0, y = 0, z = 0;
    for (int k = 0; k < 8; ++k) { /* the ray meets the skin */
      x = centre + dx * (1000 - z), y = dy * (1000 - z);
      z = height(x, y - patient.slide_mm) + patient.breath_mm;
    }
    image[i] = isnan(patient.breath_mm) ? 3 : (uint8_t)(30 + 190 * speckle(x, y - patient.slide_mm));
  }
}
