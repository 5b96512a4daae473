/* Boards and calibration: made correspondences of two cameras, exact, against the cameras they were made with; then the
 * check, the room, uncertainty, and bad arguments. */
#include "check.h"

enum { COLUMNS = 7, ROWS = 5, POINTS = COLUMNS * ROWS, BOARDS = 12, CAMERAS = 2, MOST = POINTS * BOARDS * CAMERAS };

static const double kLens[CAMERAS][9] = {{800, 805, 322, 243, -0.1, 0.05, 1e-3, -5e-4, 0},
                                         {820, 818, 315, 238, -0.08, 0.02, 0, 1e-3, 0}};
static const double kBase = 100; /* the right camera stands so far to the right, turned by kTurn about y */
static const double kTurn = -0.1;

static double points[POINTS][3], pixels[MOST][2];
static int32_t triples[MOST][3];
static int sights;

static void turn(const double w[3], const double x[3], double y[3]) { /* Rodrigues */
  double a = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]), c = cos(a), s = sin(a), d = 0, k[3];
  int i;
  for (i = 0; i < 3; ++i) k[i] = a > 0 ? w[i] / a : 0;
  for (i = 0; i < 3; ++i) d += k[i] * x[i];
  for (i = 0; i < 3; ++i) {
    int j = (i + 1) % 3, l = (i + 2) % 3;
    y[i] = x[i] * c + (k[j] * x[l] - k[l] * x[j]) * s + k[i] * d * (1 - c);
  }
}

static void project_to(int camera, const double room[3], double pixel[2]) {
  const double* l = kLens[camera];
  double p[3] = {room[0], room[1], room[2]}, x, y, u, radial;
  if (camera == 1) {
    double q[3] = {room[0] - kBase, room[1], room[2]}, w[3] = {0, 0, 0};
    w[1] = kTurn;
    turn(w, q, p);
  }
  x = p[0] / p[2];
  y = p[1] / p[2];
  u = x * x + y * y;
  radial = 1 + u * (l[4] + u * l[5]);
  pixel[0] = l[0] * (x * radial + 2 * l[6] * x * y + l[7] * (u + 2 * x * x)) + l[2];
  pixel[1] = l[1] * (y * radial + l[6] * (u + 2 * y * y) + 2 * l[7] * x * y) + l[3];
}

static void see(uint32_t seed) {
  int b, i, c, k;
  sights = 0;
  for (b = 0; b < BOARDS; ++b) {
    double w[3], t[3];
    for (k = 0; k < 3; ++k) w[k] = (chance(&seed) - 0.5) * 1.2;
    t[0] = 30 + (chance(&seed) - 0.5) * 120;
    t[1] = (chance(&seed) - 0.5) * 100;
    t[2] = 500 + chance(&seed) * 250;
    for (c = 0; c < CAMERAS; ++c) {
      for (i = 0; i < POINTS; ++i) {
        double from[3] = {points[i][0] - 60, points[i][1] - 40, 0}, room[3], *p = pixels[sights];
        turn(w, from, room);
        for (k = 0; k < 3; ++k) room[k] += t[k];
        project_to(c, room, p);
        if (p[0] < 0 || p[1] < 0 || p[0] > 639 || p[1] > 479) continue;
        triples[sights][0] = c;
        triples[sights][1] = b;
        triples[sights][2] = i;
        ++sights;
      }
    }
  }
}

static const char* const kIds[] = {"left", "right"};
static const char* const kPairs[] = {"pod"};
static int32_t sizes[2][2] = {{640, 480}, {640, 480}}, sides[1][2] = {{0, 1}};

