/* NURBS curves and surfaces through the ABI: exact shapes, tools, closest points, meshes, and what is refused. */
#include "check.h"

static const double kPi = 3.14159265358979323846;

static sgrt_nurbs_surface* sphere_of(double radius) {
  const double centre[3] = {1, 2, 3};
  sgrt_nurbs_surface* sphere = NULL;
  CHECK_OK(sgrt_nurbs_surface_sphere(centre, radius, &sphere));
  if (!sphere) exit(2);
  return sphere;
}

static void test_circle(void) {
  const double centre[3] = {10, 20, 30}, x[3] = {50, 0, 0}, y[3] = {0, 50, 0};
  double u[5] = {0, 0.125, 0.5, 0.7, 1}, points[5][2][3], length = 0, parameter = 0, distance = 0, gap = -1;
  const double far[3] = {10, 120, 30}, knots[2] = {0.1, 0.9};
  sgrt_view at = sgrt_view_of(u, SGRT_F64, 5, 0, 0), asked = sgrt_view_of(far, SGRT_F64, 1, 3, 0);
  sgrt_view inserted = sgrt_view_of(knots, SGRT_F64, 2, 0, 0);
  sgrt_mut_view out = sgrt_mut_view_of(points, SGRT_F64, 5, 2, 3);
  sgrt_mut_view p = sgrt_mut_view_of(&parameter, SGRT_F64, 1, 0, 0), d = sgrt_mut_view_of(&distance, SGRT_F64, 1, 0, 0);
  sgrt_mut_view g = sgrt_mut_view_of(&gap, SGRT_F64, 1, 0, 0);
  sgrt_nurbs_curve *circle = NULL, *fine = NULL, *high = NULL, *less = NULL, *again = NULL, *part = NULL;
  sgrt_nurbs_curve_info info;
  int32_t count = -1;
  double bound = -1;
  int i;
  CHECK_OK(sgrt_nurbs_curve_arc(centre, x, y, 0, 2 * kPi, &circle));
  CHECK_OK(sgrt_nurbs_curve_evaluate(NULL, circle, &at, 1, SGRT_OUTSIDE_REFUSE, &out));
  for (i = 0; i < 5; ++i) {
    CHECK_NEAR(hypot(points[i][0][0] - 10, points[i][0][1] - 20), 50, 1e-12);
    CHECK_NEAR(points[i][0][2], 30, 1e-12);
    CHECK_NEAR((points[i][0][0] - 10) * points[i][1][0] + (points[i][0][1] - 20) * points[i][1][1], 0, 1e-10);
  }
  CHECK_OK(sgrt_nurbs_curve_length(circle, 0, 1, &length));
  CHECK_NEAR(length, 100 * kPi, 1e-10);
  CHECK_OK(sgrt_nurbs_curve_closest(NULL, circle, &asked, &p, &d, &g));
  CHECK_NEAR(parameter, 0.25, 1e-9);
  CHECK_NEAR(distance, 50, 1e-9);
  CHECK(gap >= 0 && gap < 1e-5);
  CHECK_OK(sgrt_nurbs_curve_refine(circle, &inserted, &fine));
  CHECK_OK(sgrt_nurbs_curve_remove_knot(fine, 0.9, 1, 1e-9, &less, &count, &bound));
  CHECK(count == 1 && bound >= 0 && bound < 1e-9);
  CHECK_OK(sgrt_nurbs_curve_elevate(less, 2, &high));
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_nurbs_curve_summary(high, &info));
  CHECK(info.degree == 4 && info.rational == 1 && info.domain[0] == 0 && info.domain[1] == 1);
  CHECK_OK(sgrt_nurbs_curve_evaluate(NULL, high, &at, 1, SGRT_OUTSIDE_REFUSE, &out));
  for (i = 0; i < 5; ++i) CHECK_NEAR(hypot(points[i][0][0] - 10, points[i][0][1] - 20), 50, 1e-10);
  CHECK_OK(sgrt_nurbs_curve_restrict(circle, 0, 0.25, &part));
  CHECK_OK(sgrt_nurbs_curve_length(part, 0, 0.25, &length));
  CHECK_NEAR(length, 25 * kPi, 1e-10);
  CHECK_OK(sgrt_nurbs_curve_from_json(sgrt_nurbs_curve_text(high, SGRT_NURBS_JSON),
                                      strlen(sgrt_nurbs_curve_text(high, SGRT_NURBS_JSON)), &again));
  CHECK(strcmp(sgrt_nurbs_curve_text(high, SGRT_NURBS_JSON), sgrt_nurbs_curve_text(again, SGRT_NURBS_JSON)) == 0);
  CHECK(sgrt_nurbs_curve_text(high, 7) == NULL);
  u[3] = 1.5;
  points[0][0][0] = -77;
  CHECK_INVALID(sgrt_nurbs_curve_evaluate(NULL, circle, &at, 1, SGRT_OUTSIDE_REFUSE, &out), "u[3]: 1.5");
  CHECK(points[0][0][0] == -77);
  CHECK_OK(sgrt_nurbs_curve_evaluate(NULL, circle, &at, 1, SGRT_OUTSIDE_CLAMP, &out));
  CHECK_NEAR(points[3][0][0], 60, 1e-12);
  u[3] = NAN;
  CHECK_INVALID(sgrt_nurbs_curve_evaluate(NULL, circle, &at, 1, SGRT_OUTSIDE_CLAMP, &out), "u[3]: nan");
  sgrt_nurbs_curve_free(circle);
  sgrt_nurbs_curve_free(fine);
  sgrt_nurbs_curve_free(less);
  sgrt_nurbs_curve_free(high);
  sgrt_nurbs_curve_free(part);
  sgrt_nurbs_curve_free(again);
  sgrt_nurbs_curve_free(NULL);
}

