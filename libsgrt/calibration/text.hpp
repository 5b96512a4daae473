// Numbers in the messages of a calibration.
#pragma once

#include <cmath>
#include <string>

#include "core/error.hpp"

namespace sgrt {

// With so many decimals, "nan" as it is.
inline std::string rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return std::isfinite(value) ? text_of(std::round(value * scale) / scale) : "nan";
}

}  // namespace sgrt
