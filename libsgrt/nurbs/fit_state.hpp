// A fit as numbers and back: what it needs to travel between processes. The surface is not among them, it follows from
// the coefficients, bit for bit.
#pragma once

#include <cstdint>
#include <vector>

#include "nurbs/fit.hpp"

namespace sgrt {

std::vector<double> state_of(const NurbsFit& fit);

// Throws kInvalidArgument where the numbers are not such a state: too few or too many, sizes that do not fit each
// other, not finite.
NurbsFit fit_from_state(const double* numbers, std::int64_t count);

}  // namespace sgrt
