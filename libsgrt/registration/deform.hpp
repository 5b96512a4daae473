// Registration of a body that is not rigid: the part that moved rigidly apart from what changed its shape. Three modes:
// rigid (find the region that moved rigidly and report its motion alone), similarity (one scale for all) and field (a
// smooth displacement field over the rigid part's motion). docs/theory/nonrigid.md.
#pragma once

#include "registration/icp.hpp"

namespace sgrt {

enum class DeformMode : int { kRigid = 0, kSimilarity = 1, kField = 2 };

struct DeformOptions {
  DeformMode mode = DeformMode::kRigid;
  double min_rigid_share = 0.6;  // of the region's area that is seen; below it nothing can be told
  double max_structure = 0.1;    // mm rms: coherent change of shape that may be left in what is taken for rigid
  double max_rivalry = 0.5;      // of another motion, see runner_up_rivalry; above it the answer is ambiguous
  double stiffness = 1;          // of the field; higher: smoother
  IcpOptions icp;
};

struct DeformResult {
  IcpResult icp;                      // of the rigid part: status, verdict, pose, covariance; distance map at that pose
  double rigid_share = 0;             // of the region's seen area
  double structure = 0;               // mm rms, coherent residual within the rigid part
  double runner_up_share = 0;         // explained by the best motion that differs from the answer
  double runner_up_rivalry = 0;       // area that it alone explains over area that the answer alone explains
  double runner_up_distance = 0;      // mm, by which it differs (turns at 100 mm); NaN: there is none
  double scale = 1, scale_sigma = 0;  // live to reference; 1 and NaN unless kSimilarity
  double deformation_rms = 0, deformation_max = 0;  // mm, of the map
  std::vector<std::uint8_t> rigid;                  // a live point: 1 rigid, 0 deformed, 255 not known
  Points deformation;  // a live point: change of shape, reference axes, mm; NaN where not known
};

// roi may be null. Statuses 10-19 are returned, not thrown.
DeformResult deform_align(const Run& run, const Surface& reference, const Surface& live, const Vec3& isocentre,
                          const Roi* roi, const Pose& initial_reference_from_live, const DeformOptions& options);

}  // namespace sgrt
