/* Frames: the six numbers against matrices multiplied out here, DICOM positions against where the head and face point.
 */
#include "check.h"

static const double kDegree = 3.14159265358979323846 / 180;

typedef struct {
  double m[3][3];
} turn;

static turn about(int axis, double deg) {
  turn r = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const int i = (axis + 1) % 3, j = (axis + 2) % 3;
  r.m[i][i] = r.m[j][j] = cos(deg * kDegree);
  r.m[j][i] = sin(deg * kDegree);
  r.m[i][j] = -r.m[j][i];
  return r;
}

static turn times(turn a, turn b) {
  turn c;
  int i, j;
  for (i = 0; i < 3; ++i) {
    for (j = 0; j < 3; ++j) c.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
  }
  return c;
}

static void move(const double pose[16], const double x[3], double y[3]) {
  int i;
  for (i = 0; i < 3; ++i) y[i] = pose[4 * i] * x[0] + pose[4 * i + 1] * x[1] + pose[4 * i + 2] * x[2] + pose[4 * i + 3];
}

/* D(x) = R (x - iso) + iso + t with R = Rz(rtn) Rx(pitch) Ry(roll); the pose brings D(x) back to x. */
/* REQ-FRAME-001 */
static void test_displacement(void) {
  const sgrt_patient_displacement given = {3, -4, 12, 2, -3, 5, 0};
  const double iso[3] = {20, -30, 40};
  const turn r = times(times(about(2, given.rtn_deg), about(0, given.pitch_deg)), about(1, given.roll_deg));
  double pose[16], x[3] = {120, 7, -60}, d[3], back[3];
  sgrt_patient_displacement got;
  sgrt_couch_correction correction;
  int i;
  CHECK_OK(sgrt_frame_pose_from_displacement(&given, iso, pose));
  for (i = 0; i < 3; ++i) {
    d[i] = r.m[i][0] * (x[0] - iso[0]) + r.m[i][1] * (x[1] - iso[1]) + r.m[i][2] * (x[2] - iso[2]) + iso[i];
  }
  d[0] += given.lat_mm, d[1] += given.lng_mm, d[2] += given.vrt_mm;
  move(pose, d, back);
  for (i = 0; i < 3; ++i) CHECK_NEAR(back[i], x[i], 1e-12);
  CHECK_OK(sgrt_frame_shift_from_pose(pose, iso, &got, &correction));
  CHECK_NEAR(got.lat_mm, 3, 1e-12);
  CHECK_NEAR(got.lng_mm, -4, 1e-12);
  CHECK_NEAR(got.vrt_mm, 12, 1e-12);
  CHECK_NEAR(got.pitch_deg, 2, 1e-12);
  CHECK_NEAR(got.roll_deg, -3, 1e-12);
  CHECK_NEAR(got.rtn_deg, 5, 1e-12);
  CHECK_NEAR(got.mag_mm, 13, 1e-12);
  /* The correction is R^T and -R^T t about the isocentre: not minus the six numbers. */
  CHECK_NEAR(correction.lat_mm, -(r.m[0][0] * 3 + r.m[1][0] * -4 + r.m[2][0] * 12), 1e-12);
  CHECK_NEAR(correction.lng_mm, -(r.m[0][1] * 3 + r.m[1][1] * -4 + r.m[2][1] * 12), 1e-12);
  CHECK_NEAR(correction.vrt_mm, -(r.m[0][2] * 3 + r.m[1][2] * -4 + r.m[2][2] * 12), 1e-12);
  CHECK_NEAR(correction.mag_mm, 13, 1e-12);
  CHECK_NEAR(sin(correction.pitch_deg * kDegree), r.m[1][2], 1e-12);
  CHECK(fabs(correction.lat_mm + 3) > 0.1);
  CHECK_OK(sgrt_frame_pose_from_correction(&correction, iso, pose));
  move(pose, d, back);
  for (i = 0; i < 3; ++i) CHECK_NEAR(back[i], x[i], 1e-11);
}