static sgrt_calibration_data data_of(void) {
  sgrt_calibration_data d;
  CHECK_OK(sgrt_calibration_data_init(&d, sizeof d));
  d.camera_count = 2;
  d.placement_count = BOARDS;
  d.pair_count = 1;
  d.camera_ids = kIds;
  d.pair_ids = kPairs;
  d.image_sizes = sgrt_view_of(sizes, SGRT_I32, 2, 2, 0);
  d.pair_cameras = sgrt_view_of(sides, SGRT_I32, 1, 2, 0);
  d.points = sgrt_view_of(points, SGRT_F64, POINTS, 3, 0);
  d.index = sgrt_view_of(triples, SGRT_I32, sights, 3, 0);
  d.pixels = sgrt_view_of(pixels, SGRT_F64, sights, 2, 0);
  return d;
}

static void test_board(void) {
  sgrt_board board;
  sgrt_board_info info;
  sgrt_mut_view view = sgrt_mut_view_of(points, SGRT_F64, POINTS, 3, 0);
  static uint8_t image[60][80];
  double at[POINTS][2];
  sgrt_view grey = sgrt_view_of(image, SGRT_U8, 60, 80, 0);
  sgrt_mut_view out = sgrt_mut_view_of(at, SGRT_F64, POINTS, 2, 0);
  CHECK_OK(sgrt_board_init(&board, sizeof board));
  board.columns = COLUMNS;
  board.rows = ROWS;
  CHECK_INVALID(sgrt_board_points(&board, &view), "board.spacing_mm: 0");
  board.spacing_mm = 20;
  CHECK_OK(sgrt_board_points(&board, &view));
  CHECK(points[COLUMNS + 2][0] == 40 && points[COLUMNS + 2][1] == 20 && points[COLUMNS + 2][2] == 0);
  info.struct_size = sizeof info;
  CHECK_STATUS(sgrt_board_detect(NULL, &board, &grey, &out, NULL, &info), SGRT_E_NOT_FOUND, "no chessboard seen");
  CHECK(info.found_count == 0 && info.seen_columns == 0 && info.half_turn_ambiguous == 1 && at[3][1] != at[3][1]);
  CHECK_INVALID(sgrt_board_detect(NULL, NULL, &grey, &out, NULL, NULL), "board: NULL");
  CHECK_INVALID(sgrt_board_detect(NULL, &board, NULL, &out, NULL, NULL), "image");
  CHECK_INVALID(sgrt_board_detect(NULL, &board, &grey, NULL, NULL, NULL), "pixels");
  board.kind = 3;
  CHECK_INVALID(sgrt_board_points(&board, &view), "board.kind: 3");
}

static sgrt_rig* test_solve(void) {
  sgrt_calibration_data data = data_of();
  sgrt_calibration_options options;
  sgrt_calibration_info info;
  sgrt_calibration* result = NULL;
  sgrt_rig* rig = NULL;
  sgrt_rig_camera camera;
  sgrt_view view;
  int i;
  CHECK_OK(sgrt_calibration_options_init(&options, sizeof options));
  CHECK(options.distortion_count == 5 && options.min_views == 3 && options.split_half == 1);
  options.split_half = 0;
  options.rig_id = "C rig";
  CHECK_OK(sgrt_calibration_solve(NULL, &data, &options, &result));
  if (!result) exit(2);
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_calibration_summary(result, &info));
  CHECK(info.status == SGRT_OK && info.camera_count == 2 && info.corner_count > 300 && info.discarded_count <= 4);
  CHECK(info.rms_px < 1e-3 && info.expected_rms_px != info.expected_rms_px);
  CHECK(strstr(sgrt_calibration_text(result, SGRT_CALIBRATION_REPORT, 0), "sgrt-calibration/1") != NULL);
  CHECK(strcmp(sgrt_calibration_text(result, SGRT_CALIBRATION_PARAMETER, 15), "right.fx") == 0);
  CHECK(!sgrt_calibration_text(result, SGRT_CALIBRATION_PARAMETER, 30) && !sgrt_calibration_text(NULL, 1, 0));
  CHECK_OK(sgrt_calibration_array(result, SGRT_CALIBRATION_COVARIANCE, &view));
  CHECK(view.ndim == 2 && view.shape[0] == 30 && view.shape[1] == 30);
  CHECK_OK(sgrt_calibration_array(result, SGRT_CALIBRATION_CORNERS, &view));
  CHECK(view.shape[1] == 8);
  CHECK_INVALID(sgrt_calibration_array(result, 9, &view), "field: 9");
  CHECK_OK(sgrt_calibration_rig(result, &rig));
  camera.struct_size = sizeof camera;
  CHECK_OK(sgrt_rig_camera_get(rig, 1, &camera));
  for (i = 0; i < 4; ++i) CHECK_NEAR(camera.intrinsics[i], kLens[1][i], 0.05);
  CHECK_NEAR(camera.camera_from_room[3], -kBase * cos(kTurn), 0.02);
  CHECK(strcmp(sgrt_rig_text(rig, SGRT_RIG_ID, 0), "C rig") == 0 &&
        strcmp(sgrt_rig_text(rig, SGRT_RIG_PAIR_ID, 0), "pod") == 0);
  sgrt_calibration_free(result);
  sgrt_calibration_free(NULL);
  return rig;
}

