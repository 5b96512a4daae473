// Whether the beam may be on: tolerances with hysteresis. A beam that is on stays on while everything is within
// tolerance; one that holds comes on again only when everything has come back well inside and has stayed there.
// Whatever is not known holds. docs/theory/tracking.md section 3.
#pragma once

#include <cstdint>

namespace sgrt {

enum class Profile : int { kConventional = 0, kSbrt = 1, kSrs = 2 };

struct Tolerance {
  double mm;   // of the length of the translation at the isocentre
  double deg;  // of the angle of the rotation
};
Tolerance tolerance_of(Profile profile);

struct Window {
  double low, high;  // mm
};

// Why the beam holds: bits.
enum Hold : int {
  kHoldNoPose = 1,
  kHoldWeak = 2,         // a pose that is not certain enough for the tolerance
  kHoldTranslation = 4,  // beyond tolerance
  kHoldRotation = 8,
  kHoldBreathing = 16,  // outside the window, or not measured
  kHoldReturning = 32,  // back within tolerance, but not yet well inside or not for long enough
};

struct BeamOptions {
  Tolerance tolerance;
  double hysteresis = 0.8;  // share of the tolerance, and of the window's half width, at which the beam comes on again
  double resume = 0;        // s within that share before it does
  bool gated = false;
  Window window{-1.5, 1.5};
};

struct Measured {
  double time;       // s
  bool pose, weak;   // found; found but not to be trusted
  double mm, deg;    // length and angle of the displacement
  double breathing;  // mm; NaN: not measured
};

class Beam {
 public:
  explicit Beam(const BeamOptions& options) : options_(options) {}
  // Takes one frame; returns whether the beam may be on.
  bool take(const Measured& m);
  // Holds until the next frame, which is then judged as one that comes back.
  void hold(int why);
  bool on() const { return on_; }
  int why() const { return why_; }  // 0 where the beam is on

 private:
  BeamOptions options_;
  bool on_ = false;
  bool fresh_ = true;    // before the first trusted frame the plain tolerance counts
  bool inside_ = false;  // within the hysteresis since `since_`
  double since_ = 0;
  int why_ = kHoldNoPose;
};

}  // namespace sgrt