/* A turn about a far isocentre: 0.5 deg at 200 mm is 1.745 mm. */
static void test_the_isocentre_matters(void) {
  const sgrt_patient_displacement given = {0, 0, 0, 0, 0, 0.5, 0};
  const double here[3] = {0, 0, 0}, there[3] = {200, 0, 0};
  double pose[16];
  sgrt_patient_displacement got;
  CHECK_OK(sgrt_frame_pose_from_displacement(&given, here, pose));
  CHECK_OK(sgrt_frame_shift_from_pose(pose, there, &got, NULL));
  CHECK_NEAR(got.lng_mm, 200 * sin(0.5 * kDegree), 1e-12);
  CHECK_NEAR(got.rtn_deg, 0.5, 1e-12);
  CHECK_OK(sgrt_frame_shift_from_pose(pose, here, NULL, NULL));
}

/* REQ-FRAME-003 */
static void test_gimbal(void) {
  const sgrt_patient_displacement given = {0, 0, 0, 90, 10, 20, 0};
  const double iso[3] = {0, 0, 0};
  double pose[16], again[16];
  sgrt_patient_displacement got;
  int i;
  CHECK_OK(sgrt_frame_pose_from_displacement(&given, iso, pose));
  CHECK_OK(sgrt_frame_shift_from_pose(pose, iso, &got, NULL));
  CHECK_NEAR(got.pitch_deg, 90, 1e-6);
  CHECK(got.roll_deg == 0);
  CHECK_OK(sgrt_frame_pose_from_displacement(&got, iso, again));
  for (i = 0; i < 16; ++i) CHECK_NEAR(again[i], pose[i], 1e-7);
}

/* Where the patient's left, the back and the head (+x, +y, +z of DICOM) point in the room, by the position's name. */
static void test_dicom(void) {
  static const struct {
    int32_t position;
    double left[3], back[3], head[3];
  } kPositions[] = {
      {SGRT_HFS, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}},   {SGRT_HFP, {-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
      {SGRT_FFS, {-1, 0, 0}, {0, 0, -1}, {0, -1, 0}}, {SGRT_FFP, {1, 0, 0}, {0, 0, 1}, {0, -1, 0}},
      {SGRT_HFDL, {0, 0, -1}, {-1, 0, 0}, {0, 1, 0}}, {SGRT_HFDR, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}},
      {SGRT_FFDL, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}}, {SGRT_FFDR, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}},
  };
  const double iso[3] = {12, -34, 56};
  size_t p;
  int i;
  for (p = 0; p < sizeof kPositions / sizeof kPositions[0]; ++p) {
    double pose[16], x[3], origin[3];
    CHECK_OK(sgrt_frame_fixed_from_dicom(kPositions[p].position, iso, pose));
    move(pose, iso, origin);
    for (i = 0; i < 3; ++i) CHECK_NEAR(origin[i], 0, 1e-12);
    for (i = 0; i < 3; ++i) {
      CHECK_NEAR(pose[4 * i], kPositions[p].left[i], 1e-15);
      CHECK_NEAR(pose[4 * i + 1], kPositions[p].back[i], 1e-15);
      CHECK_NEAR(pose[4 * i + 2], kPositions[p].head[i], 1e-15);
    }
    x[0] = iso[0] + 1, x[1] = iso[1], x[2] = iso[2];
    move(pose, x, origin);
    CHECK_NEAR(origin[0], kPositions[p].left[0], 1e-12);
  }
}

/* REQ-FRAME-005 */
static void test_couch(void) {
  const double x[3] = {100, 0, 5};
  double pose[16], y[3];
  CHECK_OK(sgrt_frame_fixed_from_couch(30, pose));
  move(pose, x, y); /* counter-clockwise from above */
  CHECK_NEAR(y[0], 100 * sqrt(3) / 2, 1e-12);
  CHECK_NEAR(y[1], 50, 1e-12);
  CHECK_NEAR(y[2], 5, 1e-15);
}

