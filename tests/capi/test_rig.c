/* The rig: texts, cameras, projection against the equations written out here, rays back, bad JSON. */
#include "check.h"

/* Two cameras: one at the room's axes moved by (10, 20, 1000) with distortion, one a pinhole turned by 90 deg about z.
 */
static const char kRig[] =
    "{\"schema\": \"sgrt-rig/1\", \"id\": \"room 7 \\u00e4\", \"room\": \"IEC 61217 fixed, mm\", \"note\": {\"kept\": "
    "[1, 2]},"
    " \"cameras\": ["
    "  {\"id\": \"left\", \"image_size\": [640, 480], \"model\": \"brown5\", \"intrinsics\": [800, 810, 321.5, 239.25],"
    "   \"distortion\": [-0.1, 0.02, 0.001, -0.002, 0.003],"
    "   \"camera_from_room\": [[1, 0, 0, 10], [0, 1, 0, 20], [0, 0, 1, 1000], [0, 0, 0, 1]]},"
    "  {\"id\": \"right\", \"image_size\": [320, 240], \"model\": \"pinhole\", \"intrinsics\": [400, 400, 160, 120],"
    "   \"camera_from_room\": [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 900], [0, 0, 0, 1]]}],"
    " \"pairs\": [{\"id\": \"pod\", \"left\": \"left\", \"right\": \"right\"}]}";

static sgrt_rig* rig_of(const char* text) {
  sgrt_rig* rig = NULL;
  CHECK_OK(sgrt_rig_from_json(text, strlen(text), &rig));
  if (!rig) exit(2);
  return rig;
}

static void test_texts(const sgrt_rig* rig) {
  sgrt_rig_info info;
  sgrt_rig* again;
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_rig_summary(rig, &info));
  CHECK(info.camera_count == 2 && info.pair_count == 1 && info.tof_count == 0);
  CHECK(strcmp(sgrt_rig_text(rig, SGRT_RIG_ID, 0), "room 7 \xc3\xa4") == 0);
  CHECK(strcmp(sgrt_rig_text(rig, SGRT_RIG_ROOM, 0), "IEC 61217 fixed, mm") == 0);
  CHECK(strcmp(sgrt_rig_text(rig, SGRT_RIG_CAMERA_ID, 1), "right") == 0);
  CHECK(strcmp(sgrt_rig_text(rig, SGRT_RIG_PAIR_ID, 0), "pod") == 0);
  CHECK(strcmp(sgrt_rig_text(rig, SGRT_RIG_PAIR_LEFT, 0), "left") == 0);
  CHECK(strcmp(sgrt_rig_text(rig, SGRT_RIG_PAIR_RIGHT, 0), "right") == 0);
  CHECK(!sgrt_rig_text(NULL, SGRT_RIG_ID, 0) && !sgrt_rig_text(rig, 0, 0) && !sgrt_rig_text(rig, 8, 0));
  CHECK(!sgrt_rig_text(rig, SGRT_RIG_ID, 1) && !sgrt_rig_text(rig, SGRT_RIG_CAMERA_ID, 2));
  CHECK(!sgrt_rig_text(rig, SGRT_RIG_CAMERA_ID, -1) && !sgrt_rig_text(rig, SGRT_RIG_PAIR_ID, 1));
  CHECK(strstr(sgrt_rig_text(rig, SGRT_RIG_JSON, 0), "kept") != NULL); /* an unknown key */
  again = rig_of(sgrt_rig_text(rig, SGRT_RIG_JSON, 0));
  CHECK(strcmp(sgrt_rig_text(again, SGRT_RIG_JSON, 0), sgrt_rig_text(rig, SGRT_RIG_JSON, 0)) == 0);
  sgrt_rig_free(again);
  sgrt_rig_free(NULL);
}

