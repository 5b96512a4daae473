// Piecewise linear corrections, see tof/correct.hpp.
#include "tof/correct.hpp"

namespace sgrt {

Correction::Correction(const std::vector<double>& knots, const std::vector<double>& errors)
    : knots_(knots.begin(), knots.end()), errors_(errors.begin(), errors.end()) {
  if (knots.size() < 2) return;
  low_ = knots_.front();
  const std::size_t cells = 2 * knots.size();
  inverse_cell_ = static_cast<float>(cells) / (knots_.back() - low_);
  cells_.reserve(cells);
  std::size_t i = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    while (i + 2 < knots_.size() && knots_[i + 1] <= low_ + static_cast<float>(c) / inverse_cell_) ++i;
    cells_.push_back(i);
  }
}

float Correction::at(float x) const {
  if (!(x > knots_.front())) return x == x ? errors_.front() : x;
  if (x >= knots_.back()) return errors_.back();
  std::size_t cell = static_cast<std::size_t>((x - low_) * inverse_cell_);
  if (cell >= cells_.size()) cell = cells_.size() - 1;
  std::size_t i = cells_[cell];
  while (i > 0 && knots_[i] > x) --i;
  while (knots_[i + 1] < x) ++i;
  return errors_[i] + (errors_[i + 1] - errors_[i]) * ((x - knots_[i]) / (knots_[i + 1] - knots_[i]));
}

}  // namespace sgrt
