// NURBS JSON: any text is refused in one line or read; what was read comes back bit for bit and can be evaluated
// anywhere.
#include <string>

#include "fuzz.hpp"

namespace {

void use(const sgrt_nurbs_curve* curve) {
  sgrt_nurbs_curve_info info;
  info.struct_size = sizeof info;
  fuzz::require(fuzz::ok(sgrt_nurbs_curve_summary(curve, &info)), "a summary");
  const double u[] = {info.domain[0], info.domain[1], info.domain[0] + 0.37 * (info.domain[1] - info.domain[0])};
  const sgrt_view at = sgrt_view_of(u, SGRT_F64, 3, 0, 0);
  double c[27], curvature[3], length;
  const sgrt_mut_view out = sgrt_mut_view_of(c, SGRT_F64, 3, 3, 3), k = sgrt_mut_view_of(curvature, SGRT_F64, 3, 0, 0);
  fuzz::require(fuzz::ok(sgrt_nurbs_curve_evaluate(nullptr, curve, &at, 2, SGRT_OUTSIDE_CLAMP, &out)),
                "evaluates in its domain");
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) fuzz::require(std::isfinite(c[9 * i + j]), "a point is finite");
  }
  fuzz::checked(sgrt_curvature_nurbs_curve(curve, &at, SGRT_OUTSIDE_CLAMP, nullptr, &k, nullptr));
  if (info.count > 64) return;
  fuzz::checked(sgrt_nurbs_curve_length(curve, info.domain[0], info.domain[1], &length));
  for (const double tolerance : {1e-6, 1.0}) {
    sgrt_nurbs_curve *a = nullptr, *b = nullptr;
    fuzz::checked(sgrt_nurbs_curve_bezier(curve, &a));
    fuzz::checked(sgrt_nurbs_curve_reduce_degree(curve, tolerance, &b, nullptr, nullptr));
    sgrt_nurbs_curve_free(a);
    sgrt_nurbs_curve_free(b);
  }
}

std::int32_t stop_at_20(void* polls, double, const char*) {
  return ++*static_cast<int*>(polls) == 20 ? 1 : 0;
}

// Uneven weights may ask for millions of points: it is stopped, as a user would.
void mesh(const sgrt_nurbs_surface* surface) {
  int polls = 0;
  auto options = fuzz::defaults(sgrt_context_options_init);
  options.progress = stop_at_20;
  options.progress_user = &polls;
  sgrt_context* context = nullptr;
  fuzz::require(fuzz::ok(sgrt_context_create(&options, &context)), "a context");
  sgrt_surface* mesh = nullptr;
  const sgrt_status status = fuzz::checked(sgrt_nurbs_surface_mesh(context, surface, 1e5, &mesh));
  fuzz::require((status == SGRT_OK) == (mesh != nullptr), "a handle if and only if SGRT_OK");
  fuzz::require((status == SGRT_E_CANCELLED) == (polls == 20), "cancelled when told to, and asked no more");
  sgrt_surface_free(mesh);
  sgrt_context_free(context);
}

void use(const sgrt_nurbs_surface* surface) {
  sgrt_nurbs_surface_info info;
  info.struct_size = sizeof info;
  fuzz::require(fuzz::ok(sgrt_nurbs_surface_summary(surface, &info)), "a summary");
  const double *a = info.domain_u, *b = info.domain_v;
  const double uv[] = {a[0], b[0], a[1], b[1], a[0] + 0.37 * (a[1] - a[0]), b[0] + 0.61 * (b[1] - b[0])};
  const sgrt_view at = sgrt_view_of(uv, SGRT_F64, 3, 2, 0);
  double s[54], n[9];
  const sgrt_mut_view out = sgrt_mut_view_of(s, SGRT_F64, 3, 6, 3), normals = sgrt_mut_view_of(n, SGRT_F64, 3, 3, 0);
  fuzz::require(fuzz::ok(sgrt_nurbs_surface_evaluate(nullptr, surface, &at, 2, SGRT_OUTSIDE_CLAMP, &out)),
                "evaluates in its domain");
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) fuzz::require(std::isfinite(s[18 * i + j]), "a point is finite");
  }
  fuzz::checked(sgrt_nurbs_surface_normals(nullptr, surface, &at, SGRT_OUTSIDE_CLAMP, &normals));
  auto samples = fuzz::defaults(sgrt_curvature_samples_init);
  double k1[3];
  samples.k1 = sgrt_mut_view_of(k1, SGRT_F64, 3, 0, 0);
  fuzz::checked(sgrt_curvature_nurbs_surface(nullptr, surface, &at, SGRT_OUTSIDE_CLAMP, &samples));
  if (info.count[0] * std::int64_t{info.count[1]} > 64) return;
  sgrt_nurbs_surface* other = nullptr;
  fuzz::checked(sgrt_nurbs_surface_bezier(surface, 0, &other));
  sgrt_nurbs_surface_free(other);
  mesh(surface);
}

template <class Handle>
void round_trip(const std::uint8_t* data, std::size_t size, sgrt_status (*read)(const char*, std::size_t, Handle**),
                const char* (*write)(const Handle*, std::int32_t), void (*release)(Handle*)) {
  Handle* handle = nullptr;
  const sgrt_status status = fuzz::checked(read(reinterpret_cast<const char*>(data), size, &handle));
  fuzz::require((status == SGRT_OK) == (handle != nullptr), "a handle if and only if SGRT_OK");
  if (handle == nullptr)
    return fuzz::require(status == SGRT_E_FORMAT || status == SGRT_E_LIMIT, "refused as format or limit");
  const std::string text = write(handle, SGRT_NURBS_JSON);
  Handle* again = nullptr;
  fuzz::require(fuzz::ok(read(text.data(), text.size(), &again)), "what was written can be read");
  fuzz::require(text == write(again, SGRT_NURBS_JSON), "reading and writing changes nothing");
  release(again);
  use(handle);
  release(handle);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  round_trip(data, size, sgrt_nurbs_curve_from_json, sgrt_nurbs_curve_text, sgrt_nurbs_curve_free);
  round_trip(data, size, sgrt_nurbs_surface_from_json, sgrt_nurbs_surface_text, sgrt_nurbs_surface_free);
  return 0;
}