static void test_sphere(void) {
  enum { kU = 9, kV = 7 };
  static double u[kU], v[kV], uv[kU * kV][2], grid[kU][kV][6][3], points[kU * kV][6][3], normals[kU * kV][3];
  sgrt_view at_u = sgrt_view_of(u, SGRT_F64, kU, 0, 0), at_v = sgrt_view_of(v, SGRT_F64, kV, 0, 0);
  sgrt_view at = sgrt_view_of(uv, SGRT_F64, kU * kV, 2, 0);
  sgrt_mut_view g = sgrt_mut_view_of(grid, SGRT_F64, kU * kV, 6, 3), p = g;
  sgrt_mut_view n = sgrt_mut_view_of(normals, SGRT_F64, kU * kV, 3, 0);
  sgrt_nurbs_surface *sphere = sphere_of(50), *other = NULL;
  sgrt_surface* mesh = NULL;
  sgrt_surface_info info;
  sgrt_context* context = context_of(3, NULL, NULL);
  int i, j, c;
  p.data = points;
  g.ndim = 4;
  g.shape[0] = kU;
  g.shape[1] = kV;
  g.shape[2] = 6;
  g.shape[3] = 3;
  g.strides[0] = sizeof grid[0];
  g.strides[1] = sizeof grid[0][0];
  g.strides[2] = sizeof grid[0][0][0];
  g.strides[3] = sizeof(double);
  for (i = 0; i < kU; ++i) u[i] = i / (kU - 1.0);
  for (j = 0; j < kV; ++j) v[j] = j / (kV - 1.0);
  for (i = 0; i < kU * kV; ++i) {
    uv[i][0] = u[i / kV];
    uv[i][1] = v[i % kV];
  }
  CHECK_OK(sgrt_nurbs_surface_grid(context, sphere, &at_u, &at_v, 2, SGRT_OUTSIDE_REFUSE, &g));
  CHECK_OK(sgrt_nurbs_surface_evaluate(NULL, sphere, &at, 2, SGRT_OUTSIDE_REFUSE, &p));
  CHECK(memcmp(grid, points, sizeof grid) == 0);
  CHECK_OK(sgrt_nurbs_surface_normals(NULL, sphere, &at, SGRT_OUTSIDE_REFUSE, &n));
  for (i = 0; i < kU * kV; ++i) {
    const double centre[3] = {1, 2, 3};
    for (c = 0; c < 3; ++c) CHECK_NEAR(centre[c] + 50 * normals[i][c], points[i][0][c], 1e-6); /* the poles too */
  }
  for (i = 0; i < 2; ++i) {
    CHECK_OK(sgrt_nurbs_surface_elevate(sphere, i, 1, &other));
    CHECK_OK(sgrt_nurbs_surface_grid(NULL, other, &at_u, &at_v, 2, SGRT_OUTSIDE_REFUSE, &g));
    for (j = 0; j < kU * kV; ++j) CHECK_NEAR(grid[j / kV][j % kV][0][1], points[j][0][1], 1e-11);
    sgrt_nurbs_surface_free(other);
  }
  CHECK_OK(sgrt_nurbs_surface_mesh(context, sphere, 0.05, &mesh));
  info.struct_size = sizeof info;
  CHECK_OK(sgrt_surface_summary(mesh, &info));
  CHECK(info.face_count > 1000 && info.face_count < 200000);
  CHECK_NEAR(info.bounds_max_mm[2], 53, 1e-9);
  CHECK_STATUS(sgrt_nurbs_surface_mesh(context, sphere, 1e-13, &mesh), SGRT_E_LIMIT, "50 million");
  CHECK_INVALID(sgrt_nurbs_surface_elevate(sphere, 2, 1, &other), "direction");
  sgrt_surface_free(mesh);
  sgrt_context_free(context);
  sgrt_nurbs_surface_free(sphere);
}

