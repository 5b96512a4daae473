// Peaks of the lines of an image that may be the stripe, and the choice among them. docs/theory/laser.md eq. 5-6.
#pragma once

#include <vector>

#include "laser/lines.hpp"
#include "laser/stripe.hpp"

namespace sgrt {

struct Candidate {
  int at = 0;            // pixel
  float centre = 0;      // px, the centroid where the kernel gave one
  float contrast = 0;    // grey levels over the local background
  float background = 0;  // grey levels
  float width = 0;       // px, sigma by the width at half height
  int piece = -1;        // which continuous stripe it belongs to
  float sum = 0;         // grey levels over the background in the kernel's window; 0: not from the kernel, or clipped
  float asymmetry = 0;   // as asymmetry_of has it; where sum > 0
};

constexpr int kMaxCandidates = 4;
// Nearly every line has one: the others lie elsewhere, so that the lines of an image stay in the cache.
struct LineCandidates {
  Candidate first;
  std::vector<Candidate> others;
  int count = 0;
  void add(const Candidate& c) {
    if (count++ == 0)
      first = c;
    else
      others.push_back(c);
  }
  Candidate& operator[](int i) { return i == 0 ? first : others[static_cast<std::size_t>(i - 1)]; }
  const Candidate& operator[](int i) const { return i == 0 ? first : others[static_cast<std::size_t>(i - 1)]; }
};

// How far left and right of `centre` the profile in v[0 .. n) comes down to a share of its height, px; NaN where it
// does not.
struct HalfWidths {
  float left, right;
};
HalfWidths half_widths(const float* v, int n, float centre, float background, float contrast, float share = 0.5F);

// Two-sided width test (eq. 9): how far the foot of the profile reaches to the right and to the left of its top's
// middle, (right - left) / (right + left). About the fitted centre every profile looks even, because the fit has moved
// there. 0 where the profile does not come down.
float asymmetry_of(const float* v, int n, float centre, float width, float background, float contrast);

// The candidates of one line. buffer: at least two lines long.
LineCandidates find_candidates(const Run& run, const Lines& lines, int line, int half, float min_signal,
                               std::vector<float>& buffer);

// The window's half width from the stripes of some lines.
int window_of(const Run& run, const Lines& lines, float min_signal);

// Continuous pieces across the lines; each line takes the candidate of the strongest piece (of the right width). Writes
// kNone, kNoStripe or kAmbiguous to reason and the candidate's number to chosen.
void choose(std::vector<LineCandidates>& lines, int min_length, std::vector<LineReason>& reason,
            std::vector<int>& chosen);

}  // namespace sgrt
