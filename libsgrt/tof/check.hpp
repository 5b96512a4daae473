// What a time-of-flight sensor refuses: options out of range, taps of another shape. Throws kInvalidArgument, kLimit.
#pragma once

#include "tof/tof.hpp"

namespace sgrt {

void check_options(const TofOptions& options);
void check_taps(const TapsView& taps, const TofUnit& unit, const Camera& camera);

}  // namespace sgrt
