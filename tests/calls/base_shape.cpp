// Base calls: NURBS, curvature, landmarks, volumes.
#include "args.hpp"
#include "world.hpp"

#define BASE(function) void base([[maybe_unused]] Args_##function& a)

namespace calls {
namespace {

// Seven control points of a wave, weights of all kinds.
sgrt_view* wave() {
  std::vector<double> p;
  for (int i = 0; i < 7; ++i) p.insert(p.end(), {10. * i, 5 * std::sin(1. * i), 2 * std::cos(2. * i)});
  return view(p.data(), SGRT_F64, {7, 3});
}

// 6 x 5 points of a gentle hill.
sgrt_view* hill() {
  std::vector<double> p;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 5; ++j) p.insert(p.end(), {10. * i, 10. * j, 8 * std::sin(0.6 * i) * std::cos(0.5 * j)});
  }
  return view(p.data(), SGRT_F64, {6, 5, 3});
}

sgrt_view* line(std::vector<double> values) {
  return view(values.data(), SGRT_F64, {static_cast<std::int64_t>(values.size())});
}
sgrt_view* uvs() {
  const double uv[] = {0, 0, 0.3, 0.7, 0.5, 0.5, 1, 1};
  return view(uv, SGRT_F64, {4, 2});
}
sgrt_view* places() {
  const double x[] = {12, 3, 4, 31, -7, 2};
  return view(x, SGRT_F64, {2, 3});
}
const std::int32_t* two(std::int32_t first, std::int32_t second) {
  const std::int32_t both[2] = {first, second};
  return static_cast<const std::int32_t*>(in(both, sizeof both));
}
template <class A>
void from_text(A& a, const std::string& json) {
  a.text = static_cast<const char*>(in(json.data(), json.size()));
  a.size = json.size();
}

sgrt_surface* bumpy() {
  auto* d = options(sgrt_surface_data_init);
  d->points = sgrt_view_of(scene().bumps.data(), SGRT_F64, kBumpSide, kBumpSide, 3);
  d->normals = sgrt_view_of(scene().bump_normals.data(), SGRT_F64, kBumpSide, kBumpSide, 3);
  sgrt_surface* s = nullptr;
  must(sgrt_surface_create(nullptr, d, &s), "bumpy skin");
  return static_cast<sgrt_surface*>(lasting("sgrt_surface", s));
}

}  // namespace

BASE(sgrt_nurbs_curve_create) {
  auto* d = options(sgrt_nurbs_curve_data_init);
  d->control_points = *wave();
  d->weights = *line({1, 2, 1, 0.5, 1, 1, 3});
  d->knots = *line({0, 0, 0, 0, 0.2, 0.5, 0.7, 1, 1, 1, 1});
  a.data = d;
}
BASE(sgrt_nurbs_curve_from_json) {
  from_text(a, sgrt_nurbs_curve_text(one<sgrt_nurbs_curve>("sgrt_nurbs_curve"), SGRT_NURBS_JSON));
}
BASE(sgrt_nurbs_curve_arc) {
  a.x_mm = numbers({10, 0, 0});
  a.y_mm = numbers({0, 10, 0});
  a.end_rad = 2;
}
BASE(sgrt_nurbs_curve_interpolate) {
  a.points_mm = wave();
  a.degree = 3;
  a.parameters = SGRT_PARAMETERS_CHORD;
}
BASE(sgrt_nurbs_curve_evaluate) {
  a.u = line({0, 0.1, 0.5, 0.99, 1});
  a.order = 2;
  a.derivatives = out_view(SGRT_F64, {5, 3, 3});
}
BASE(sgrt_nurbs_curve_closest) {
  a.points_mm = places();
  a.u = out_view(SGRT_F64, {2});
  a.distance_mm = out_view(SGRT_F64, {2});
  a.gap_mm = out_view(SGRT_F64, {2});
}
BASE(sgrt_nurbs_curve_length) {
  a.end = 0.9;
}
BASE(sgrt_nurbs_curve_refine) {
  a.knots = line({0.1, 0.3, 0.3});
}
BASE(sgrt_nurbs_curve_restrict) {
  a.begin = 0.1, a.end = 0.8;
}
BASE(sgrt_nurbs_curve_elevate) {
  a.times = 2;
}
BASE(sgrt_nurbs_curve_remove_knot) {
  a.u = 0.5, a.times = 1, a.tolerance_mm = 100;
}
BASE(sgrt_nurbs_curve_reduce_degree) {
  a.tolerance_mm = 100;
}
BASE(sgrt_nurbs_curve_reparameterise) {
  a.begin = 2, a.end = -1;
}

