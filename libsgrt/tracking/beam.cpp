// The beam-hold signal. docs/theory/tracking.md section 3.
#include "tracking/beam.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"

namespace sgrt {

Tolerance tolerance_of(Profile profile) {
  switch (profile) {
    case Profile::kConventional:
      return {2, 1};
    case Profile::kSbrt:
    case Profile::kSrs:
      return {1, 0.5};
  }
  fail(Status::kInvalidArgument, "profile: " + std::to_string(static_cast<int>(profile)) + ", expected 0 to 2");
}

void Beam::hold(int why) {
  on_ = inside_ = false;
  why_ = why;
}

bool Beam::take(const Measured& m) {
  // Each as a share of what is allowed; the comparisons are written so that NaN holds.
  const Window& w = options_.window;
  const double mm = m.mm / options_.tolerance.mm, deg = m.deg / options_.tolerance.deg;
  const double breath = options_.gated ? std::abs(m.breathing - 0.5 * (w.low + w.high)) / (0.5 * (w.high - w.low)) : 0;
  int out = breath <= 1 ? 0 : kHoldBreathing;
  if (!m.pose) {
    out |= kHoldNoPose;
  } else {
    out |= (m.weak ? kHoldWeak : 0) | (mm <= 1 ? 0 : kHoldTranslation) | (deg <= 1 ? 0 : kHoldRotation);
  }
  const double limit = fresh_ ? 1 : options_.hysteresis;
  if (m.pose && !m.weak) fresh_ = false;
  if (out != 0) {
    hold(out);
    return false;
  }
  if (on_) return true;
  const bool back = mm <= limit && deg <= limit && breath <= limit;
  if (back && !inside_) since_ = m.time;
  inside_ = back;
  on_ = back && m.time - since_ >= options_.resume;
  why_ = on_ ? 0 : kHoldReturning;
  return on_;
}

}  // namespace sgrt
