// Skin of a CT volume and of stacked contours.
#include <cmath>
#include <numeric>

#include "capi/capi.hpp"
#include "core/within.hpp"
#include "volume/contours.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kMaxSide = 32768;
constexpr std::int64_t kMaxBytes = std::int64_t{4} << 30;
constexpr int kSkinFlags = 15;

sgrt_volume_options to_c(const SkinOptions& o) {
  sgrt_volume_options c{};
  c.struct_size = sizeof c;
  c.rescale_slope = 1;
  c.threshold_hu = o.threshold;
  c.body_threshold_hu = o.body_threshold;
  c.closing_mm = o.closing;
  c.smoothing_mm = o.smoothing;
  c.padding_hu = o.padding;
  return c;
}

// NaN, where it stands for the default, or a number in range.
void check_or_nan(double value, double low, double high, const char* name) {
  if (!std::isnan(value)) check_range(value, low, high, name);
}

SkinOptions from_c(const sgrt_volume_options& c) {
  check_reserved(c.reserved, "options.reserved");
  check_range(c.rescale_slope, -1e6, 1e6, "options.rescale_slope");
  if (c.rescale_slope == 0) refuse("options.rescale_slope", "0", "a number other than 0");
  check_range(c.rescale_intercept, -1e6, 1e6, "options.rescale_intercept");
  check_or_nan(c.threshold_hu, -1e6, 1e6, "options.threshold_hu");
  check_range(c.body_threshold_hu, -1e6, 1e6, "options.body_threshold_hu");
  check_range(c.closing_mm, 0, 50, "options.closing_mm");
  check_or_nan(c.smoothing_mm, 0, 50, "options.smoothing_mm");
  check_or_nan(c.padding_hu, -1e6, 1e6, "options.padding_hu");
  check_finite(c.down, 3, "options.down");
  SkinOptions o;
  o.threshold = c.threshold_hu;
  o.body_threshold = c.body_threshold_hu;
  o.closing = c.closing_mm;
  o.smoothing = c.smoothing_mm;
  o.padding = c.padding_hu;
  o.down = Vec3(c.down);
  return o;
}

Voxels voxels_of(const sgrt_view* view, const double* m, const sgrt_volume_options& o) {
  check_view(view, "voxels", Kind::kVoxels, {kAny, kAny, kAny});
  std::int64_t bytes = sgrt_dtype_size(view->dtype);
  for (int i = 0; i < 3; ++i) {
    if (view->shape[i] < 2) refuse("voxels", "a side of " + std::to_string(view->shape[i]), "2 or more");
    check_limit(view->shape[i], kMaxSide, "voxels: a side");
    bytes *= view->shape[i];
  }
  check_limit(bytes, kMaxBytes, "voxels: bytes");
  need(m, "frame_from_voxel");
  check_finite(m, 16, "frame_from_voxel");
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
    refuse("frame_from_voxel", "a last row other than 0 0 0 1", "an affine matrix");
  Voxels v;
  v.data = view->data;
  v.type = view->dtype == SGRT_I16   ? Voxels::Type::kI16
           : view->dtype == SGRT_U16 ? Voxels::Type::kU16
           : view->dtype == SGRT_U8  ? Voxels::Type::kU8
                                     : Voxels::Type::kF32;
  v.nz = static_cast<int>(view->shape[0]);
  v.ny = static_cast<int>(view->shape[1]);
  v.nx = static_cast<int>(view->shape[2]);
  v.z_stride = view->strides[0];
  v.y_stride = view->strides[1];
  v.x_stride = view->strides[2];
  v.slope = o.rescale_slope;
  v.intercept = o.rescale_intercept;
  v.axes << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  v.origin = Vec3(m[3], m[7], m[11]);
  const Vec3 spacing = v.spacing();
  if (!(spacing.minCoeff() >= 0.01) || !(spacing.maxCoeff() <= 100))
    refuse("frame_from_voxel",
           "a spacing of " + text_of(spacing.minCoeff()) + " to " + text_of(spacing.maxCoeff()) + " mm",
           "0.01 to 100 mm");
  if (!(std::abs(v.axes.determinant()) > 0.1 * spacing.prod()))
    refuse("frame_from_voxel", "axes that are nearly in one plane", "three directions");
  const Vec3 far(v.nx, v.ny, v.nz);
  if (!within(v.axes.cwiseAbs() * far + v.origin.cwiseAbs(), kMaxCoordinate))
    refuse("frame_from_voxel", "a volume that leaves the frame", "coordinates up to 1e5 mm");
  return v;
}

sgrt_contours_options to_c(const ContoursOptions& o) {
  sgrt_contours_options c{};
  c.struct_size = sizeof c;
  c.pixel_mm = o.pixel;
  c.smoothing_mm = o.smoothing;
  return c;
}

ContoursOptions from_c(const sgrt_contours_options& c) {
  check_reserved(c.reserved, "options.reserved");
  check_range(c.pixel_mm, 0.1, 10, "options.pixel_mm");
  check_range(c.smoothing_mm, 0, 50, "options.smoothing_mm");
  return {c.pixel_mm, c.smoothing_mm};
}

