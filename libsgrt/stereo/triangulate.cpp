#include "stereo/triangulate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/median.hpp"
#include "core/parallel.hpp"
#include "stereo/rig_error.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// With 1/z = (d - d_inf) / (f B), a plane of disparities is a plane of the room: n . X = 1 (eq. 21).
void place(const Rectification& r, const Grid& grid, std::int64_t k, const kernels::RowMatch& m, Surface& surface) {
  const double u = (grid.x(k) - r.left.cx) / r.f, v = (grid.y(k) - r.left.cy) / r.f;
  const double parallax = m.d - r.disparity_at_infinity(), z = r.f * r.baseline / parallax;
  const Vec3 ray(u, v, 1);
  const Vec3 point = r.room_from_rectified * (z * ray) + r.centre;
  Vec3 n(m.a / r.baseline, m.b / r.baseline, 0);
  n.z() = 1 / z - n.x() * u - n.y() * v;
  const Vec3 normal = r.room_from_rectified * (-n.normalized());
  const Vec3 along = r.room_from_rectified * (-z / parallax * ray);  // d point / d disparity (eq. 22)
  const double sigma = sigma_of(m), sigma2 = sigma * sigma;
  surface.points.row(k) = point.transpose();
  surface.normals.row(k) = normal.transpose();
  surface.sigma(k) = sigma * std::abs(normal.dot(along));
  surface.covariance.row(k) << sigma2 * along.x() * along.x(), sigma2 * along.x() * along.y(),
      sigma2 * along.x() * along.z(), sigma2 * along.y() * along.y(), sigma2 * along.y() * along.z(),
      sigma2 * along.z() * along.z();
}

// The rig's own uncertainty: what surfaces carry as modes, and what these leave out as the point's own.
void add_rig_error(const Rectification& r, const Grid& grid, std::int64_t k, const kernels::RowMatch& m, ErrorAt& error,
                   Surface& surface) {
  const double z = r.f * r.baseline / (m.d - r.disparity_at_infinity());
  error.move_to(r, grid.x(k), grid.y(k), m.d, z);
  for (std::size_t i = 0; i < surface.modes.size(); ++i)
    surface.modes[i].row(k) = error.mode(static_cast<int>(i)).transpose();
  const Mat3 rest = error.rest();
  const Vec3 n = surface.normal(k);
  surface.sigma(k) = std::sqrt(surface.sigma(k) * surface.sigma(k) + n.dot(rest * n));
  surface.covariance.row(k) +=
      Eigen::Matrix<double, 1, 6>(rest(0, 0), rest(0, 1), rest(0, 2), rest(1, 1), rest(1, 2), rest(2, 2));
}

void resize(const Grid& grid, const RigError& error, StereoResult& result) {
  const std::int64_t n = grid.size();
  Surface& s = *result.surface;
  result.width = grid.width, result.height = grid.height;
  s.width = grid.width, s.height = grid.height;
  s.points.resize(n, 3), s.normals.resize(n, 3), s.sigma.resize(n), s.covariance.resize(n, 6);
  s.points.setConstant(kNan), s.normals.setConstant(kNan), s.sigma.setConstant(kNan), s.covariance.setConstant(kNan);
  s.mode_names = error.names;
  s.modes.resize(error.names.size());
  for (Points& mode : s.modes) mode.resize(n, 3), mode.setConstant(kNan);
  result.reason.resize(n);
  result.correlation.assign(n, std::numeric_limits<float>::quiet_NaN());
  result.sigma_px.assign(n, std::numeric_limits<float>::quiet_NaN());
  result.left_px.assign(2 * n, kNan);
  result.right_px.assign(2 * n, kNan);
}

}  // namespace

void triangulate(const Run& run, const Rectification& r, const RigError& rig_error, const Grid& grid,
                 const StereoOptions& options, double gain, std::vector<double> (&medians)[3], MatchField& field,
                 StereoResult& result) {
  resize(grid, rig_error, result);
  Surface& surface = *result.surface;
  // Windows that overlap share pixels: so many points carry one sample of noise.
  const double share = std::pow(static_cast<double>(options.window) / grid.stride, 2) / gain;
  surface.correlation_points = std::max(1.0, share);
  parallel_for(
      run, grid.size(), 2048,
      [&](std::int64_t begin, std::int64_t end) {
        ErrorAt error(rig_error);
        for (std::int64_t k = begin; k < end; ++k) {
          const kernels::RowMatch& m = field.matches[k];
          const Vec2 left = r.source_pixel(r.left, grid.x(k), grid.y(k));
          result.left_px[2 * k] = left.x(), result.left_px[2 * k + 1] = left.y();
          if (field.reason[k] != Reason::kNone) continue;
          if (m.d - r.disparity_at_infinity() > 0) place(r, grid, k, m, surface);
          const Vec3 x = surface.point(k);
          if (!((x.array() >= options.volume_min.array()).all() && (x.array() <= options.volume_max.array()).all())) {
            field.reason[k] = Reason::kOutOfVolume;
            surface.points.row(k).setConstant(kNan), surface.normals.row(k).setConstant(kNan);
            surface.covariance.row(k).setConstant(kNan), surface.sigma(k) = kNan;
            continue;
          }
          if (rig_error.modes > 0) add_rig_error(r, grid, k, m, error, surface);
          const Vec2 right = r.source_pixel(r.right, grid.x(k) - static_cast<double>(m.d), grid.y(k));
          result.right_px[2 * k] = right.x(), result.right_px[2 * k + 1] = right.y();
          result.correlation[k] = m.correlation;
          result.sigma_px[k] = static_cast<float>(sigma_of(m));
        }
      },
      "triangulating");

  auto& [noise, sigma_px, sigma_mm] = medians;
  for (std::vector<double>& values : medians) values.clear();
  result.reason_count.fill(0);
  for (std::int64_t k = 0; k < grid.size(); ++k) {
    result.reason[k] = static_cast<std::uint8_t>(field.reason[k]);
    ++result.reason_count[result.reason[k]];
    if (field.reason[k] != Reason::kNone) continue;
    noise.push_back(std::sqrt(field.matches[k].noise / 2));
    sigma_px.push_back(sigma_of(field.matches[k]));
    sigma_mm.push_back(surface.sigma(k));
  }
  result.point_count = static_cast<std::int64_t>(noise.size());
  result.noise_left = median(noise);
  result.median_sigma_px = median(sigma_px);
  result.median_sigma_mm = median(sigma_mm);
}

}  // namespace sgrt
