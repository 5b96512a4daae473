/* Regions of interest: the even-odd rule, normals, boxes, and what is no region. */
#include "check.h"

enum { kSide = 21 };

/* A flat grid of 21 x 21 points, 1 mm apart from -10 to 10, its normals up. */
static sgrt_surface* flat(void) {
  static double z[kSide * kSide];
  const double origin[2] = {-10, -10}, spacing[2] = {1, 1};
  sgrt_view view = sgrt_view_of(z, SGRT_F64, kSide, kSide, 0);
  sgrt_surface* surface = NULL;
  z[0] = NAN;
  CHECK_OK(sgrt_surface_from_height_field(NULL, &view, origin, spacing, &surface));
  if (!surface) exit(2);
  return surface;
}

/* REQ-ROI-001 */
static void test_polygon(const sgrt_surface* surface) {
  /* A pentagram's cousin: a square ring walked as one path; even-odd leaves the middle out. */
  const float ring[10][2] = {{-8.5f, -8.5f}, {8.5f, -8.5f}, {8.5f, 8.5f}, {-8.5f, 8.5f}, {-8.5f, -8.5f},
                             {-4.5f, -4.5f}, {-4.5f, 4.5f}, {4.5f, 4.5f}, {4.5f, -4.5f}, {-4.5f, -4.5f}};
  uint8_t mask[kSide][kSide];
  sgrt_view view = sgrt_view_of(ring, SGRT_F32, 10, 2, 0);
  sgrt_mut_view out = sgrt_mut_view_of(mask, SGRT_U8, kSide, kSide, 0);
  sgrt_roi* roi = NULL;
  int i, j;
  CHECK_OK(sgrt_roi_from_polygon(&view, &roi));
  CHECK_OK(sgrt_roi_mask(roi, surface, &out));
  for (i = 0; i < kSide; ++i) {
    for (j = 0; j < kSide; ++j) {
      const int x = abs(j - 10), y = abs(i - 10), most = x > y ? x : y;
      CHECK(mask[i][j] == (most <= 8 && most >= 5));
    }
  }
  sgrt_roi_free(roi);
}

/* A point whose normal looks down is outside a polygon, and inside a box. */
static void test_normals_count(void) {
  const double points[6] = {0, 0, 0, 1, 0, 0}, normals[6] = {0, 0, 1, 0, 0, -1};
  const double square[8] = {-5, -5, 5, -5, 5, 5, -5, 5}, low[3] = {-5, -5, -5}, high[3] = {5, 5, 5};
  sgrt_view view = sgrt_view_of(square, SGRT_F64, 4, 2, 0);
  sgrt_surface_data data;
  sgrt_surface* surface = NULL;
  sgrt_roi *polygon = NULL, *box = NULL;
  uint8_t mask[2];
  sgrt_mut_view out = sgrt_mut_view_of(mask, SGRT_U8, 2, 0, 0);
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, 2, 3, 0);
  data.normals = sgrt_view_of(normals, SGRT_F64, 2, 3, 0);
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  CHECK_OK(sgrt_roi_from_polygon(&view, &polygon));
  CHECK_OK(sgrt_roi_from_box(low, high, &box));
  CHECK_OK(sgrt_roi_mask(polygon, surface, &out));
  CHECK(mask[0] == 1 && mask[1] == 0);
  CHECK_OK(sgrt_roi_mask(box, surface, &out));
  CHECK(mask[0] == 1 && mask[1] == 1);
  sgrt_roi_free(polygon);
  sgrt_roi_free(box);
  sgrt_surface_free(surface);
}

