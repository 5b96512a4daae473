// The breathing trace: how far a patch of skin stands above the reference, one number a frame, without a registration.
// docs/theory/tracking.md section 4.
#pragma once

#include <limits>
#include <vector>

#include "core/roi.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "surface/field.hpp"

namespace sgrt {

struct Amplitude {
  double mm = std::numeric_limits<double>::quiet_NaN();     // along the patch's mean normal, positive outward
  double sigma = std::numeric_limits<double>::quiet_NaN();  // of it, from the scatter within the patch
  std::int64_t points = 0;
};

class Breathing {
 public:
  // patch: of the reference, which must outlive this. Throws kInsufficientData below 6 points.
  Breathing(const Run& run, const Surface& reference, const Roi& patch);
  // NaN where fewer than 6 live points lie over the patch.
  Amplitude measure(const Run& run, const Surface& live);
  const Vec3& direction() const { return direction_; }

 private:
  struct Sample {
    double r, slope;  // distance along the normal, mm; cosine between the normal and the direction
  };
  Field field_;
  std::vector<std::uint8_t> inside_;
  Vec3 low_, high_;  // of the patch, grown by the reach of the measurement
  Vec3 direction_;
  std::vector<std::int64_t> rows_;  // kept between frames, like samples_
  std::vector<Sample> samples_;
  std::vector<double> sorted_;
};

}  // namespace sgrt