static void test_camera(const sgrt_rig* rig) {
  sgrt_rig_camera c;
  memset(&c, 0, sizeof c);
  CHECK_INVALID(sgrt_rig_camera_get(rig, 0, &c), "camera.struct_size: 0");
  c.struct_size = sizeof c;
  CHECK_INVALID(sgrt_rig_camera_get(rig, 2, &c), "index: 2, expected a camera, 0 to 1");
  CHECK_INVALID(sgrt_rig_camera_get(rig, -1, &c), "index: -1");
  CHECK_INVALID(sgrt_rig_camera_get(NULL, 0, &c), "rig: NULL");
  CHECK_INVALID(sgrt_rig_camera_get(rig, 0, NULL), "camera: NULL");
  CHECK(c.width == 0);
  CHECK_OK(sgrt_rig_camera_get(rig, 0, &c));
  CHECK(c.width == 640 && c.height == 480 && c.distortion_count == 5 && c.intrinsics[1] == 810);
  CHECK(c.distortion[1] == 0.02 && c.distortion[4] == 0.003 && c.distortion[5] == 0);
  CHECK(c.camera_from_room[11] == 1000 && c.camera_from_room[15] == 1);
}

/* OpenCV's equations of camera `left`. */
static void project_here(const double x[3], double pixel[2]) {
  const double u = (x[0] + 10) / (x[2] + 1000), v = (x[1] + 20) / (x[2] + 1000), r2 = u * u + v * v;
  const double radial = 1 + r2 * (-0.1 + r2 * (0.02 + r2 * 0.003));
  pixel[0] = 800 * (u * radial + 2 * 0.001 * u * v - 0.002 * (r2 + 2 * u * u)) + 321.5;
  pixel[1] = 810 * (v * radial + 0.001 * (r2 + 2 * v * v) + 2 * -0.002 * u * v) + 239.25;
}

enum { kN = 8 };
static const double kX[kN][3] = {{0, 0, 0},     {150, -80, 40}, {-300, 200, -100}, {33, 44, 2000},
                                 {0, 0, -1500}, {NAN, 0, 0},    {0, 0, INFINITY},  {INFINITY, 0, INFINITY}};

static void test_project(const sgrt_rig* rig) {
  double pixels[kN][2], jacobian[kN][2][3], wide[kN][2][4], expected[2], ahead[2];
  sgrt_view x = sgrt_view_of(kX, SGRT_F64, kN, 3, 0);
  sgrt_mut_view p = sgrt_mut_view_of(pixels, SGRT_F64, kN, 2, 0), j = sgrt_mut_view_of(jacobian, SGRT_F64, kN, 2, 3);
  int i, k, d;
  CHECK_OK(sgrt_rig_project(NULL, rig, "left", &x, &p, &j));
  for (i = 0; i < 4; ++i) {
    project_here(kX[i], expected);
    for (d = 0; d < 2; ++d) CHECK_NEAR(pixels[i][d], expected[d], 1e-10);
    for (k = 0; k < 3; ++k) {
      double moved[3];
      memcpy(moved, kX[i], sizeof moved);
      moved[k] += 1e-3;
      project_here(moved, ahead);
      for (d = 0; d < 2; ++d) CHECK_NEAR(jacobian[i][d][k], (ahead[d] - expected[d]) / 1e-3, 1e-6);
    }
  }
  for (i = 4; i < kN; ++i) CHECK(isnan(pixels[i][0]) && isnan(pixels[i][1]) && isnan(jacobian[i][1][2]));
  /* Without the jacobian, and a jacobian of any stride: the same numbers. */
  memset(wide, 0, sizeof wide);
  j = sgrt_mut_view_of(wide, SGRT_F64, kN, 2, 3);
  j.strides[0] = 64, j.strides[1] = 32, j.strides[2] = 8;
  CHECK_OK(sgrt_rig_project(NULL, rig, "left", &x, &p, &j));
  for (i = 0; i < 4; ++i) CHECK(!memcmp(wide[i][1], jacobian[i][1], 24) && wide[i][1][3] == 0);
  CHECK_OK(sgrt_rig_project(NULL, rig, "left", &x, &p, NULL));
  project_here(kX[1], expected);
  CHECK_NEAR(pixels[1][1], expected[1], 1e-10);
  x.shape[0] = 0; /* nothing to do */
  p.shape[0] = 0;
  CHECK_OK(sgrt_rig_project(NULL, rig, "left", &x, &p, NULL));
}

