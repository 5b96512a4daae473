// The taps of a frame as rows of floats, and the weights that turn them into a phasor (eq. 2-5 of docs/theory/tof.md).
#pragma once

#include <vector>

#include "tof/kernels.hpp"
#include "tof/tof.hpp"

namespace sgrt {

// Weights of the taps in B, C and S by least squares, and an orthonormal basis of what they cannot explain.
struct TapModel {
  int taps = 0, null_count = 0;
  std::vector<float> weights, null_space;  // taps x 3; null_count x taps
  float gain = 0, floor = 0;               // variance of a tap, counts^2: gain max(tap, 0) + floor
  float moved_limit = 0;
};

// integers: rounding to a count adds its variance of 1/12.
TapModel make_tap_model(const TofUnit& unit, bool integers);

// Row y of every tap of one frame at one frequency into rows of `stride` floats.
void load_taps(const TapsView& view, std::int64_t frame, std::int64_t frequency, int y, float* out, int stride);

// The mean of the frames that agree with the last one, backwards from it, at all frequencies: out has frequencies x
// taps rows of `stride`, frames_used and share (1 / frames_used) one row. scratch is reused.
struct AverageWork {
  std::vector<float> frames;
};
void average_taps(const TapsView& view, const TapModel& model, int y, float low, float high, float* out, int stride,
                  float* frames_used, float* share, AverageWork& work);

}  // namespace sgrt
