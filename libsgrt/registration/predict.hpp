// What a reference and its ROI promise before anything is seen: the covariance of a registration of live points as
// dense as the reference's. docs/theory/icp.md section 7.
#pragma once

#include "registration/certificate.hpp"

namespace sgrt {

// live_sigma: mm along the normal, of independent live points.
Certificate predict(const Reference& reference, const Vec3& isocentre, double live_sigma, double degenerate_sigma);

}  // namespace sgrt