/* REQ-RIG-007 */
static void test_unproject(const sgrt_rig* rig) {
  double pixels[4][2] = {{0}}, rays[4][3], jacobian[4][3][2], centre[3] = {7, 7, 7};
  sgrt_view in = sgrt_view_of(pixels, SGRT_F64, 4, 2, 0);
  sgrt_mut_view out = sgrt_mut_view_of(rays, SGRT_F64, 4, 3, 0), j = sgrt_mut_view_of(jacobian, SGRT_F64, 4, 3, 2);
  int i, d;
  for (i = 0; i < 4; ++i) project_here(kX[i], pixels[i]);
  pixels[3][0] = NAN;
  CHECK_OK(sgrt_rig_unproject(NULL, rig, "left", &in, &out, &j, centre));
  CHECK(centre[0] == -10 && centre[1] == -20 && centre[2] == -1000);
  for (i = 0; i < 3; ++i) {
    double ray[3], length = 0;
    for (d = 0; d < 3; ++d) ray[d] = kX[i][d] - centre[d], length += ray[d] * ray[d];
    for (d = 0; d < 3; ++d) CHECK_NEAR(rays[i][d], ray[d] / sqrt(length), 1e-12);
    /* A step of the pixel moves the ray across itself. */
    CHECK_NEAR(jacobian[i][0][0] * rays[i][0] + jacobian[i][1][0] * rays[i][1] + jacobian[i][2][0] * rays[i][2], 0,
               1e-15);
    CHECK(jacobian[i][0][0] > 1e-3 && jacobian[i][0][0] < 1.4e-3);
  }
  CHECK(isnan(rays[3][0]) && isnan(rays[3][2]) && isnan(jacobian[3][0][0]));
  pixels[3][0] = INFINITY;
  CHECK_OK(sgrt_rig_unproject(NULL, rig, "left", &in, &out, NULL, NULL));
  CHECK(isnan(rays[3][0]) && isnan(rays[3][2]));
}

static void test_bad_arguments(const sgrt_rig* rig) {
  static double x[12000][3];
  static double pixels[12000][2];
  float single[3][2];
  sgrt_view in = sgrt_view_of(x, SGRT_F64, 3, 3, 0), wrong = sgrt_view_of(x, SGRT_F64, 3, 2, 0), none = in;
  sgrt_mut_view out = sgrt_mut_view_of(pixels, SGRT_F64, 3, 2, 0), bad = out;
  sgrt_context* context;
  int32_t threads;
  sgrt_rig_info info;
  info.struct_size = sizeof info;
  CHECK_INVALID(sgrt_rig_summary(rig, NULL), "info: NULL");
  CHECK_INVALID(sgrt_rig_project(NULL, NULL, "left", &in, &out, NULL), "rig: NULL");
  CHECK_INVALID(sgrt_rig_project(NULL, rig, NULL, &in, &out, NULL), "camera_id: NULL");
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "middle", &in, &out, NULL), "middle");
  CHECK(strstr(sgrt_last_error(), "left") && strstr(sgrt_last_error(), "right")); /* the known ones */
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", NULL, &out, NULL), "x_in_room: NULL");
  none.data = NULL;
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &none, &out, NULL), "x_in_room: NULL");
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &wrong, &out, NULL), "x_in_room: shape 3 x 2, expected any x 3");
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &in, NULL, NULL), "pixels: NULL");
  bad.shape[0] = 2;
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &in, &bad, NULL), "pixels: shape 2 x 2, expected 3 x 2");
  bad = sgrt_mut_view_of(single, SGRT_F32, 3, 2, 0);
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &in, &bad, NULL), "pixels: float32, expected float64");
  bad = sgrt_mut_view_of(x, SGRT_F64, 3, 2, 0);
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &in, &bad, NULL), "pixels: overlaps x_in_room");
  bad = sgrt_mut_view_of(pixels, SGRT_F64, 3, 2, 3);
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &in, &out, &bad), "jacobian: overlaps pixels");
  bad = sgrt_mut_view_of(x, SGRT_F64, 3, 2, 3);
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &in, &out, &bad), "jacobian: overlaps x_in_room");
  bad.shape[2] = 2;
  CHECK_INVALID(sgrt_rig_project(NULL, rig, "left", &in, &out, &bad), "jacobian: shape 3 x 2 x 2, expected 3 x 2 x 3");
  CHECK_INVALID(sgrt_rig_unproject(NULL, rig, "left", NULL, &out, NULL, NULL), "pixels: NULL");
  CHECK_INVALID(sgrt_rig_unproject(NULL, rig, "left", &in, &out, NULL, NULL), "pixels: shape 3 x 3, expected any x 2");
  CHECK_INVALID(sgrt_rig_unproject(NULL, rig, "left", &wrong, NULL, NULL, NULL), "directions: NULL");
  CHECK_INVALID(sgrt_rig_unproject(NULL, rig, "", &wrong, &out, NULL, NULL), "''");
  in = sgrt_view_of(x, SGRT_F64, 12000, 3, 0);
  out = sgrt_mut_view_of(pixels, SGRT_F64, 12000, 2, 0);
  for (threads = 1; threads < 4; ++threads) {
    context = context_of(threads, cancel, NULL);
    CHECK_STATUS(sgrt_rig_project(context, rig, "left", &in, &out, NULL), SGRT_E_CANCELLED, "cancelled");
    sgrt_context_free(context);
  }
  CHECK(pixels[0][0] == 0 && pixels[2][1] == 0 && pixels[11999][1] == 0);
}

