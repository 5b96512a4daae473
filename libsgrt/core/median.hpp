// The median: of an even number the upper of the two in the middle. One place for what every robust scale starts from.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

namespace sgrt {

// NaN where there is no value. Reorders the values.
template <class T>
T median(std::vector<T>& values) {
  if (values.empty()) return std::numeric_limits<T>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace sgrt
