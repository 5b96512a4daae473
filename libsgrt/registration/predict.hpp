// What a reference and its ROI promise before anything is seen: the covariance of a registration of live points as
// dense as the reference's. docs/theory/icp.md section 4.
#pragma once

#include "registration/certificate.hpp"

namespace sgrt {

// The information of live points that lie on some surfels of the finest level, about the field's centre.
struct Outlook {
  Sums sums;
  Mat6 live_score = Mat6::Zero();       // of the live noise
  Mat6 reference_score = Mat6::Zero();  // of the reference's
  Mat6 false_part = Mat6::Zero();       // information that noise in the reference's normals makes up
};
// marked: of the surfels; null: those in the ROI. live_sigma: mm along the normal, of independent live points.
Outlook outlook_of(const Reference& reference, const std::uint8_t* marked, double live_sigma, Workspace& work);

Certificate predict(const Reference& reference, const Outlook& outlook, const Vec3& isocentre, double degenerate_sigma);

}  // namespace sgrt
