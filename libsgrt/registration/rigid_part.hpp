// The part of the body that moved rigidly, and its motion. docs/theory/nonrigid.md section 3.
#pragma once

#include "registration/consensus.hpp"
#include "registration/deform.hpp"

namespace sgrt {

struct RigidPart {
  Pose pose;                        // reference_from_live of the consensus
  std::vector<std::uint8_t> rigid;  // a patch agrees
  std::vector<std::uint8_t> core;   // agrees, and does not touch one that does not
  double share = 0;
  double runner_up_share = 0, runner_up_distance;  // NaN: there is none
  double runner_up_rivalry = 0;  // area that it alone explains over area that the answer alone explains
};

RigidPart find_rigid_part(const Run& run, const Field& field, const Patches& patches, const Surface& live,
                          const Vec3& isocentre, const Pose& start, double live_roughness, const IcpOptions& options);

// Coherent rms height left in the patches marked, mm: from products of neighbours, in which noise averages out.
double structure_of(const Patches& patches, const Evidence& evidence, const std::vector<std::uint8_t>& marked);

// The pose error that coherent misfit of this rms makes: each patch with its neighbours is one draw.
Mat6 structure_covariance(const Patches& patches, const Evidence& e, const std::vector<std::uint8_t>& marked,
                          double structure, const Vec3& isocentre);

}  // namespace sgrt
