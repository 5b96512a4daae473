// From matches to points in the room, with normals and covariance. docs/theory/stereo.md eq. 20-23.
#pragma once

#include "core/run.hpp"
#include "stereo/match.hpp"
#include "stereo/rectify.hpp"
#include "stereo/rig_error.hpp"
#include "stereo/stereo.hpp"

namespace sgrt {

// Fills result (surface, reason, correlation, pixels, counts) from the matches; points outside the volume get their
// reason. gain: of bending_noise.
void triangulate(const Run& run, const Rectification& rectification, const RigError& rig_error, const Grid& grid,
                 const StereoOptions& options, double gain, std::vector<double> (&medians)[3], MatchField& field,
                 StereoResult& result);

}  // namespace sgrt
