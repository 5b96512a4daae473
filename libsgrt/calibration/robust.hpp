// The robust loop round the bundle: noise from the residuals, Cauchy weights while there are outliers, then plain least
// squares on what is left. docs/theory/calibration.md eq. 12-14.
#pragma once

#include "calibration/calibrate.hpp"

namespace sgrt {

struct Robust {
  int iterations = 0;
  bool converged = false;
};
// Sets the views' weights to 0 or 1 and bundle.noise to the corners' noise. rough: the start of another
// solve, so the last rounds of plain least squares are left out.
Robust solve_robustly(const Run& run, Bundle& bundle, Scene& scene, const CalibrationOptions& options,
                      bool rough = false);

// One sigma of a corner's coordinate, px: from the residuals that count, corrected for the parameters spent (eq. 13).
double noise_of(const Bundle& bundle, const Scene& scene);

// px a point, of a camera's views or of all (camera -1); all: also of the corners that do not count.
double rms_of(const Bundle& bundle, const Scene& scene, int camera, bool all);

}  // namespace sgrt
