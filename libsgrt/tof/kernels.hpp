// The hot loops of time of flight, compiled once per instruction set from tof_kernel.inl (plain C inside: no inline
// function of another header leaks into a file of a higher instruction set). All rows are float32; `count` pixels of
// each are written, inputs may be read up to 8 floats beyond. docs/theory/tof.md.
#pragma once

#include <cstdint>

namespace sgrt::kernels {

// The same bits as SGRT_TOF_... of sgrt.h.
constexpr int kSaturated = 1, kLowAmplitude = 2, kMoved = 4, kFlying = 8, kWrapped = 16, kOutOfRange = 32,
              kUncalibrated = 64;
constexpr int kTofRejected = 63;  // a pixel with one of these has no point

// A row of taps at one frequency to its phasor (eq. 2-5).
struct PhasorRow {
  const float* taps;  // tap_count rows of `stride`
  int stride, count, tap_count, null_count;
  const float* model;             // tap_count x 3: weights of a tap in B, C and S
  const float* null_space;        // null_count x tap_count, orthonormal: what a still scene leaves at 0
  float gain, floor;              // variance of a tap: gain max(tap, 0) + floor, counts^2; both 0: not known
  const float* share;             // of the variance that averaging leaves, a number a pixel; NULL: 1
  float low, high;                // a tap at or beyond them is clipped
  float moved_limit, tolerance2;  // of the chi^2 of the null space; share of the amplitude^2 added to its variance
  float *phase, *amplitude, *offset;
  float* variance;      // rad^2; NaN where not known
  std::uint8_t* flags;  // or-ed into
};
void phasor_row_baseline(const PhasorRow* row);
void phasor_row_avx2(const PhasorRow* row);

// One frequency: phase to range in a window (eq. 6).
struct RangeRow {
  const float *phase, *amplitude, *variance;
  int count;
  float mm_per_rad, ambiguity;  // mm
  float low, high;              // window, mm
  float *range, *sigma;
};
void range_row_baseline(const RangeRow* row);
void range_row_avx2(const RangeRow* row);

// The verdict on a row's ranges, and how far its neighbours may lie: reach, NaN where the pixel has no range (eq. 9).
struct JudgeRow {
  const float *range, *sigma, *amplitude;
  int count, known_sigma;
  float low, high, ambiguity;  // window; a second range fits into it where range + ambiguity does
  float min_amplitude, max_sigma, max_phase_sigma_mm;
  float jump_sigmas, jump_slope;
  float* reach;
  std::uint8_t* flags;
};
void judge_row_baseline(const JudgeRow* row);
void judge_row_avx2(const JudgeRow* row);

// Flying pixels by the jumps to the four neighbours, and points along the rays.
struct PointsRow {
  const float *range, *reach;
  const float *range_above, *reach_above, *range_below, *reach_below;  // NULL at the image's border
  const float* ray[3];
  float centre[3];
  int count;
  float* point[3];
  std::uint8_t* flags;
};
void points_row_baseline(const PointsRow* row);
void points_row_avx2(const PointsRow* row);

}  // namespace sgrt::kernels
