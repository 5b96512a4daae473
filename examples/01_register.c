/* Registers a live surface on its reference and prints the six numbers of the patient's displacement.
 * cc 01_register.c $(pkg-config --cflags --libs sgrt) -lm */
#include <math.h>
#include <sgrt.h>
#include <stdio.h>

enum { SIDE = 41 };

/* A skin of two bumps over 160 x 160 mm, moved by (3, -2, 1.5) mm and turned by 1 degree about Z if `moved`. */
static sgrt_status make_skin(int moved, sgrt_surface** surface) {
  const double origin_mm[2] = {-80, -80}, spacing_mm[2] = {4, 4};
  const double turn = moved ? 3.14159265358979 / 180 : 0, c = cos(turn), s = sin(turn);
  double z[SIDE][SIDE];
  for (int i = 0; i < SIDE; ++i) {
    for (int j = 0; j < SIDE; ++j) {
      double x = -80 + 4 * j - 3 * moved, y = -80 + 4 * i + 2 * moved;
      double u = c * x + s * y, v = -s * x + c * y;
      z[i][j] = 50 * exp(-(u * u + 2 * v * v) / 4000) + 15 * exp(-((u - 40) * (u - 40) + (v - 30) * (v - 30)) / 500) +
                1.5 * moved;
    }
  }
  sgrt_view view = sgrt_view_of(z, SGRT_F64, SIDE, SIDE, 0);
  return sgrt_surface_from_height_field(NULL, &view, origin_mm, spacing_mm, surface);
}

int main(void) {
  const double isocentre_mm[3] = {0, 0, 0};
  sgrt_surface *reference = NULL, *live = NULL;
  sgrt_icp* result = NULL;
  sgrt_icp_info info = {.struct_size = sizeof info};
  sgrt_status status = make_skin(0, &reference);
  if (!status) status = make_skin(1, &live);
  if (!status) status = sgrt_icp_align(NULL, reference, live, isocentre_mm, NULL, NULL, NULL, &result);
  if (!status) status = sgrt_icp_summary(result, &info);
  if (!status) {
    const sgrt_patient_displacement* d = &info.displacement;
    printf("LAT %+.2f mm  LNG %+.2f mm  VRT %+.2f mm\n", d->lat_mm, d->lng_mm, d->vrt_mm);
    printf("pitch %+.2f deg  roll %+.2f deg  rtn %+.2f deg\n", d->pitch_deg, d->roll_deg, d->rtn_deg);
    printf("verdict: %s\n", sgrt_icp_text(result, SGRT_ICP_VERDICT, 0));
  } else {
    fprintf(stderr, "%s: %s\n", sgrt_status_word(status), sgrt_last_error());
  }
  sgrt_icp_free(result);
  sgrt_surface_free(live);
  sgrt_surface_free(reference);
  return status ? 1 : 0;
}