BASE(sgrt_nurbs_surface_create) {
  auto* d = options(sgrt_nurbs_surface_data_init);
  d->control_points = *hill();
  d->knots_u = *line({0, 0, 0, 0, 0.4, 0.6, 1, 1, 1, 1});
  d->knots_v = *line({0, 0, 0, 0, 0.5, 1, 1, 1, 1});
  const std::vector<double> weights(30, 1.5);
  d->weights = *view(weights.data(), SGRT_F64, {6, 5});
  a.data = d;
}
BASE(sgrt_nurbs_surface_from_json) {
  from_text(a, sgrt_nurbs_surface_text(one<sgrt_nurbs_surface>("sgrt_nurbs_surface"), SGRT_NURBS_JSON));
}
BASE(sgrt_nurbs_surface_chapter) {
  a.degree_u = a.degree_v = 3;
}
BASE(sgrt_nurbs_surface_interpolate) {
  a.points_mm = hill();
  a.degree = two(3, 2);
  a.count = two(0, 4);
  a.parameters = SGRT_PARAMETERS_CENTRIPETAL;
}
BASE(sgrt_nurbs_surface_revolve) {
  a.axis_point_mm = numbers({0, -30, 0});
  a.axis_direction = numbers({1, 0, 0});
  a.angle_rad = 2;
}
BASE(sgrt_nurbs_surface_sphere) {
  a.radius_mm = 10;
}
BASE(sgrt_nurbs_surface_cylinder) {
  a.axis_mm = numbers({0, 5, 20});
  a.radius_mm = 10;
}
BASE(sgrt_nurbs_surface_torus) {
  a.axis = numbers({0, 0, 1});
  a.radius_mm = 10;
  a.tube_radius_mm = 3;
}
BASE(sgrt_nurbs_surface_evaluate) {
  a.uv = uvs();
  a.order = 2;
  a.derivatives = out_view(SGRT_F64, {4, 6, 3});
}
BASE(sgrt_nurbs_surface_grid) {
  a.u = line({0, 0.5, 1});
  a.v = line({0.2, 0.9});
  a.order = 1;
  a.derivatives = out_view(SGRT_F64, {3, 2, 3, 3});
}
BASE(sgrt_nurbs_surface_normals) {
  a.uv = uvs();
  a.normals = out_view(SGRT_F64, {4, 3});
}
BASE(sgrt_nurbs_surface_closest) {
  a.points_mm = places();
  a.uv = out_view(SGRT_F64, {2, 2});
  a.distance_mm = out_view(SGRT_F64, {2});
  a.gap_mm = out_view(SGRT_F64, {2});
}
BASE(sgrt_nurbs_surface_mesh) {
  a.chord_error_mm = 0.5;
}
BASE(sgrt_nurbs_surface_refine) {
  a.knots = line({0.1, 0.3, 0.3});
}
BASE(sgrt_nurbs_surface_restrict) {
  a.begin = 0.1, a.end = 0.8;
}
BASE(sgrt_nurbs_surface_elevate) {
  a.times = 2;
}
BASE(sgrt_nurbs_surface_remove_knot) {
  a.u = 0.4, a.times = 1, a.tolerance_mm = 100;
}
BASE(sgrt_nurbs_surface_reduce_degree) {
  a.tolerance_mm = 100;
}
BASE(sgrt_nurbs_surface_reparameterise) {
  a.begin = 2, a.end = -1;
}

