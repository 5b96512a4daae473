// One frame of a sweep: the stripe of an image cut with the light plane of its mirror angle. docs/theory/laser.md eq.
// 10-14.
#pragma once

#include "core/surface.hpp"
#include "laser/stripe.hpp"
#include "rig/laser.hpp"

namespace sgrt {

struct LaserOptions {
  StripeOptions stripe;                                                        // `columns` is chosen by the light plane
  double angle_sigma = 0;                                                      // rad, one sigma of a mirror reading
  Vec3 volume_min = Vec3::Constant(-std::numeric_limits<double>::infinity());  // room, mm
  Vec3 volume_max = Vec3::Constant(std::numeric_limits<double>::infinity());
};
void check_options(const LaserOptions& options);

struct Column {
  double reading = 0, time = 0;
  LightPlane plane;
  Points points;                    // room, NaN where absent
  Covariances covariance;           // of the pixel and the angle
  std::vector<double> pixel_sigma;  // px along the line
  std::vector<double> pixel;        // x or y of the stripe, px
  std::vector<std::uint8_t> reason;
  std::int64_t stripe_count = 0, point_count = 0;
};

// True where the light plane's image runs more along the rows than along the columns: a centre a column.
bool stripe_runs_across(const Camera& camera, const LightPlane& plane);

// across: as stripe_runs_across has it for the whole sweep.
Column make_column(const Run& run, const Camera& camera, const LaserUnit& unit, const LaserOptions& options,
                   bool across, const ImageView& image, const ImageView* dark, double reading, double time);

// Where a line along `axis` through `point` meets the skin, from one frame: mm from `point` along the axis, outward
// positive as the axis points, from the stripe's points no further than `radius` from the line (eq. 17).
struct LaserSignal {
  double value, sigma;  // mm
  int count;
};
LaserSignal signal_of(const Column& column, const Vec3& point, const Vec3& axis, double radius);

}  // namespace sgrt
