// Registration without a first guess: every way to lay a live point on a place of the reference, normal on normal and
// spun about it, is tried on the coarse levels; the best are refined, and the best of those must stand out from every
// other pose. docs/theory/coarse.md.
#pragma once

#include <string>

#include "core/error.hpp"
#include "core/geometry.hpp"
#include "registration/live.hpp"
#include "registration/reference.hpp"

namespace sgrt {

struct CoarseResult {
  Status status = Status::kOk;  // kNotFound: nothing fits; kDegenerate: another pose is nearly as good
  std::string message;
  Pose pose, runner_up;                   // reference_from_live; the best that is not near it
  double score = 0, runner_up_score = 0;  // 0 to 1: the share of the live points that fit, each by how well
};

// live: of the whole surface, with normals where it has any.
CoarseResult find_anywhere(const Run& run, const Reference& reference, const LivePoints& live);

}  // namespace sgrt
