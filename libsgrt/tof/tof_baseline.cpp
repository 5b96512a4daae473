// The kernels of time of flight for the baseline instruction set.
#include "tof/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "tof/tof_kernel.inl"
}  // namespace
void phasor_row_baseline(const PhasorRow* row) {
  phasor_row(*row);
}
void range_row_baseline(const RangeRow* row) {
  range_row(*row);
}
void judge_row_baseline(const JudgeRow* row) {
  judge_row(*row);
}
void points_row_baseline(const PointsRow* row) {
  points_row(*row);
}
}  // namespace sgrt::kernels
