// The breathing trace: how far a patch of skin stands above the reference, one number a frame, without a registration.
// docs/theory/tracking.md section 4.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "core/roi.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "registration/live.hpp"
#include "registration/reference.hpp"

namespace sgrt {

struct Amplitude {
  double mm = std::numeric_limits<double>::quiet_NaN();     // along the patch's mean normal, positive outward
  double sigma = std::numeric_limits<double>::quiet_NaN();  // of it, from the scatter within the patch
  std::int64_t points = 0;
};

class Breathing {
 public:
  // patch: of the reference, which has normals. Throws kInsufficientData below 6 points.
  Breathing(const Run& run, const Surface& reference, const Roi& patch);
  // NaN where fewer than 6 live points lie over the patch.
  Amplitude measure(const Run& run, const LivePoints& live);
  const Vec3& direction() const { return direction_; }

 private:
  struct Sample {
    double r, slope;  // distance along the normal, mm; cosine between the normal and the direction
  };
  void look(const Run& run, const LivePoints& live, double a);
  template <class Of>
  double median(Of&& of);

  std::shared_ptr<const Reference> patch_;
  Vec3 direction_;
  std::vector<float> r_;  // kept between frames, like the others
  std::vector<std::int32_t> surfel_;
  std::vector<Sample> samples_;
  std::vector<double> sorted_;
};

}  // namespace sgrt