/* The gantry's source stands above the isocentre and turns to +X. */
static void test_gantry_and_couch(void) {
  const double source[3] = {0, 0, 1000}, iso[3] = {10, 20, 30}, x[3] = {110, 20, 35}, above[3] = {10, 20, 900};
  double pose[16], y[3], home[3];
  int i;
  CHECK_OK(sgrt_frame_fixed_from_gantry(90, pose));
  move(pose, source, y);
  CHECK_NEAR(y[0], 1000, 1e-12);
  CHECK_NEAR(y[2], 0, 1e-12);
  CHECK_OK(sgrt_frame_couch_turn(90, iso, pose));
  move(pose, x, y);
  CHECK_NEAR(y[0], 10, 1e-12);
  CHECK_NEAR(y[1], 120, 1e-12);
  CHECK_NEAR(y[2], 35, 1e-12);
  move(pose, above, home);
  for (i = 0; i < 3; ++i) CHECK_NEAR(home[i], above[i], 1e-12);
  CHECK_INVALID(sgrt_frame_fixed_from_gantry(NAN, pose), "gantry_deg: nan");
  CHECK_INVALID(sgrt_frame_fixed_from_gantry(0, NULL), "fixed_from_gantry: NULL");
  CHECK_INVALID(sgrt_frame_couch_turn(400, iso, pose), "couch_deg: 400, expected -360 to 360");
  CHECK_INVALID(sgrt_frame_couch_turn(0, NULL, pose), "isocentre_mm: NULL");
  CHECK_INVALID(sgrt_frame_couch_turn(0, iso, NULL), "pose: NULL");
}

/* A couch without pitch and roll brings the isocentre back and takes the turn about the vertical away. */
/* REQ-FRAME-006 */
static void test_four_dof(void) {
  const sgrt_patient_displacement given = {3, -4, 12, 2, -3, 90, 0};
  const double iso[3] = {20, -30, 40};
  double pose[16];
  sgrt_couch_correction correction;
  sgrt_patient_displacement remaining;
  CHECK_OK(sgrt_frame_pose_from_displacement(&given, iso, pose));
  CHECK_OK(sgrt_frame_four_dof(pose, iso, &correction, &remaining));
  /* Rz(-90): (x, y) -> (y, -x), so -(3, -4) becomes (4, 3). */
  CHECK_NEAR(correction.lat_mm, 4, 1e-12);
  CHECK_NEAR(correction.lng_mm, 3, 1e-12);
  CHECK_NEAR(correction.vrt_mm, -12, 1e-12);
  CHECK_NEAR(correction.rtn_deg, -90, 1e-12);
  CHECK_NEAR(correction.mag_mm, 13, 1e-12);
  CHECK(correction.pitch_deg == 0 && correction.roll_deg == 0);
  CHECK(remaining.lat_mm == 0 && remaining.lng_mm == 0 && remaining.vrt_mm == 0 && remaining.rtn_deg == 0);
  CHECK_NEAR(remaining.pitch_deg, 2, 1e-12);
  CHECK_NEAR(remaining.roll_deg, -3, 1e-12);
  CHECK_OK(sgrt_frame_four_dof(pose, iso, NULL, NULL));
  CHECK_INVALID(sgrt_frame_four_dof(NULL, iso, &correction, &remaining), "reference_from_live: NULL");
  CHECK_INVALID(sgrt_frame_four_dof(pose, NULL, &correction, &remaining), "isocentre_mm: NULL");
}

