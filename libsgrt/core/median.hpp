// The value in the middle of some.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sgrt {

// The upper one of two in the middle. Reorders `values`, which must hold some and no NaN.
template <class T>
T upper_median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace sgrt