static void test_check_and_uncertainty(const sgrt_rig* rig) {
  sgrt_calibration_data data;
  sgrt_calibration_info info;
  sgrt_calibration* result = NULL;
  double x[2][3] = {{0, 0, 600}, {0, 0, -5}}, covariance[2][6];
  sgrt_view at = sgrt_view_of(x, SGRT_F64, 2, 3, 0);
  sgrt_mut_view out3 = sgrt_mut_view_of(covariance, SGRT_F64, 2, 3, 0),
                out6 = sgrt_mut_view_of(covariance, SGRT_F64, 2, 6, 0);
  see(77);
  data = data_of();
  CHECK_OK(sgrt_calibration_check(NULL, rig, &data, NULL, &result));
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_calibration_summary(result, &info));
  CHECK(info.rms_px < 2e-3);
  sgrt_calibration_free(result);
  CHECK_INVALID(sgrt_calibration_check(NULL, NULL, &data, NULL, &result), "rig: NULL");
  CHECK_OK(sgrt_rig_pixel_covariance(NULL, rig, "right", &at, &out3));
  CHECK(covariance[0][0] > 0 && covariance[0][2] > 0 && covariance[0][3] != covariance[0][3]); /* row 1 follows: NaN */
  CHECK_OK(sgrt_rig_point_covariance(NULL, rig, "pod", &at, 0.1, &out6));
  CHECK(covariance[0][5] > covariance[0][0] && covariance[1][0] != covariance[1][0]);
  CHECK_INVALID(sgrt_rig_point_covariance(NULL, rig, "pod9", &at, 0.1, &out6), "pod9");
  CHECK_INVALID(sgrt_rig_point_covariance(NULL, rig, "pod", &at, -1, &out6), "noise_px: -1");
  CHECK_INVALID(sgrt_rig_pixel_covariance(NULL, rig, "none", &at, &out3), "none");
}