std::vector<Points> contours_of(const sgrt_view* points, const sgrt_view* lengths) {
  const Points all = read_points(points, "points");
  if (!within(all, kMaxCoordinate)) refuse("points", "a coordinate that is NaN, Inf or beyond 1e5", "mm");
  check_view(lengths, "lengths", Kind::kIndex, {kAny});
  check_limit(lengths->shape[0], kMaxPoints, "lengths");
  std::vector<std::int32_t> n(static_cast<std::size_t>(lengths->shape[0]));
  read_view(*lengths, n.data());
  std::int64_t begin = 0;
  std::vector<Points> contours;
  for (const std::int32_t length : n) {
    if (length < 3) refuse("lengths", std::to_string(length), "3 points or more a contour");
    if (begin + length > all.rows()) break;
    contours.emplace_back(all.middleRows(begin, length));
    begin += length;
  }
  if (begin != all.rows() || contours.size() != n.size())
    refuse("lengths", "a sum of " + std::to_string(std::accumulate(n.begin(), n.end(), std::int64_t{0})),
           "the number of points, " + std::to_string(all.rows()));
  return contours;
}

sgrt_volume_info summary_of(const ClosedContours& body) {
  const Skin& skin = body.skin;
  sgrt_volume_info info{};
  info.couch_found = skin.couch_found;
  info.vertex_count = skin.mesh.size();
  info.face_count = skin.mesh.faces.rows();
  for (const std::uint8_t flags : skin.flags) {
    for (int bit = 0; bit < 4; ++bit) info.flag_count[bit] += flags >> bit & 1;
  }
  const SkinFigures figures = figures_of(skin);
  info.bias_mm = figures.bias;
  info.sigma_mm = figures.sigma;
  info.volume_mm3 = skin.volume;
  info.contrast_hu = skin.contrast;
  info.slice_spacing_mm = body.spacing;
  info.largest_gap_mm = body.largest_gap;
  info.slice_count = body.slices;
  return info;
}

sgrt_view array_of(const Skin& skin, std::int32_t field) {
  const Surface& m = skin.mesh;
  switch (field) {
    case SGRT_VOLUME_POINTS:
      return lend(m.points.data(), SGRT_F64, {m.size(), 3});
    case SGRT_VOLUME_NORMALS:
      return lend(m.normals.data(), SGRT_F64, {m.size(), 3});
    case SGRT_VOLUME_FACES:
      return lend(m.faces.data(), SGRT_I32, {m.faces.rows(), 3});
    case SGRT_VOLUME_SIGMA:
      return m.sigma.size() > 0 ? lend(m.sigma.data(), SGRT_F64, {m.size()}) : sgrt_view{};
    case SGRT_VOLUME_BIAS:
      return lend(skin.bias.data(), SGRT_F64, {m.size()});
    case SGRT_VOLUME_FLAGS:
      return lend(skin.flags.data(), SGRT_U8, {m.size()});
    default:
      refuse("field", std::to_string(field), "SGRT_VOLUME_POINTS (1) to SGRT_VOLUME_FLAGS (6)");
  }
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_volume_options_init(sgrt_volume_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(SkinOptions{}), "options"); });
}

sgrt_status sgrt_volume_skin(sgrt_context* context, const sgrt_view* voxels, const double frame_from_voxel[16],
                             const sgrt_volume_options* options, sgrt_volume** volume) {
  return guard([&] {
    need(voxels, "voxels");
    need(volume, "volume");
    const auto o = read_struct(options, to_c(SkinOptions{}), "options.struct_size");
    const SkinOptions skin = from_c(o);
    const Voxels v = voxels_of(voxels, frame_from_voxel, o);
    auto handle = std::make_unique<sgrt_volume>();
    handle->body.skin = skin_of_volume(run_of(context), v, skin);
    handle->body.slices = v.nz;
    handle->body.spacing = handle->body.largest_gap = v.spacing().z();
    *volume = handle.release();
  });
}

sgrt_status sgrt_contours_options_init(sgrt_contours_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(ContoursOptions{}), "options"); });
}

sgrt_status sgrt_contours_close(sgrt_context* context, const sgrt_view* points, const sgrt_view* lengths,
                                const sgrt_contours_options* options, sgrt_volume** volume) {
  return guard([&] {
    need(points, "points");
    need(lengths, "lengths");
    need(volume, "volume");
    const ContoursOptions o = from_c(read_struct(options, to_c(ContoursOptions{}), "options.struct_size"));
    auto handle = std::make_unique<sgrt_volume>();
    handle->body = close_contours(run_of(context), contours_of(points, lengths), o);
    *volume = handle.release();
  });
}

void sgrt_volume_free(sgrt_volume* volume) {
  guard([&] { delete volume; });
}

sgrt_status sgrt_volume_summary(const sgrt_volume* volume, sgrt_volume_info* info) {
  return guard([&] {
    need(volume, "volume");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, summary_of(volume->body));
  });
}

sgrt_status sgrt_volume_array(const sgrt_volume* volume, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(volume, "volume");
    need(view, "view");
    *view = array_of(volume->body.skin, field);
  });
}

sgrt_status sgrt_volume_surface(const sgrt_volume* volume, int32_t without, sgrt_surface** surface) {
  return guard([&] {
    need(volume, "volume");
    need(surface, "surface");
    if (without < 0 || without > kSkinFlags)
      refuse("without", std::to_string(without), "a sum of SGRT_SKIN_..., 0 to 15");
    *surface = handle_of(part_without(volume->body.skin, static_cast<std::uint8_t>(without))).release();
  });
}
