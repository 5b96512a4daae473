// The height field z(x, y) of the chapter (eq. 10.1) as an organised surface. See core/surface.hpp.
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/surface.hpp"

namespace sgrt {
namespace {

using Heights = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kInvalidArgument, message);
}

void check(const Eigen::Ref<const Heights>& z, const Vec2& origin, const Vec2& spacing) {
  if (z.size() == 0) fail(Status::kInsufficientData, "z_mm: no point");
  if (z.rows() > kMaxPoints / z.cols()) {
    fail(Status::kLimit, "z_mm: expected at most " + std::to_string(kMaxPoints) + " points");
  }
  if (!origin.allFinite()) refuse("origin_mm: expected 2 finite numbers");
  for (int k = 0; k < 2; ++k) {
    if (std::isfinite(spacing(k)) && spacing(k) != 0) continue;
    refuse("spacing_mm[" + std::to_string(k) + "]: expected finite and not 0, got " + text_of(spacing(k)));
  }
  for (Eigen::Index i = 0; i < z.rows(); ++i) {
    for (Eigen::Index j = 0; j < z.cols(); ++j) {
      if (std::isnan(z(i, j)) || std::abs(z(i, j)) <= kMaxCoordinate) continue;
      refuse("z_mm[" + std::to_string(i) + ", " + std::to_string(j) +
             "]: expected |z| <= 1e5 mm, or NaN where absent, got " + text_of(z(i, j)));
    }
  }
}

// dz over one step at the middle one of three heights: central where both neighbours are there, else one-sided, else
// NaN.
double slope(double before, double here, double after) {
  if (std::isnan(before)) return after - here;
  return std::isnan(after) ? here - before : (after - before) / 2;
}

}  // namespace

Surface surface_from_height_field(const Eigen::Ref<const Heights>& z, const Vec2& origin, const Vec2& spacing) {
  check(z, origin, spacing);
  Surface s;
  s.height = z.rows();
  s.width = z.cols();
  s.points.setConstant(z.size(), 3, kNaN);
  s.normals.setConstant(z.size(), 3, kNaN);
  for (Eigen::Index i = 0; i < z.rows(); ++i) {
    for (Eigen::Index j = 0; j < z.cols(); ++j) {
      if (std::isnan(z(i, j))) continue;
      const Eigen::Index k = i * z.cols() + j;
      s.points.row(k) << origin.x() + static_cast<double>(j) * spacing.x(),
          origin.y() + static_cast<double>(i) * spacing.y(), z(i, j);
      const double zx = slope(j > 0 ? z(i, j - 1) : kNaN, z(i, j), j + 1 < z.cols() ? z(i, j + 1) : kNaN) / spacing.x();
      const double zy = slope(i > 0 ? z(i - 1, j) : kNaN, z(i, j), i + 1 < z.rows() ? z(i + 1, j) : kNaN) / spacing.y();
      if (std::isfinite(zx) && std::isfinite(zy)) s.normals.row(k) = Vec3(-zx, -zy, 1).normalized();
    }
  }
  return make_surface(std::move(s));
}

}  // namespace sgrt