static void test_room(const sgrt_rig* rig) {
  /* The phantom's frame is the rig's moved by (5, -7, 600). */
  const double place[6][3] = {{0, 0, 0}, {50, 0, 0}, {0, 50, 0}, {0, 0, 50}, {-40, 30, 20}, {30, -40, -20}};
  sgrt_calibration_data data = data_of();
  sgrt_calibration* result = NULL;
  sgrt_rig* out = NULL;
  sgrt_rig_camera camera;
  int c, i;
  sights = 0;
  for (c = 0; c < 2; ++c) {
    for (i = 0; i < 6; ++i) {
      double at[3] = {place[i][0] + 5, place[i][1] - 7, place[i][2] + 600};
      project_to(c, at, pixels[sights]);
      triples[sights][0] = c;
      triples[sights][1] = 0;
      triples[sights++][2] = i;
    }
  }
  data.placement_count = 1;
  data.pair_count = 0;
  data.points = sgrt_view_of(place, SGRT_F64, 6, 3, 0);
  data.index = sgrt_view_of(triples, SGRT_I32, sights, 3, 0);
  data.pixels = sgrt_view_of(pixels, SGRT_F64, sights, 2, 0);
  CHECK_OK(sgrt_calibration_room(NULL, &rig, 1, &data, NULL, &result));
  CHECK_OK(sgrt_calibration_rig(result, &out));
  camera.struct_size = sizeof camera;
  CHECK_OK(sgrt_rig_camera_get(out, 0, &camera));
  CHECK_NEAR(camera.camera_from_room[3], 5, 0.05);
  CHECK_NEAR(camera.camera_from_room[7], -7, 0.05);
  CHECK_NEAR(camera.camera_from_room[11], 600, 0.2);
  CHECK_INVALID(sgrt_calibration_room(NULL, NULL, 1, &data, NULL, &result), "rigs: NULL");
  CHECK_INVALID(sgrt_calibration_room(NULL, &rig, 0, &data, NULL, &result), "count: 0");
  sgrt_rig_free(out);
  sgrt_calibration_free(result);
}

static void test_bad(void) {
  sgrt_calibration_data data;
  sgrt_calibration_options options;
  sgrt_calibration* result = NULL;
  sgrt_rig* rig = CANARY(sgrt_rig);
  see(1);
  data = data_of();
  CHECK_INVALID(sgrt_calibration_solve(NULL, NULL, NULL, &result), "data: NULL");
  CHECK_INVALID(sgrt_calibration_solve(NULL, &data, NULL, NULL), "result: NULL");
  data.camera_ids = NULL;
  CHECK_INVALID(sgrt_calibration_solve(NULL, &data, NULL, &result), "data.camera_ids: NULL");
  data = data_of();
  data.camera_count = 65;
  CHECK_INVALID(sgrt_calibration_solve(NULL, &data, NULL, &result), "data.camera_count: 65");
  data = data_of();
  data.index.dtype = SGRT_F32;
  CHECK_INVALID(sgrt_calibration_solve(NULL, &data, NULL, &result), "data.index");
  data = data_of();
  CHECK_OK(sgrt_calibration_options_init(&options, sizeof options));
  options.distortion_count = 4;
  CHECK_INVALID(sgrt_calibration_solve(NULL, &data, &options, &result), "options.distortion_count: 4");
  CHECK(result == NULL);
  /* Two placements: no answer, but a result to read. */
  {
    int i, n = 0;
    for (i = 0; i < sights; ++i) n = triples[i][1] < 2 ? i + 1 : n;
    data.index = sgrt_view_of(triples, SGRT_I32, n, 3, 0);
    data.pixels = sgrt_view_of(pixels, SGRT_F64, n, 2, 0);
  }
  CHECK_STATUS(sgrt_calibration_solve(NULL, &data, NULL, &result), SGRT_E_INSUFFICIENT_DATA, "expected at least 3");
  CHECK(result != NULL &&
        strstr(sgrt_calibration_text(result, SGRT_CALIBRATION_REPORT, 0), "insufficient_data") != NULL);
  CHECK_STATUS(sgrt_calibration_rig(result, &rig), SGRT_E_NOT_FOUND, "it has no rig");
  CHECK(rig == CANARY(sgrt_rig));
  sgrt_calibration_free(result);
  result = NULL;
  {
    int calls = 0;
    sgrt_context* context = context_of(1, cancel, &calls);
    data = data_of();
    CHECK_STATUS(sgrt_calibration_solve(context, &data, NULL, &result), SGRT_E_CANCELLED, "");
    CHECK(calls > 0 && result == NULL);
    sgrt_context_free(context);
  }
}

int main(void) {
  sgrt_rig* rig;
  test_board();
  see(1);
  rig = test_solve();
  test_check_and_uncertainty(rig);
  test_room(rig);
  test_bad();
  sgrt_rig_free(rig);
  return check_result();
}
