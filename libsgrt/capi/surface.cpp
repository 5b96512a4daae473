// Surfaces: made from the caller's arrays, and their arrays lent.
#include <limits>

#include "capi/capi.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kMaxBytes = std::int64_t{4} << 30;  // of one call's arrays as float64

sgrt_surface_data data_defaults() {
  sgrt_surface_data d{};
  d.struct_size = sizeof d;
  d.correlation_points = Surface{}.correlation_points;
  return d;
}

// An array with `tail` numbers a point (0: one number, without a side of its own).
void check_beside(const sgrt_view& v, const char* name, const sgrt_view& points, std::int64_t tail) {
  if (points.ndim == 2) {
    if (tail == 0) return check_view(&v, name, Kind::kReal, {points.shape[0]});
    return check_view(&v, name, Kind::kReal, {points.shape[0], tail});
  }
  if (tail == 0) return check_view(&v, name, Kind::kReal, {points.shape[0], points.shape[1]});
  check_view(&v, name, Kind::kReal, {points.shape[0], points.shape[1], tail});
}

// Every view of the data, before a byte is copied. Returns the number of points.
std::int64_t check_data(const sgrt_surface_data& d) {
  check_reserved(d.reserved, "data.reserved");
  const bool grid = !absent(&d.points) && d.points.ndim == 3;
  if (grid) {
    check_view(&d.points, "data.points", Kind::kReal, {kAny, kAny, 3});
  } else {
    check_view(&d.points, "data.points", Kind::kReal, {kAny, 3});
  }
  const std::int64_t n = d.points.shape[0] * (grid ? d.points.shape[1] : 1);
  if (n == 0) fail(Status::kInsufficientData, "data.points: no point");
  check_limit(n, kMaxPoints, "data.points");
  if (!absent(&d.normals)) check_beside(d.normals, "data.normals", d.points, 3);
  if (!absent(&d.sigma_mm)) check_beside(d.sigma_mm, "data.sigma_mm", d.points, 0);
  if (!absent(&d.covariance)) check_beside(d.covariance, "data.covariance", d.points, 6);
  std::int64_t faces = 0, modes = 0;
  if (!absent(&d.faces)) {
    check_view(&d.faces, "data.faces", Kind::kIndex, {kAny, 3});
    check_limit(faces = d.faces.shape[0], 2 * kMaxPoints, "data.faces");
  }
  if (!absent(&d.modes)) {
    if (grid) {
      check_view(&d.modes, "data.modes", Kind::kReal, {kAny, d.points.shape[0], d.points.shape[1], 3});
    } else {
      check_view(&d.modes, "data.modes", Kind::kReal, {kAny, d.points.shape[0], 3});
    }
    modes = d.modes.shape[0];
    if (modes > kMaxModes)
      refuse("data.modes", std::to_string(modes) + " modes", "at most " + std::to_string(kMaxModes));
  }
  const std::int64_t numbers =
      3 + 3 * !absent(&d.normals) + !absent(&d.sigma_mm) + 6 * !absent(&d.covariance) + 3 * modes;
  check_limit(n * numbers * 8 + faces * 12, kMaxBytes, "data: bytes of its arrays");
  return n;
}

Surface from_c(const sgrt_surface_data& d) {
  const std::int64_t n = check_data(d);
  Surface s;
  if (d.points.ndim == 3) {
    s.height = d.points.shape[0];
    s.width = d.points.shape[1];
  }
  const auto read = [n](const sgrt_view& view, auto& matrix, std::int64_t columns) {
    if (absent(&view)) return;
    matrix.resize(n, columns);
    read_view(view, matrix.data());
  };
  read(d.points, s.points, 3);
  read(d.normals, s.normals, 3);
  read(d.sigma_mm, s.sigma, 1);
  read(d.covariance, s.covariance, 6);
  if (!absent(&d.faces)) {
    s.faces.resize(d.faces.shape[0], 3);
    read_view(d.faces, s.faces.data());
  }
  for (std::int64_t k = 0; !absent(&d.modes) && k < d.modes.shape[0]; ++k) {
    sgrt_view mode = d.modes;  // the k-th without its first dimension
    mode.data = static_cast<const char*>(d.modes.data) + k * d.modes.strides[0];
    mode.ndim = d.modes.ndim - 1;
    for (int i = 0; i < mode.ndim; ++i) {
      mode.shape[i] = d.modes.shape[i + 1];
      mode.strides[i] = d.modes.strides[i + 1];
    }
    read(mode, s.modes.emplace_back(), 3);
  }
  for (std::size_t k = 0; d.mode_names != nullptr && k < s.modes.size(); ++k) {
    const std::string name = "data.mode_names[" + std::to_string(k) + "]";
    need(d.mode_names[k], name.c_str());
    s.mode_names.emplace_back(d.mode_names[k]);
  }
  s.correlation_points = d.correlation_points;
  return s;
}

sgrt_surface_info summary_of(const Surface& s) {
  sgrt_surface_info info{};
  info.mode_count = static_cast<std::int32_t>(s.modes.size());
  info.height = s.height;
  info.width = s.width;
  info.face_count = s.faces.rows();
  info.correlation_points = s.correlation_points;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::quiet_NaN()), high = low;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    if (!s.present(i)) continue;
    low = info.point_count == 0 ? s.point(i) : low.cwiseMin(s.point(i));
    high = info.point_count == 0 ? s.point(i) : high.cwiseMax(s.point(i));
    ++info.point_count;
  }
  Eigen::Map<Vec3>(info.bounds_min_mm) = low;
  Eigen::Map<Vec3>(info.bounds_max_mm) = high;
  return info;
}