static void test_bad_arguments(void) {
  const double iso[3] = {0, 0, 0}, bad_iso[3] = {0, NAN, 0}, far_iso[3] = {0, 0, 2e5};
  const sgrt_patient_displacement d = {0, 0, 0, 0, 0, 0, NAN}; /* mag_mm is ignored */
  const sgrt_couch_correction c = {0, 0, 0, 0, 0, 0, NAN};
  double pose[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, out[16], scaled[16], mirror[16], row[16];
  sgrt_patient_displacement got, canary;
  sgrt_couch_correction correction, spoilt = c;
  int i;
  for (i = 0; i < 16; ++i) out[i] = 77;
  memset(&got, 0xAB, sizeof got);
  memset(&correction, 0xAB, sizeof correction);
  canary = got;
  CHECK_INVALID(sgrt_frame_shift_from_pose(NULL, iso, &got, &correction), "reference_from_live: NULL");
  CHECK_INVALID(sgrt_frame_shift_from_pose(pose, NULL, &got, &correction), "isocentre_mm: NULL");
  CHECK_INVALID(sgrt_frame_shift_from_pose(pose, bad_iso, &got, &correction),
                "isocentre_mm[1]: nan, expected a finite number");
  CHECK_INVALID(sgrt_frame_shift_from_pose(pose, far_iso, &got, &correction),
                "isocentre_mm[2]: 2e+05, expected -1e+05 to");
  memcpy(scaled, pose, sizeof pose), scaled[0] = 1.00001;
  CHECK_INVALID(sgrt_frame_shift_from_pose(scaled, iso, &got, &correction), "reference_from_live");
  memcpy(mirror, pose, sizeof pose), mirror[0] = -1;
  CHECK_INVALID(sgrt_frame_shift_from_pose(mirror, iso, &got, &correction), "reference_from_live");
  memcpy(row, pose, sizeof pose), row[12] = 1e-3;
  CHECK_INVALID(sgrt_frame_shift_from_pose(row, iso, &got, &correction), "reference_from_live");
  row[12] = INFINITY;
  CHECK_INVALID(sgrt_frame_shift_from_pose(row, iso, &got, &correction), "reference_from_live[12]: inf");
  CHECK(!memcmp(&got, &canary, sizeof got) && !memcmp(&correction, &canary, sizeof correction));
  CHECK_INVALID(sgrt_frame_pose_from_displacement(NULL, iso, out), "displacement: NULL");
  CHECK_INVALID(sgrt_frame_pose_from_displacement(&d, NULL, out), "isocentre_mm: NULL");
  CHECK_INVALID(sgrt_frame_pose_from_displacement(&d, iso, NULL), "reference_from_live: NULL");
  CHECK_INVALID(sgrt_frame_pose_from_correction(NULL, iso, out), "correction: NULL");
  CHECK_INVALID(sgrt_frame_pose_from_correction(&c, bad_iso, out), "isocentre_mm[1]");
  spoilt.rtn_deg = INFINITY;
  CHECK_INVALID(sgrt_frame_pose_from_correction(&spoilt, iso, out), "correction.rtn_deg: inf");
  spoilt = c, spoilt.lng_mm = NAN;
  CHECK_INVALID(sgrt_frame_pose_from_correction(&spoilt, iso, out), "correction.lng_mm: nan");
  CHECK_INVALID(sgrt_frame_fixed_from_dicom(-1, iso, out), "patient_position: -1, expected 0 to 7");
  CHECK_INVALID(sgrt_frame_fixed_from_dicom(8, iso, out), "patient_position: 8");
  CHECK_INVALID(sgrt_frame_fixed_from_dicom(SGRT_HFS, NULL, out), "isocentre_dicom_mm: NULL");
  CHECK_INVALID(sgrt_frame_fixed_from_dicom(SGRT_HFS, iso, NULL), "fixed_from_dicom: NULL");
  CHECK_INVALID(sgrt_frame_fixed_from_couch(NAN, out), "couch_deg: nan");
  CHECK_INVALID(sgrt_frame_fixed_from_couch(0, NULL), "fixed_from_couch: NULL");
  for (i = 0; i < 16; ++i) CHECK(out[i] == 77);
  CHECK_OK(sgrt_frame_pose_from_displacement(&d, iso, out));
  CHECK_OK(sgrt_frame_pose_from_correction(&c, iso, out));
  for (i = 0; i < 16; ++i) CHECK(out[i] == pose[i]);
}

int main(void) {
  test_displacement();
  test_the_isocentre_matters();
  test_gimbal();
  test_dicom();
  test_couch();
  test_gantry_and_couch();
  test_four_dof();
  test_bad_arguments();
  return check_result();
}