BASE(sgrt_nurbs_fit_create) {
  auto* o = options(sgrt_nurbs_fit_options_init);
  o->control_points[0] = o->control_points[1] = 8;
  a.options = o;
}
BASE(sgrt_nurbs_fit_state) {
  std::int64_t count = 0;
  must(sgrt_nurbs_fit_state(a.fit, nullptr, &count), "state");
  a.numbers = out_view(SGRT_F64, {count});
}
BASE(sgrt_nurbs_fit_from_state) {
  const auto* fit = one<sgrt_nurbs_fit>("sgrt_nurbs_fit");
  std::int64_t count = 0;
  must(sgrt_nurbs_fit_state(fit, nullptr, &count), "state");
  std::vector<double> state(static_cast<std::size_t>(count));
  const sgrt_mut_view to = sgrt_mut_view_of(state.data(), SGRT_F64, count, 0, 0);
  must(sgrt_nurbs_fit_state(fit, &to, nullptr), "state");
  a.numbers = line(state);
}
BASE(sgrt_nurbs_fit_evaluate) {
  auto* s = options(sgrt_nurbs_fit_samples_init);
  s->points = *out_view(SGRT_F64, {4, 3});
  s->normals = *out_view(SGRT_F64, {4, 3});
  s->sigma_mm = *out_view(SGRT_F64, {4});
  s->support = *out_view(SGRT_F64, {4});
  s->covariance = *out_view(SGRT_F64, {4, 6});
  s->normal_covariance = *out_view(SGRT_F64, {4, 6});
  s->derivatives = *out_view(SGRT_F64, {4, 5, 3});
  s->derivative_covariance = *out_view(SGRT_F64, {4, 5, 6});
  a.uv = uvs();
  a.samples = s;
}
BASE(sgrt_nurbs_fit_nearest) {
  a.points = places();
  a.uv = out_view(SGRT_F64, {2, 2});
}

BASE(sgrt_curvature_nurbs_curve) {
  a.u = line({0.1, 0.5});
  a.plane_normal = numbers({0, 0, 1});
  a.curvature = out_view(SGRT_F64, {2});
  a.torsion = out_view(SGRT_F64, {2});
}
BASE(sgrt_curvature_points) {
  a.points_mm = wave();
  a.half_window = 2;
  a.degree = 3;
  a.sigma_mm = 0.1;
  a.plane_normal = numbers({0, 0, 1});
  a.curvature = out_view(SGRT_F64, {7});
  a.torsion = out_view(SGRT_F64, {7});
  a.sigma_curvature = out_view(SGRT_F64, {7});
}
BASE(sgrt_curvature_nurbs_surface) {
  auto* s = options(sgrt_curvature_samples_init);
  for (sgrt_mut_view* v : {&s->k1, &s->k2, &s->mean, &s->gauss, &s->shape_index, &s->curvedness})
    *v = *out_view(SGRT_F64, {4});
  for (sgrt_mut_view* v : {&s->normals, &s->d1, &s->d2}) *v = *out_view(SGRT_F64, {4, 3});
  s->mean = *out_view(SGRT_F64, {8});  // every other number of eight: what is not contiguous is written another way
  s->mean.shape[0] = 4;
  s->mean.strides[0] = 16;
  s->hk = *out_view(SGRT_U8, {4});
  a.uv = uvs();
  a.samples = s;
}
BASE(sgrt_curvature_compute) {
  auto* o = options(sgrt_curvature_options_init);
  o->radius_mm = 14;
  a.options = o;
}
BASE(sgrt_curvature_features) {
  a.sigmas = 3;
  a.crest = out_view(SGRT_U8, {kLumpSide, kLumpSide});
  a.persistence = out_view(SGRT_F64, {kLumpSide, kLumpSide});
}

BASE(sgrt_landmark_model_from_json) {
  const auto* model = one<sgrt_landmark_model>("sgrt_landmark_model");
  from_text(a, sgrt_landmark_model_text(model, SGRT_LANDMARK_MODEL_JSON, 0));
}
BASE(sgrt_landmark_model_learn) {
  auto* o = options(sgrt_landmark_learn_options_init);
  o->count = 6;
  a.options = o;
  a.reference = bumpy();
  a.named = nullptr;
}
BASE(sgrt_landmarks_find) {
  a.surface = bumpy();
}

BASE(sgrt_volume_skin) {
  a.voxels = view(scene().voxels.data(), SGRT_I16, {kVoxelSide, kVoxelSide, kVoxelSide});
  a.frame_from_voxel = numbers({1, 0, 0, -11.5, 0, 1, 0, -11.5, 0, 0, 1, -11.5, 0, 0, 0, 1});
}
BASE(sgrt_contours_close) {
  const std::vector<std::int32_t> lengths(kSlices, kRing);
  a.points = view(scene().contours.data(), SGRT_F64, {kSlices * kRing, 3});
  a.lengths = view(lengths.data(), SGRT_I32, {kSlices});
}

}  // namespace calls
