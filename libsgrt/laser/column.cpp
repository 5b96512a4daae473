#include "laser/column.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "core/within.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Below the sine of 0.3 degrees between ray and plane an error of a ray is 200 times as large on the plane.
constexpr double kLeastCut = 5e-3;
constexpr std::uint8_t kOutOfVolume = 2, kNoMatch = static_cast<std::uint8_t>(LineReason::kNoMatch);

// eq. 12-13.
void place(const Camera& camera, const LightPlane& slope, const LaserOptions& o, const Vec2& pixel, double sigma,
           int along, std::int64_t i, Column& c) {
  Mat32 by_pixel;
  const Vec3 ray = unproject(camera, pixel, &by_pixel), from = camera.centre_in_room();
  const double cut = c.plane.n.dot(ray), t = (c.plane.d - c.plane.n.dot(from)) / cut;
  if (!(std::abs(cut) > kLeastCut && t > 0)) {  // NaN: the pixel has no ray
    c.reason[static_cast<std::size_t>(i)] = kNoMatch;
    return;
  }
  const Vec3 x = from + t * ray;
  if (!((x.array() >= o.volume_min.array()).all() && (x.array() <= o.volume_max.array()).all() &&
        within(x, kMaxCoordinate))) {
    c.reason[static_cast<std::size_t>(i)] = kOutOfVolume;
    return;
  }
  const Vec3 moved = by_pixel.col(along);
  const Vec3 by_centre = t * (moved - ray * (c.plane.n.dot(moved) / cut));
  const Vec3 by_angle = ray * ((slope.d - slope.n.dot(x)) / cut);
  const Mat3 C = sigma * sigma * by_centre * by_centre.transpose() +
                 o.angle_sigma * o.angle_sigma * by_angle * by_angle.transpose();
  c.points.row(i) = x.transpose();
  c.covariance.row(i) = packed(C);
}

}  // namespace

void check_options(const LaserOptions& o) {
  check_options(o.stripe);
  if (!(o.angle_sigma >= 0 && o.angle_sigma <= 1))
    fail(Status::kInvalidArgument, "angle_sigma_rad: " + text_of(o.angle_sigma) + ", expected 0 to 1");
  for (int i = 0; i < 3; ++i) {
    if (o.volume_min[i] < o.volume_max[i]) continue;
    fail(Status::kInvalidArgument, "volume_min_mm: " + text_of(o.volume_min[i]) + ", expected less than volume_max_mm");
  }
}

bool stripe_runs_across(const Camera& camera, const LightPlane& plane) {
  const Vec3 n = camera.camera_from_room.R * plane.n;
  return std::abs(n.y()) > std::abs(n.x());
}

Column make_column(const Run& run, const Camera& camera, const LaserUnit& unit, const LaserOptions& options,
                   bool across, const ImageView& image, const ImageView* dark, double reading, double time) {
  if (image.width != camera.width || image.height != camera.height)
    fail(Status::kInvalidArgument, "image: " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                                       " px, expected " + std::to_string(camera.width) + " x " +
                                       std::to_string(camera.height) + " of camera " + camera.id);
  StripeOptions stripe_options = options.stripe;
  stripe_options.columns = across;
  Stripe s = extract_stripe(run, image, dark, stripe_options);
  Column c;
  c.reading = reading;
  c.time = time;
  c.plane = light_plane(unit, reading);
  const LightPlane slope = light_plane_slope(unit, reading);
  const auto n = static_cast<std::int64_t>(s.centre.size());
  c.points = Points::Constant(n, 3, kNaN);
  c.covariance = Covariances::Constant(n, 6, kNaN);
  c.stripe_count = s.found;
  c.reason = std::move(s.reason);
  c.pixel = std::move(s.centre);
  c.pixel_sigma.assign(s.sigma.begin(), s.sigma.end());
  parallel_for(
      run, n, 512,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto k = static_cast<std::size_t>(i);
          if (c.reason[k] != 0) continue;
          const auto line = static_cast<double>(i);
          const Vec2 pixel = across ? Vec2(line, c.pixel[k]) : Vec2(c.pixel[k], line);
          place(camera, slope, options, pixel, c.pixel_sigma[k], across ? 1 : 0, i, c);
        }
      },
      "triangulating");
  c.point_count = std::count(c.reason.begin(), c.reason.end(), std::uint8_t{0});
  return c;
}

LaserSignal signal_of(const Column& column, const Vec3& point, const Vec3& axis, double radius) {
  constexpr int kLeast = 3;
  const Vec3 across = column.plane.n.cross(axis).normalized();  // along the stripe, across the axis
  if (!across.allFinite())
    fail(Status::kDegenerate, "axis: at right angles to the light plane, expected one that lies nearly in it");
  Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
  Vec2 g = Vec2::Zero();
  double low = 0, high = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < column.points.rows(); ++i) {
    if (column.reason[static_cast<std::size_t>(i)] != 0) continue;
    const Vec3 d = column.points.row(i).transpose() - point;
    const double s = d.dot(axis);
    if (!((d - s * axis).norm() <= radius)) continue;
    const Mat3 C = unpacked(column.covariance.row(i));
    const Vec2 basis(1, d.dot(across));
    const double weight = 1 / std::max(axis.dot(C * axis), 1e-8);
    N += weight * basis * basis.transpose();
    g += weight * s * basis;
    low = std::min(low, basis.y());
    high = std::max(high, basis.y());
    ++count;
  }
  if (count < kLeast || !(low < 0 && high > 0))
    fail(Status::kNotFound, "the stripe does not pass within radius_mm of the line through point_mm along axis: " +
                                std::to_string(count) + " of its points do, expected at least 3, on both sides");
  const Eigen::Matrix2d inverse = N.inverse();
  return {(inverse * g)(0), std::sqrt(inverse(0, 0)), count};
}

}  // namespace sgrt
