/* The skin of a ball in a volume, and a cylinder from contours: their known size, and every bad argument. */
#include "surfaces.h"

enum { kSide = 48, kVoxels = kSide * kSide * kSide, kRound = 90, kSlices = 5 };
static int16_t voxels[kVoxels];
static double contours[kSlices * kRound * 3];
static int32_t lengths[kSlices];
static const double kPi = 3.14159265358979323846;

/* A ball of 15 mm about the origin, its edge blurred by about a voxel. */
static void fill(double frame[16]) {
  int x, y, z, i = 0;
  for (z = 0; z < kSide; ++z)
    for (y = 0; y < kSide; ++y)
      for (x = 0; x < kSide; ++x) {
        const double a = x - 23.5, b = y - 23.5, c = z - 23.5;
        voxels[i++] = (int16_t)(-1000 + 1000 / (1 + exp((sqrt(a * a + b * b + c * c) - 15) / 0.4)));
      }
  memset(frame, 0, 16 * sizeof *frame);
  frame[0] = frame[5] = frame[10] = frame[15] = 1;
  frame[3] = frame[7] = frame[11] = -23.5;
}

static sgrt_volume_info info_of(const sgrt_volume* volume) {
  sgrt_volume_info info;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_volume_summary(volume, &info));
  return info;
}

static void test_skin(void) {
  double frame[16];
  sgrt_view view = sgrt_view_of(voxels, SGRT_I16, kSide, kSide, kSide), array;
  sgrt_volume* volume = NULL;
  sgrt_surface* surface = NULL;
  sgrt_volume_info info;
  const double* p;
  int64_t i;
  fill(frame);
  CHECK_OK(sgrt_volume_skin(NULL, &view, frame, NULL, &volume));
  info = info_of(volume);
  CHECK(info.couch_found == 0 && info.slice_count == kSide && info.flag_count[0] == 0);
  CHECK_NEAR(info.volume_mm3 / (4.0 / 3 * kPi * 15 * 15 * 15), 1, 0.01);
  CHECK_NEAR(info.contrast_hu, 1000, 20);
  CHECK_OK(sgrt_volume_array(volume, SGRT_VOLUME_POINTS, &array));
  CHECK(array.shape[0] == info.vertex_count && array.shape[1] == 3);
  p = (const double*)array.data;
  for (i = 0; i < info.vertex_count; ++i)
    CHECK_NEAR(sqrt(p[3 * i] * p[3 * i] + p[3 * i + 1] * p[3 * i + 1] + p[3 * i + 2] * p[3 * i + 2]), 15, 0.15);
  CHECK_OK(sgrt_volume_array(volume, SGRT_VOLUME_FLAGS, &array));
  CHECK(array.dtype == SGRT_U8 && array.shape[0] == info.vertex_count);
  CHECK_OK(sgrt_volume_surface(volume, 15, &surface));
  CHECK(summary_of(surface).face_count == info.face_count && numbers_of(surface, SGRT_SURFACE_SIGMA) != NULL);
  sgrt_surface_free(surface);
  CHECK_INVALID(sgrt_volume_array(volume, 7, &array), "field: 7");
  CHECK_INVALID(sgrt_volume_surface(volume, 16, &surface), "without: 16");
  sgrt_volume_free(volume);
}

