// A smooth displacement field over the rigid motion: displacements of the patches' centres, blended between them
// (embedded deformation, Sumner et al. 2007), with a stiffness between neighbours (Amberg et al. 2007).
// docs/theory/nonrigid.md section 5.
#pragma once

#include "registration/patches.hpp"

namespace sgrt {

struct FieldOptions {
  double max_distance, min_cos;
  double stiffness = 1;
};

// The displacement that lays each live point, moved by the pose, on the reference: N x 3 mm in the reference's axes,
// NaN where there is no correspondence.
Points displacement_field(const Run& run, const Field& field, const Patches& patches, const Surface& live,
                          const Pose& reference_from_live, double live_roughness, const FieldOptions& options);

}  // namespace sgrt