// An array of the surface with `columns` numbers a point (0: one number, without a side of its own).
sgrt_view lend_beside(const Surface& s, const double* data, std::int64_t rows, std::int64_t columns) {
  if (rows == 0) return {};
  if (!s.organised()) return columns > 0 ? lend(data, SGRT_F64, {rows, columns}) : lend(data, SGRT_F64, {rows});
  return columns > 0 ? lend(data, SGRT_F64, {s.height, s.width, columns}) : lend(data, SGRT_F64, {s.height, s.width});
}

sgrt_view lend_modes(const sgrt_surface& handle) {
  const Surface& s = *handle.surface;
  if (s.modes.empty()) return {};
  const double* modes = handle.modes
                            .get([&] {
                              std::vector<double> packed;
                              packed.reserve(s.modes.size() * static_cast<std::size_t>(s.size()) * 3);
                              for (const Points& mode : s.modes)
                                packed.insert(packed.end(), mode.data(), mode.data() + mode.size());
                              return packed;
                            })
                            .data();
  const auto k = static_cast<std::int64_t>(s.modes.size());
  return s.organised() ? lend(modes, SGRT_F64, {k, s.height, s.width, 3}) : lend(modes, SGRT_F64, {k, s.size(), 3});
}

sgrt_view array_of(const sgrt_surface& handle, std::int32_t field) {
  const Surface& s = *handle.surface;
  switch (field) {
    case SGRT_SURFACE_POINTS:
      return lend_beside(s, s.points.data(), s.points.rows(), 3);
    case SGRT_SURFACE_NORMALS:
      return lend_beside(s, s.normals.data(), s.normals.rows(), 3);
    case SGRT_SURFACE_SIGMA:
      return lend_beside(s, s.sigma.data(), s.sigma.rows(), 0);
    case SGRT_SURFACE_COVARIANCE:
      return lend_beside(s, s.covariance.data(), s.covariance.rows(), 6);
    case SGRT_SURFACE_FACES:
      return s.faces.rows() > 0 ? lend(s.faces.data(), SGRT_I32, {s.faces.rows(), 3}) : sgrt_view{};
    case SGRT_SURFACE_MODES:
      return lend_modes(handle);
    default:
      refuse("field", std::to_string(field), "SGRT_SURFACE_POINTS (1) to SGRT_SURFACE_MODES (6)");
  }
}

}  // namespace

std::unique_ptr<sgrt_surface> handle_of(Surface&& surface) {
  return handle_of(std::make_shared<const Surface>(std::move(surface)));
}

std::unique_ptr<sgrt_surface> handle_of(std::shared_ptr<const Surface> surface) {
  auto handle = std::make_unique<sgrt_surface>();
  handle->surface = std::move(surface);
  return handle;
}

}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_surface_data_init(sgrt_surface_data* data, size_t size) {
  return guard([&] { init_struct(data, size, data_defaults(), "data"); });
}

sgrt_status sgrt_surface_create(sgrt_context* /*context*/, const sgrt_surface_data* data, sgrt_surface** surface) {
  return guard([&] {
    need(data, "data");
    need(surface, "surface");
    const sgrt_surface_data d = read_struct(data, data_defaults(), "data.struct_size");
    *surface = handle_of(make_surface(from_c(d))).release();
  });
}

sgrt_status sgrt_surface_from_height_field(sgrt_context* /*context*/, const sgrt_view* z_mm, const double origin_mm[2],
                                           const double spacing_mm[2], sgrt_surface** surface) {
  return guard([&] {
    need(surface, "surface");
    check_view(z_mm, "z_mm", Kind::kReal, {kAny, kAny});
    need(origin_mm, "origin_mm");
    check_place(origin_mm, 2, "origin_mm");
    need(spacing_mm, "spacing_mm");
    check_place(spacing_mm, 2, "spacing_mm");
    if (spacing_mm[0] == 0 || spacing_mm[1] == 0) refuse("spacing_mm", "0", "two numbers other than 0");
    const std::int64_t height = z_mm->shape[0], width = z_mm->shape[1];
    if (height * width == 0) fail(Status::kInsufficientData, "z_mm: no point");
    check_limit(height * width, kMaxPoints, "z_mm");
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> z(height, width);
    read_view(*z_mm, z.data());
    const Vec2 origin(origin_mm[0], origin_mm[1]), spacing(spacing_mm[0], spacing_mm[1]);
    *surface = handle_of(surface_from_height_field(z, origin, spacing)).release();
  });
}

void sgrt_surface_free(sgrt_surface* surface) {
  guard([&] { delete surface; });
}

sgrt_status sgrt_surface_summary(const sgrt_surface* surface, sgrt_surface_info* info) {
  return guard([&] {
    need(surface, "surface");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, summary_of(*surface->surface));
  });
}

sgrt_status sgrt_surface_array(const sgrt_surface* surface, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(surface, "surface");
    need(view, "view");
    *view = array_of(*surface, field);
  });
}

const char* sgrt_surface_text(const sgrt_surface* surface, int32_t field, int32_t index) {
  return guard_text([&]() -> const char* {
    if (!surface || field != SGRT_SURFACE_MODE_NAME || index < 0) return nullptr;
    const Surface& s = *surface->surface;
    const auto k = static_cast<std::size_t>(index);
    if (k >= s.modes.size()) return nullptr;
    return k < s.mode_names.size() ? s.mode_names[k].c_str() : "";
  });
}