static void test_bad_volumes(void) {
  double frame[16];
  sgrt_view view = sgrt_view_of(voxels, SGRT_I16, kSide, kSide, kSide), bad;
  sgrt_volume_options o;
  sgrt_volume* volume = CANARY(sgrt_volume);
  int calls = 0;
  sgrt_context* context = context_of(2, cancel, &calls);
  fill(frame);
  CHECK_OK(sgrt_volume_options_init(&o, sizeof o));
  CHECK_INVALID(sgrt_volume_skin(NULL, NULL, frame, NULL, &volume), "voxels");
  CHECK_INVALID(sgrt_volume_skin(NULL, &view, NULL, NULL, &volume), "frame_from_voxel");
  CHECK_INVALID(sgrt_volume_skin(NULL, &view, frame, NULL, NULL), "volume");
  bad = view, bad.dtype = SGRT_F64;
  CHECK_INVALID(sgrt_volume_skin(NULL, &bad, frame, NULL, &volume), "voxels: float64, expected int16");
  bad = view, bad.shape[1] = 1;
  CHECK_INVALID(sgrt_volume_skin(NULL, &bad, frame, NULL, &volume), "voxels: a side of 1, expected 2 or more");
  frame[0] = 0;
  CHECK_INVALID(sgrt_volume_skin(NULL, &view, frame, NULL, &volume), "frame_from_voxel: a spacing of 0");
  frame[0] = 1, frame[12] = 1;
  CHECK_INVALID(sgrt_volume_skin(NULL, &view, frame, NULL, &volume), "frame_from_voxel: a last row");
  frame[12] = 0, frame[3] = NAN;
  CHECK_INVALID(sgrt_volume_skin(NULL, &view, frame, NULL, &volume), "frame_from_voxel");
  frame[3] = 0;
  o.closing_mm = -1;
  CHECK_INVALID(sgrt_volume_skin(NULL, &view, frame, &o, &volume), "options.closing_mm: -1, expected 0 to 50");
  o.closing_mm = 4, o.rescale_slope = 0;
  CHECK_INVALID(sgrt_volume_skin(NULL, &view, frame, &o, &volume), "options.rescale_slope: 0");
  o.rescale_slope = 1, o.down[1] = NAN;
  CHECK_INVALID(sgrt_volume_skin(NULL, &view, frame, &o, &volume), "options.down[1]");
  o.down[1] = 0, o.body_threshold_hu = 3000;
  CHECK_STATUS(sgrt_volume_skin(NULL, &view, frame, &o, &volume), SGRT_E_NOT_FOUND, "no body");
  CHECK_STATUS(sgrt_volume_skin(context, &view, frame, NULL, &volume), SGRT_E_CANCELLED, "");
  CHECK(volume == CANARY(sgrt_volume));
  sgrt_context_free(context);
  sgrt_volume_free(NULL);
}

static void test_contours(void) {
  sgrt_view points = sgrt_view_of(contours, SGRT_F64, kSlices * kRound, 3, 0);
  sgrt_view counts = sgrt_view_of(lengths, SGRT_I32, kSlices, 0, 0);
  sgrt_contours_options o;
  sgrt_volume* volume = NULL;
  sgrt_volume_info info;
  int i;
  for (i = 0; i < kSlices * kRound; ++i) {
    contours[3 * i] = 30 * cos(2 * kPi * i / kRound);
    contours[3 * i + 1] = 30 * sin(2 * kPi * i / kRound);
    contours[3 * i + 2] = 2.5 * (i / kRound);
    lengths[i / kRound] = kRound;
  }
  CHECK_OK(sgrt_contours_close(NULL, &points, &counts, NULL, &volume));
  info = info_of(volume);
  CHECK(info.slice_count == kSlices && info.flag_count[0] > 0 && isnan(info.contrast_hu));
  CHECK_NEAR(info.volume_mm3 / (kPi * 900 * 10), 1, 0.005);
  CHECK_NEAR(info.largest_gap_mm, 2.5, 1e-12);
  sgrt_volume_free(volume);
  volume = CANARY(sgrt_volume);
  CHECK_OK(sgrt_contours_options_init(&o, sizeof o));
  o.pixel_mm = 0;
  CHECK_INVALID(sgrt_contours_close(NULL, &points, &counts, &o, &volume), "options.pixel_mm: 0, expected 0.1 to 10");
  lengths[2] = kRound - 1;
  CHECK_INVALID(sgrt_contours_close(NULL, &points, &counts, NULL, &volume), "lengths: a sum of 449");
  lengths[2] = -4;
  CHECK_INVALID(sgrt_contours_close(NULL, &points, &counts, NULL, &volume), "lengths: -4, expected 3 points");
  lengths[2] = kRound, contours[7] = INFINITY;
  CHECK_INVALID(sgrt_contours_close(NULL, &points, &counts, NULL, &volume), "points");
  CHECK(volume == CANARY(sgrt_volume));
}

int main(void) {
  test_skin();
  test_bad_volumes();
  test_contours();
  return check_result();
}
