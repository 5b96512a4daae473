/* Registers a live surface on its reference and prints the patient's displacement. See README.md on how to link. */
#include <math.h>
#include <sgrt.h>
#include <stdio.h>

/* Two bumps on a grid of 41 x 41 points, 4 mm apart, moved by (dx, dy, dz) mm. NULL if it fails. */
static sgrt_surface* skin(double dx, double dy, double dz) {
  const double origin_mm[2] = {-80, -80}, spacing_mm[2] = {4, 4};
  double z[41][41];
  for (int i = 0; i < 41 * 41; ++i) {
    double x = -80 + 4 * (i % 41) - dx, y = -80 + 4 * (i / 41) - dy;
    z[i / 41][i % 41] = dz + 50 * exp(-(x * x + 2 * y * y) / 4000) + 15 * exp(-(pow(x - 40, 2) + pow(y - 30, 2)) / 500);
  }
  sgrt_view view = sgrt_view_of(z, SGRT_F64, 41, 41, 0);
  sgrt_surface* surface = NULL;
  sgrt_surface_from_height_field(NULL, &view, origin_mm, spacing_mm, &surface);
  return surface;
}

int main(void) {
  const double isocentre_mm[3] = {0, 0, 0};
  sgrt_surface *reference = skin(0, 0, 0), *live = skin(3, -2, 1.5);
  sgrt_icp* result = NULL;
  sgrt_icp_info info = {.struct_size = sizeof info};
  sgrt_status status = sgrt_icp_align(NULL, reference, live, isocentre_mm, NULL, NULL, NULL, &result);
  if (status == SGRT_OK) status = sgrt_icp_summary(result, &info);
  if (status == SGRT_OK) {
    const sgrt_patient_displacement d = info.displacement;
    printf("LAT %+.2f mm  LNG %+.2f mm  VRT %+.2f mm\n", d.lat_mm, d.lng_mm, d.vrt_mm);
    printf("pitch %+.2f deg  roll %+.2f deg  rtn %+.2f deg\n", d.pitch_deg, d.roll_deg, d.rtn_deg);
    printf("verdict: %s\n", sgrt_icp_text(result, SGRT_ICP_VERDICT, 0));
  } else {
    fprintf(stderr, "%s\n", sgrt_last_error());
  }
  sgrt_icp_free(result);
  sgrt_surface_free(live);
  sgrt_surface_free(reference);
  return status != SGRT_OK;
}
