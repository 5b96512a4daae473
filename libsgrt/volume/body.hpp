// Which voxels are the patient: tissue by threshold, the couch cut away, the largest connected part, airways and
// cavities closed. docs/theory/volume.md section 1.
#pragma once

#include "volume/support.hpp"
#include "volume/voxels.hpp"

namespace sgrt {

struct BodyOptions {
  double threshold = -480;   // half-way from air to soft tissue, HU
  double closing = 4;        // mm: air that a ball of this radius cannot reach from outside belongs to the body
  Vec3 down = Vec3::Zero();  // towards the couch, in voxels; zero: no couch is searched
};

struct Body {
  Runs tissue;  // above the threshold
  Runs mask;    // the patient, without cavities
  Support support;
};

Body find_body(const Run& run, const Voxels& voxels, const BodyOptions& options);

}  // namespace sgrt