static void test_made(void) {
  static double points[4][5][3];
  double knots[6] = {0, 0, 0, 1, 1, 1};
  const int32_t degree[2] = {3, 3}, all[2] = {0, 0};
  const double origin[2] = {0, 0}, spacing[2] = {1, 1};
  double z[5][6] = {{0}}, where[2] = {0.5, 0.5}, point[1][3];
  sgrt_view grid = sgrt_view_of(points, SGRT_F64, 4, 5, 3), height = sgrt_view_of(z, SGRT_F64, 5, 6, 0), array;
  sgrt_view at = sgrt_view_of(where, SGRT_F64, 1, 2, 0);
  sgrt_mut_view out = sgrt_mut_view_of(point, SGRT_F64, 1, 1, 3);
  sgrt_nurbs_surface_data data;
  sgrt_nurbs_surface* surface = NULL;
  sgrt_surface* field = NULL;
  int i, j;
  for (i = 0; i < 4; ++i) {
    for (j = 0; j < 5; ++j) {
      points[i][j][0] = i;
      points[i][j][1] = j;
      points[i][j][2] = i * j;
    }
  }
  CHECK_OK(sgrt_nurbs_surface_interpolate(&grid, degree, all, SGRT_PARAMETERS_UNIFORM, &surface));
  CHECK_OK(sgrt_nurbs_surface_evaluate(NULL, surface, &at, 0, SGRT_OUTSIDE_REFUSE, &out));
  CHECK_NEAR(point[0][2], 3, 1e-12); /* a bilinear surface, exactly */
  sgrt_nurbs_surface_free(surface);
  CHECK_OK(sgrt_nurbs_surface_data_init(&data, sizeof data));
  data.control_points = grid;
  CHECK_OK(sgrt_nurbs_surface_create(&data, &surface));
  CHECK_OK(sgrt_nurbs_surface_array(surface, SGRT_NURBS_KNOTS_V, &array));
  CHECK(array.shape[0] == 9 && ((const double*)array.data)[4] == 0.5);
  CHECK_OK(sgrt_nurbs_surface_array(surface, SGRT_NURBS_WEIGHTS, &array));
  CHECK(array.data == NULL);
  sgrt_nurbs_surface_free(surface);
  data.knots_u = sgrt_view_of(knots, SGRT_F64, 6, 0, 0);
  CHECK_INVALID(sgrt_nurbs_surface_create(&data, CANARY(sgrt_nurbs_surface*)),
                "data.knots_u: 6 knots, expected 8 for degree 3 and 4 control points");
  points[2][1][0] = NAN;
  data.knots_u.data = NULL;
  CHECK_INVALID(sgrt_nurbs_surface_create(&data, CANARY(sgrt_nurbs_surface*)), "control_points[11]: nan");
  CHECK_OK(sgrt_surface_from_height_field(NULL, &height, origin, spacing, &field));
  CHECK_OK(sgrt_nurbs_surface_chapter(field, 3, 2, &surface));
  CHECK_OK(sgrt_nurbs_surface_evaluate(NULL, surface, &at, 0, SGRT_OUTSIDE_REFUSE, &out));
  CHECK_NEAR(point[0][0], 2.5, 1e-12);
  CHECK_NEAR(point[0][1], 2, 1e-12);
  CHECK_INVALID(sgrt_nurbs_surface_chapter(field, 6, 2, CANARY(sgrt_nurbs_surface*)), "6 control points");
  sgrt_nurbs_surface_free(surface);
  sgrt_surface_free(field);
}

/* REQ-ABI-006 */
static void test_nulls(void) {
  sgrt_nurbs_surface* sphere = sphere_of(1);
  const double x[3] = {0, 0, 0};
  CHECK_INVALID(sgrt_nurbs_curve_create(NULL, CANARY(sgrt_nurbs_curve*)), "data");
  CHECK_INVALID(sgrt_nurbs_curve_arc(NULL, x, x, 0, 1, CANARY(sgrt_nurbs_curve*)), "centre_mm");
  CHECK_INVALID(sgrt_nurbs_curve_arc(x, x, x, 0, 1, NULL), "curve");
  CHECK_INVALID(sgrt_nurbs_curve_evaluate(NULL, NULL, NULL, 0, 0, NULL), "curve");
  CHECK_INVALID(sgrt_nurbs_surface_evaluate(NULL, sphere, NULL, 0, 0, NULL), "uv");
  CHECK_INVALID(sgrt_nurbs_surface_summary(sphere, NULL), "info");
  CHECK_INVALID(sgrt_nurbs_surface_refine(sphere, 0, NULL, CANARY(sgrt_nurbs_surface*)), "knots");
  CHECK_STATUS(sgrt_nurbs_surface_from_json("{}", 2, CANARY(sgrt_nurbs_surface*)), SGRT_E_FORMAT, "schema");
  CHECK(sgrt_nurbs_surface_text(NULL, SGRT_NURBS_JSON) == NULL);
  sgrt_nurbs_surface_free(sphere);
}

int main(void) {
  test_circle();
  test_sphere();
  test_made();
  test_nulls();
  return check_result();
}
