/* Sized structs: every options and result struct at every size a caller may state. */
#include "check.h"

typedef sgrt_status (*init_fn)(void* options, size_t size);

/* The init of a struct, called through one type. */
#define INIT(noun)                                             \
  static sgrt_status init_##noun(void* options, size_t size) { \
    return sgrt_##noun##_init((sgrt_##noun*)options, size);    \
  }
INIT(context_options)
INIT(surface_data)
INIT(surface_normals_options)
INIT(surface_fuse_options)
INIT(surface_distance_options)
INIT(stereo_options)
INIT(icp_options)

static const struct {
  init_fn init;
  size_t size;
} kInits[] = {
    {init_context_options, sizeof(sgrt_context_options)},
    {init_surface_data, sizeof(sgrt_surface_data)},
    {init_surface_normals_options, sizeof(sgrt_surface_normals_options)},
    {init_surface_fuse_options, sizeof(sgrt_surface_fuse_options)},
    {init_surface_distance_options, sizeof(sgrt_surface_distance_options)},
    {init_stereo_options, sizeof(sgrt_stereo_options)},
    {init_icp_options, sizeof(sgrt_icp_options)},
};

static int is_filled(const unsigned char* bytes, size_t begin, size_t end, unsigned char value) {
  size_t i;
  for (i = begin; i < end; ++i) {
    if (bytes[i] != value) return 0;
  }
  return 1;
}

static void test_init(init_fn init, size_t size) {
  union {
    double align;
    unsigned char bytes[1024];
    uint32_t struct_size;
  } u;
  const size_t wrong[] = {0, 1, 4, size - 1, size + 1, size + 8, 4096, (size_t)-1};
  size_t i;
  for (i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
    memset(u.bytes, 0xAB, sizeof u.bytes);
    CHECK_INVALID(init(u.bytes, wrong[i]), "size: ");
    CHECK(is_filled(u.bytes, 0, sizeof u.bytes, 0xAB));
  }
  CHECK_INVALID(init(NULL, size), "NULL");
  memset(u.bytes, 0xAB, sizeof u.bytes);
  CHECK_OK(init(u.bytes, size));
  CHECK(u.struct_size == size);
  CHECK(is_filled(u.bytes, size, sizeof u.bytes, 0xAB));
}

static void test_defaults_are_those_of_the_header(void) {
  sgrt_context_options context;
  sgrt_surface_data data;
  sgrt_surface_normals_options normals;
  sgrt_surface_fuse_options fuse;
  sgrt_surface_distance_options distance;
  sgrt_stereo_options stereo;
  sgrt_icp_options icp;
  CHECK_OK(sgrt_context_options_init(&context, sizeof context));
  CHECK(context.threads == 1 && context.max_isa == SGRT_ISA_AUTO && !context.log && !context.progress &&
        !context.reserved);
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  CHECK(!data.points.data && !data.modes.data && data.correlation_points == 1);
  CHECK_OK(sgrt_surface_normals_options_init(&normals, sizeof normals));
  CHECK(normals.neighbours == 24 && normals.radius_mm == 50);
  CHECK(normals.viewpoint_mm[0] == 0 && normals.viewpoint_mm[1] == 0 && normals.viewpoint_mm[2] == 1e4);
  CHECK_OK(sgrt_surface_fuse_options_init(&fuse, sizeof fuse));
  CHECK(fuse.max_distance_mm == 3 && fuse.max_angle_deg == 60);
  CHECK_OK(sgrt_surface_distance_options_init(&distance, sizeof distance));
  CHECK(distance.max_distance_mm == 20);
  CHECK_OK(sgrt_stereo_options_init(&stereo, sizeof stereo));
  CHECK(stereo.window_px == 21 && stereo.stride_px == 3 && stereo.min_component == 30);
  CHECK(stereo.min_correlation == 0.8 && stereo.max_left_right_px == 0.5 && stereo.max_sigma_px == 0.1);
  CHECK(stereo.volume_min_mm[2] == -INFINITY && stereo.volume_max_mm[0] == INFINITY);
  CHECK_OK(sgrt_icp_options_init(&icp, sizeof icp));
  CHECK(icp.max_iterations == 60 && icp.max_distance_mm == 40 && icp.max_angle_deg == 45);
  CHECK(icp.min_inlier_share == 0.3 && icp.step_tolerance_mm == 1e-4);
  CHECK(icp.weak_sigma_mm == 0.5 && icp.degenerate_sigma_mm == 5);
}

/* Options that state another size are refused by the call that reads them. */
static void test_reading(void) {
  sgrt_context_options options;
  sgrt_context* context = CANARY(sgrt_context);
  const uint32_t wrong[] = {0, 4, sizeof options - 1, sizeof options + 1, UINT32_MAX};
  size_t i;
  CHECK_OK(sgrt_context_options_init(&options, sizeof options));
  for (i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
    options.struct_size = wrong[i];
    CHECK_INVALID(sgrt_context_create(&options, &context), "options.struct_size: ");
    CHECK(context == CANARY(sgrt_context));
  }
}

/* A result struct is written as far as its caller knows it, its struct_size stays. */
/* REQ-ABI-007 */
static void test_writing(void) {
  const double points[9] = {0, 0, 1, 2, 0, 1, 0, 3, 1};
  struct {
    sgrt_surface_info info;
    unsigned char behind[16];
  } s;
  sgrt_surface_data data;
  sgrt_surface* surface = NULL;
  const uint32_t wrong[] = {0, 4, sizeof s.info - 1, sizeof s.info + 1, UINT32_MAX};
  size_t i;
  CHECK_OK(sgrt_surface_data_init(&data, sizeof data));
  data.points = sgrt_view_of(points, SGRT_F64, 3, 3, 0);
  CHECK_OK(sgrt_surface_create(NULL, &data, &surface));
  for (i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
    memset(&s, 0xAB, sizeof s);
    s.info.struct_size = wrong[i];
    CHECK_INVALID(sgrt_surface_summary(surface, &s.info), "info.struct_size: ");
    CHECK(s.info.struct_size == wrong[i] && is_filled((unsigned char*)&s, 4, sizeof s, 0xAB));
  }
  memset(&s, 0xAB, sizeof s);
  s.info.struct_size = sizeof s.info;
  CHECK_OK(sgrt_surface_summary(surface, &s.info));
  CHECK(s.info.struct_size == sizeof s.info && s.info.point_count == 3 && s.info.bounds_max_mm[1] == 3);
  CHECK(is_filled(s.behind, 0, sizeof s.behind, 0xAB));
  sgrt_surface_free(surface);
}

int main(void) {
  size_t i;
  for (i = 0; i < sizeof kInits / sizeof kInits[0]; ++i) test_init(kInits[i].init, kInits[i].size);
  test_defaults_are_those_of_the_header();
  test_reading();
  test_writing();
  return check_result();
}
