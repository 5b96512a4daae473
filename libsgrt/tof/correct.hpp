// Stored errors of a time-of-flight camera: a line between knots, held beyond the first and the last (eq. 10 of
// docs/theory/tof.md).
#pragma once

#include <cstddef>
#include <vector>

namespace sgrt {

class Correction {
 public:
  Correction() = default;
  Correction(const std::vector<double>& knots, const std::vector<double>& errors);
  bool empty() const { return knots_.empty(); }
  float at(float x) const;
  bool covers(float x) const { return x >= knots_.front() && x <= knots_.back(); }

 private:
  std::vector<float> knots_, errors_;
  std::vector<std::size_t> cells_;  // the interval at the start of each of as many equal cells
  float low_ = 0, inverse_cell_ = 0;
};

}  // namespace sgrt
