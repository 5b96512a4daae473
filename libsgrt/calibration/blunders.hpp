// Corners that are nowhere near where the rest of their view wants them: a start by least squares would follow them.
// docs/theory/calibration.md, "Start".
#pragma once

#include "calibration/bundle.hpp"

namespace sgrt {

// The view with weight 0 for its blunders; as it is where there is none, or where no quarter of its corners agrees.
View without_blunders(const Target& target, View view);

}  // namespace sgrt
