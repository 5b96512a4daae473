// What is computed of surfaces: normals, fusion, distance map.
#include "capi/capi.hpp"
#include "surface/distance.hpp"
#include "surface/fuse.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

sgrt_surface_normals_options to_c(const NormalsOptions& o) {
  sgrt_surface_normals_options c{};
  c.struct_size = sizeof c;
  c.neighbours = o.neighbours;
  Eigen::Map<Vec3>(c.viewpoint_mm) = o.viewpoint;
  c.radius_mm = o.radius;
  return c;
}

NormalsOptions from_c(const sgrt_surface_normals_options& c) {
  NormalsOptions o;
  check_range(c.neighbours, 6, 200, "options.neighbours");
  o.neighbours = c.neighbours;
  o.viewpoint = place(c.viewpoint_mm, "options.viewpoint_mm");
  check_positive(c.radius_mm, kMaxCoordinate, "options.radius_mm");
  o.radius = c.radius_mm;
  return o;
}

sgrt_surface_fuse_options to_c(const FuseOptions& o) {
  sgrt_surface_fuse_options c{};
  c.struct_size = sizeof c;
  c.max_distance_mm = o.max_distance;
  c.max_angle_deg = o.max_angle_deg;
  return c;
}

FuseOptions from_c(const sgrt_surface_fuse_options& c) {
  FuseOptions o;
  check_reserved(c.reserved, "options.reserved");
  check_positive(c.max_distance_mm, kMaxCoordinate, "options.max_distance_mm");
  o.max_distance = c.max_distance_mm;
  check_positive(c.max_angle_deg, 90, "options.max_angle_deg");
  o.max_angle_deg = c.max_angle_deg;
  return o;
}

sgrt_surface_distance_options to_c(const DistanceOptions& o) {
  sgrt_surface_distance_options c{};
  c.struct_size = sizeof c;
  c.max_distance_mm = o.max_distance;
  return c;
}

DistanceOptions from_c(const sgrt_surface_distance_options& c) {
  DistanceOptions o;
  check_reserved(c.reserved, "options.reserved");
  check_positive(c.max_distance_mm, kMaxCoordinate, "options.max_distance_mm");
  o.max_distance = c.max_distance_mm;
  return o;
}

void need_normals(const Surface& s, const char* name) {
  if (!s.has_normals()) refuse(name, "a surface without normals", "normals (see sgrt_surface_estimate_normals)");
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_surface_move(sgrt_context* /*context*/, const sgrt_surface* surface, const double pose[16],
                              sgrt_surface** result) {
  return guard([&] {
    need(surface, "surface");
    need(result, "result");
    *result = handle_of(make_surface(moved(*surface->surface, rigid(pose, "pose")))).release();
  });
}

sgrt_status sgrt_surface_normals_options_init(sgrt_surface_normals_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(NormalsOptions{}), "options"); });
}

sgrt_status sgrt_surface_estimate_normals(sgrt_context* context, const sgrt_surface* surface,
                                          const sgrt_surface_normals_options* options, sgrt_surface** result) {
  return guard([&] {
    need(surface, "surface");
    need(result, "result");
    const NormalsOptions o = from_c(read_struct(options, to_c(NormalsOptions{}), "options.struct_size"));
    *result = handle_of(estimate_normals(run_of(context), *surface->surface, o)).release();
  });
}

sgrt_status sgrt_surface_fuse_options_init(sgrt_surface_fuse_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(FuseOptions{}), "options"); });
}

sgrt_status sgrt_surface_fuse(sgrt_context* context, const sgrt_surface* const* surfaces, int32_t count,
                              const sgrt_surface_fuse_options* options, sgrt_surface** result,
                              sgrt_surface_fuse_info* info) {
  return guard([&] {
    need(surfaces, "surfaces");
    need(result, "result");
    check_range(count, 1, 64, "count");
    check_result(info, "info.struct_size");
    std::vector<const Surface*> inputs;
    for (int i = 0; i < count; ++i) {
      const std::string name = "surfaces[" + std::to_string(i) + "]";
      need(surfaces[i], name.c_str());
      need_normals(*surfaces[i]->surface, name.c_str());
      inputs.push_back(surfaces[i]->surface.get());
    }
    const FuseOptions o = from_c(read_struct(options, to_c(FuseOptions{}), "options.struct_size"));
    Fusion fusion = fuse(run_of(context), inputs, o);
    sgrt_surface_fuse_info f{};
    f.surface_count = count;
    f.point_count = fusion.surface.size();
    f.overlap_count = fusion.overlap_count;
    f.disagreement_mean_mm = fusion.disagreement_mean;
    f.disagreement_rms_mm = fusion.disagreement_rms;
    f.disagreement_expected_mm = fusion.disagreement_expected;
    *result = handle_of(std::move(fusion.surface)).release();
    write_struct(info, f);
  });
}

sgrt_status sgrt_surface_distance_options_init(sgrt_surface_distance_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(DistanceOptions{}), "options"); });
}

sgrt_status sgrt_surface_distance(sgrt_context* context, const sgrt_surface* reference, const sgrt_surface* live,
                                  const double reference_from_live[16], const sgrt_surface_distance_options* options,
                                  const sgrt_mut_view* distance_mm) {
  return guard([&] {
    need(reference, "reference");
    need(live, "live");
    need_normals(*reference->surface, "reference");
    const Pose pose = reference_from_live ? rigid(reference_from_live, "reference_from_live") : Pose{};
    const DistanceOptions o = from_c(read_struct(options, to_c(DistanceOptions{}), "options.struct_size"));
    check_output_beside(distance_mm, "distance_mm", SGRT_F64, live->surface->size(), live->surface->height);
    const Eigen::VectorXd distance = signed_distance(run_of(context), *reference->surface, *live->surface, pose, o);
    write_view(*distance_mm, distance.data());
  });
}
