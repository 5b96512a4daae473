// Several frequencies to one range: joint maximum likelihood over the numbers of turns (eq. 7 of docs/theory/tof.md).
#pragma once

#include <vector>

namespace sgrt {

constexpr int kMostFrequencies = 8;

struct Unwrapper {
  int frequencies = 0;
  double mm_per_rad[kMostFrequencies] = {}, ambiguity[kMostFrequencies] = {};  // mm
  double low = 0, high = 0;                                                    // window, mm
  double tolerance = 0;      // mm, one sigma of what the frequencies disagree by beside noise
  double unknown_sigma = 0;  // rad, taken where the noise is not known
};

struct Unwrapped {
  double range, sigma;  // mm; NaN where there is none; sigma NaN where the noise is not known
  double score;         // log-likelihood over that of the next best range in the window; infinity: there is no other
  double misfit;        // chi^2 of the frequencies about it, frequencies - 1 degrees of freedom
};

// phase: rad, variance: rad^2 (NaN: not known), one a frequency.
Unwrapped unwrap(const Unwrapper& u, const double* phase, const double* variance);

// Of which the ranges of all frequencies repeat, mm: half the wave of their greatest common divisor (to 1 Hz).
double joint_ambiguity(const std::vector<double>& modulation_hz, double speed_mm_s);

}  // namespace sgrt
