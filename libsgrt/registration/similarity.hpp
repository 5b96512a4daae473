// Rigid motion and one scale: Umeyama's (1991) similarity, fitted to the surface like ICP. docs/theory/nonrigid.md
// section 4.
#pragma once

#include "registration/icp.hpp"
#include "registration/patches.hpp"

namespace sgrt {

struct Similarity {
  Pose pose;         // live, scaled about the isocentre, to the reference
  double scale = 1;  // x -> isocentre + scale (x - isocentre) comes first
  double sigma;      // of the scale
  Vec6 lever;        // d pose / d scale at the isocentre, (rad, mm): what an error of the scale does to the pose
};

// Throws kDegenerate where the surfaces do not tell the size, kNotConverged, kNotFound.
Similarity fit_similarity(const Run& run, const Field& field, const Patches& patches, const Surface& live,
                          const Vec3& isocentre, const Pose& start, double live_roughness, const IcpOptions& options);

// x -> isocentre + scale (x - isocentre); lengths of the noise grow with it.
Surface scaled_about(Surface surface, const Vec3& isocentre, double scale);

}  // namespace sgrt
