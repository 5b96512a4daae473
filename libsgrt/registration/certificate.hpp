// What a pose is worth: the motions that the surfaces leave free, and the covariance of the others at the isocentre,
// its random part (live noise) apart from what all frames share (the reference's noise, calibration). What noise in the
// reference adds to the information is taken off before anything is called determined. docs/theory/icp.md eq. 10-16.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "registration/icp.hpp"
#include "registration/search.hpp"

namespace sgrt {

struct Certificate {
  std::vector<FreeMotion> free;  // motions that the surfaces do not determine
  std::array<Direction, 6>
      directions;                   // the independent ones of the covariance, the least certain first; without words
  Mat6 covariance, random, shared;  // (rotation rad, translation mm) at the isocentre; NaN with free motions
  double chi2;                      // reduced: 1 when the residuals are as the points' noise predicts
};

// sums, work.w: of the last round of the search at about this pose. Fills work.r and work.surfel.
Certificate certify(const Run& run, const Reference& reference, const Surface& live, const Pose& reference_from_live,
                    const Sums& sums, const Vec3& isocentre, const IcpOptions& options, double limit, Workspace& work);

}  // namespace sgrt
