/* The capture loop of a treatment room: frames in, beam-hold signal out. A patient breathes, coughs, leaves the room
 * and comes back.
 *
 * The rule of the loop: the beam is on only in a frame whose push returned SGRT_OK *and* whose info says SGRT_BEAM_ON.
 * The library has no clock; that no frame came at all is for a watchdog of the caller's own. */
#include <math.h>
#include <sgrt.h>
#include <stdio.h>

/* A real system commands the machine here, and holds on its own when this is not called for 100 ms. */
static void command_beam(int on) {
  printf(on ? "beam ON  " : "beam HOLD");
}

/* Stands for the cameras: the skin lifted by breath_mm and moved along by slide_mm; NULL when nobody is there. */
static sgrt_surface* capture(double breath_mm, double slide_mm) {
  const double origin_mm[2] = {-80, -80}, spacing_mm[2] = {4, 4};
  static double z[41][41];
  sgrt_view view = sgrt_view_of(z, SGRT_F64, 41, 41, 0);
  sgrt_surface* surface = NULL;
  if (isnan(breath_mm)) return NULL;
  for (int i = 0; i < 41 * 41; ++i) {
    const double x = -80 + 4 * (i % 41), y = -80 + 4 * (i / 41) - slide_mm;
    z[i / 41][i % 41] =
        breath_mm + 50 * exp(-(x * x + 2 * y * y) / 4000) + 15 * exp(-(pow(x - 40, 2) + pow(y - 30, 2)) / 500);
  }
  sgrt_surface_from_height_field(NULL, &view, origin_mm, spacing_mm, &surface);
  return surface;
}

int main(void) {
  const double isocentre_mm[3] = {0, 0, 0}, low[3] = {-30, -30, -100}, high[3] = {30, 30, 100};
  const double breath[] = {0.2, 0.6, 1.1, 0.4, 6.0, 0.3, NAN, NAN, 0.2, 0.1};
  const double slide[] = {0.1, 0.1, 0.2, 0.1, 3.0, 0.1, 0, 0, 0.3, 0.2};
  sgrt_surface* reference = capture(0, 0);
  sgrt_roi* patch = NULL; /* over which the breathing is measured */
  sgrt_tracker* tracker = NULL;
  sgrt_tracker_options options;
  sgrt_status status = sgrt_tracker_options_init(&options, sizeof options);
  options.profile = SGRT_PROFILE_CONVENTIONAL; /* 2 mm and 1 deg */
  options.gated = 1;                           /* and within 1.5 mm of the breath hold of the reference */
  if (!status) status = sgrt_roi_from_box(low, high, &patch);
  if (!status) {
    status = sgrt_tracker_create(NULL, reference, isocentre_mm, NULL, patch, &options, NULL, &tracker);
  }
  for (int i = 0; !status && i < 10; ++i) {
    sgrt_tracker_info info = {.struct_size = sizeof info};
    sgrt_surface* live = capture(breath[i], slide[i]);
    const sgrt_status frame = sgrt_tracker_push(NULL, tracker, live, 0.1 * i, &info); /* live may be NULL */
    command_beam(frame == SGRT_OK && info.beam == SGRT_BEAM_ON);
    printf("  %.1f s  LNG %+5.2f VRT %+5.2f mm  breath %+5.2f mm  %s\n", info.time_s, info.displacement.lng_mm,
           info.displacement.vrt_mm, info.breathing_mm, sgrt_tracker_text(tracker, SGRT_TRACKER_HOLD));
    sgrt_surface_free(live);
    if (frame >= SGRT_E_CANCELLED || (frame > 0 && frame < 10)) status = frame; /* not the patient's: stop */
  }
  if (status) {
    command_beam(0);
    fprintf(stderr, "\n%s\n", sgrt_last_error());
  }
  sgrt_tracker_free(tracker);
  sgrt_roi_free(patch);
  sgrt_surface_free(reference);
  return status != SGRT_OK;
}