/* A polygon turns with the couch, a box only shifts; both lend what they were made from. */
/* REQ-ROI-003 */
static void test_move(void) {
  const double corners[8] = {0, 0, 100, 0, 100, 50, 0, 50}, low[3] = {0, 0, 0}, high[3] = {1, 2, 3}, iso[3] = {0, 0, 0};
  const double shift[16] = {1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1};
  const sgrt_view vertices = sgrt_view_of(corners, SGRT_F64, 4, 2, 0);
  double quarter[16];
  sgrt_roi *polygon = NULL, *box = NULL, *turned = NULL, *shifted = NULL;
  sgrt_view view;
  CHECK_OK(sgrt_frame_couch_turn(90, iso, quarter));
  CHECK_OK(sgrt_roi_from_polygon(&vertices, &polygon));
  CHECK_OK(sgrt_roi_from_box(low, high, &box));
  CHECK_OK(sgrt_roi_move(polygon, quarter, &turned));
  CHECK_OK(sgrt_roi_array(turned, SGRT_ROI_POLYGON, &view));
  CHECK(view.shape[0] == 4 && view.shape[1] == 2);
  CHECK_NEAR(((const double*)view.data)[4], -50, 1e-12);
  CHECK_NEAR(((const double*)view.data)[5], 100, 1e-12);
  CHECK_OK(sgrt_roi_array(turned, SGRT_ROI_BOX, &view));
  CHECK(view.data == NULL);
  CHECK_OK(sgrt_roi_move(box, shift, &shifted));
  CHECK_OK(sgrt_roi_array(shifted, SGRT_ROI_BOX, &view));
  CHECK(view.shape[0] == 2 && view.shape[1] == 3);
  CHECK_NEAR(((const double*)view.data)[0], 5, 0);
  CHECK_NEAR(((const double*)view.data)[5], 10, 0);
  sgrt_roi_free(turned), turned = NULL;
  CHECK_INVALID(sgrt_roi_move(box, quarter, &turned), "a box cannot turn");
  CHECK_INVALID(sgrt_roi_move(NULL, quarter, &turned), "roi: NULL");
  CHECK_INVALID(sgrt_roi_move(polygon, NULL, &turned), "pose: NULL");
  CHECK_INVALID(sgrt_roi_move(polygon, quarter, NULL), "result: NULL");
  CHECK_INVALID(sgrt_roi_array(polygon, 3, &view), "field: 3");
  CHECK_INVALID(sgrt_roi_array(NULL, SGRT_ROI_BOX, &view), "roi: NULL");
  CHECK_INVALID(sgrt_roi_array(polygon, SGRT_ROI_BOX, NULL), "view: NULL");
  CHECK(turned == NULL);
  sgrt_roi_free(shifted), sgrt_roi_free(box), sgrt_roi_free(polygon);
}

static void test_bad_arguments(const sgrt_surface* surface) {
  static double many[10001][2];
  double v[8] = {0, 0, 1, 0, 1, 1, 0, 1};
  const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1}, flat_box[3] = {1, 0, 1}, bad[3] = {0, NAN, 1};
  uint8_t mask[kSide][kSide];
  sgrt_mut_view out = sgrt_mut_view_of(mask, SGRT_U8, kSide, kSide, 0);
  sgrt_view view = sgrt_view_of(v, SGRT_F64, 4, 2, 0), short_one = sgrt_view_of(v, SGRT_F64, 2, 2, 0);
  sgrt_view wrong = sgrt_view_of(v, SGRT_F64, 2, 3, 0), large = sgrt_view_of(many, SGRT_F64, 10001, 2, 0);
  sgrt_roi* roi = CANARY(sgrt_roi);
  CHECK_INVALID(sgrt_roi_from_polygon(NULL, &roi), "vertices_xy_mm: NULL");
  CHECK_INVALID(sgrt_roi_from_polygon(&view, NULL), "roi: NULL");
  CHECK_INVALID(sgrt_roi_from_polygon(&wrong, &roi), "vertices_xy_mm: shape 2 x 3, expected any x 2");
  CHECK_INVALID(sgrt_roi_from_polygon(&short_one, &roi), "vertices_xy_mm: expected at least 3, got 2");
  CHECK_STATUS(sgrt_roi_from_polygon(&large, &roi), SGRT_E_LIMIT, "vertices_xy_mm: 10001");
  view.dtype = SGRT_I32, view.strides[0] = 8, view.strides[1] = 4;
  CHECK_INVALID(sgrt_roi_from_polygon(&view, &roi), "vertices_xy_mm: int32");
  view = sgrt_view_of(v, SGRT_F64, 4, 2, 0);
  v[3] = NAN;
  CHECK_INVALID(sgrt_roi_from_polygon(&view, &roi), "vertices_xy_mm[1]");
  v[3] = 0, v[5] = 0, v[7] = 0; /* on one line */
  CHECK_INVALID(sgrt_roi_from_polygon(&view, &roi), "no area");
  CHECK_INVALID(sgrt_roi_from_box(NULL, high, &roi), "min_mm: NULL");
  CHECK_INVALID(sgrt_roi_from_box(low, NULL, &roi), "max_mm: NULL");
  CHECK_INVALID(sgrt_roi_from_box(low, high, NULL), "roi: NULL");
  CHECK_INVALID(sgrt_roi_from_box(low, flat_box, &roi), "min_mm[1]");
  CHECK_INVALID(sgrt_roi_from_box(low, bad, &roi), "max_mm[1]: nan, expected a finite number");
  CHECK(roi == CANARY(sgrt_roi));
  CHECK_OK(sgrt_roi_from_box(low, high, &roi));
  CHECK_INVALID(sgrt_roi_mask(NULL, surface, &out), "roi: NULL");
  CHECK_INVALID(sgrt_roi_mask(roi, NULL, &out), "surface: NULL");
  sgrt_roi_free(roi);
  sgrt_roi_free(NULL);
}

int main(void) {
  sgrt_surface* surface = flat();
  test_polygon(surface);
  test_normals_count();
  test_move();
  test_bad_arguments(surface);
  sgrt_surface_free(surface);
  return check_result();
}
