// The kernels of time of flight for the AVX2 instruction set.
#include "tof/kernels.hpp"

namespace sgrt::kernels {
namespace {
#include "tof/tof_kernel.inl"
}  // namespace
void phasor_row_avx2(const PhasorRow* row) {
  phasor_row(*row);
}
void range_row_avx2(const RangeRow* row) {
  range_row(*row);
}
void judge_row_avx2(const JudgeRow* row) {
  judge_row(*row);
}
void points_row_avx2(const PointsRow* row) {
  points_row(*row);
}
}  // namespace sgrt::kernels
