// What a pose found from pairs is worth: the motions that the surfaces leave free, and the covariance of the others at
// the isocentre. The information is taken across the two independent normal estimates, so that noise in the normals,
// which makes a plane look rough, is not taken for shape. docs/theory/icp.md eq. 8-13.
#pragma once

#include <vector>

#include "registration/correspondences.hpp"
#include "registration/icp.hpp"

namespace sgrt {

struct Certificate {
  std::vector<FreeMotion> free;  // motions that the surfaces do not determine
  Mat6 covariance;               // (rotation rad, translation mm) at the isocentre; NaN with free motions
  double chi2;                   // reduced: 1 when the residuals are as the points' noise predicts
  double worst_sigma;            // mm, of the least certain motion, turns at 100 mm; NaN with free motions
  std::string worst_words;
};

Certificate certify(const Problem& problem, const std::vector<Pair>& pairs, const Pose& reference_from_live,
                    const Vec3& isocentre, double degenerate_sigma);

}  // namespace sgrt