/* The rig's text with one part replaced. */
static void with(const char* part, const char* instead, sgrt_status status, const char* words) {
  static char text[4096];
  const char* at = strstr(kRig, part);
  sgrt_rig* rig = CANARY(sgrt_rig);
  CHECK(at != NULL);
  if (!at) return;
  sprintf(text, "%.*s%s%s", (int)(at - kRig), kRig, instead, at + strlen(part));
  CHECK_STATUS(sgrt_rig_from_json(text, strlen(text), &rig), status, words);
  CHECK(rig == CANARY(sgrt_rig));
}

/* REQ-RIG-001 */
static void test_bad_json(void) {
  static char deep[64], large[(16 << 20) + 2];
  sgrt_rig* rig = CANARY(sgrt_rig);
  with("sgrt-rig/1", "sgrt-rig/2", SGRT_E_FORMAT, "schema");
  with("\"brown5\"", "\"fisheye\"", SGRT_E_FORMAT, "cameras[0].model");
  with("[640, 480]", "[640]", SGRT_E_FORMAT, "cameras[0].image_size");
  with("[640, 480]", "[640, 40000]", SGRT_E_LIMIT, "cameras[0].image_size");
  with("[400, 400, 160, 120]", "[400, -400, 160, 120]", SGRT_E_FORMAT, "cameras[1].intrinsics");
  with("[400, 400, 160, 120]", "\"no\"", SGRT_E_FORMAT, "cameras[1].intrinsics");
  with("\"intrinsics\": [400, 400, 160, 120],", "", SGRT_E_FORMAT, "cameras[1].intrinsics");
  with("[-0.1, 0.02", "[-20, 0.02", SGRT_E_FORMAT, "cameras[0].distortion");
  with("[0, -1, 0, 0]", "[0, -1.01, 0, 0]", SGRT_E_FORMAT, "cameras[1].camera_from_room");
  with("\"id\": \"right\"", "\"id\": \"left\"", SGRT_E_FORMAT, "cameras[1].id");
  with("\"right\": \"right\"", "\"right\": \"top\"", SGRT_E_FORMAT, "pairs[0].right");
  with("\"id\": \"right\"", "\"id\": \"ri\\u0000ght\"", SGRT_E_FORMAT, "cameras[1].id"); /* no C string holds it */
  with("}]}", "}]", SGRT_E_FORMAT, "rig: not JSON");
  CHECK_STATUS(sgrt_rig_from_json("", 0, &rig), SGRT_E_FORMAT, "rig: not JSON");
  CHECK_STATUS(sgrt_rig_from_json(kRig, sizeof kRig / 2, &rig), SGRT_E_FORMAT, "rig: not JSON");
  memset(deep, '[', sizeof deep);
  CHECK_STATUS(sgrt_rig_from_json(deep, sizeof deep, &rig), SGRT_E_LIMIT, "16");
  memset(large, ' ', sizeof large);
  CHECK_STATUS(sgrt_rig_from_json(large, sizeof large, &rig), SGRT_E_LIMIT, "16");
  CHECK_INVALID(sgrt_rig_from_json(NULL, 3, &rig), "text: NULL");
  CHECK_INVALID(sgrt_rig_from_json(kRig, sizeof kRig - 1, NULL), "rig: NULL");
  CHECK(rig == CANARY(sgrt_rig));
}

int main(void) {
  sgrt_rig* rig = rig_of(kRig);
  test_texts(rig);
  test_camera(rig);
  test_project(rig);
  test_unproject(rig);
  test_bad_arguments(rig);
  test_bad_json();
  sgrt_rig_free(rig);
  return check_result();
}
