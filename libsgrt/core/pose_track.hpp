// The pose of a body over time, between its samples along the screw that joins them. docs/theory/laser.md eq. 15.
#pragma once

#include <vector>

#include "core/geometry.hpp"

namespace sgrt {

struct PoseTrack {
  std::vector<double> time;          // s, increasing
  std::vector<Pose> room_from_body;  // one each
};

// Throws kInvalidArgument naming the entry: no pose, times that do not increase or are not finite.
void check_track(const PoseTrack& track);

// Throws kInvalidArgument where the track does not reach to `time`: it is never extrapolated.
Pose pose_at(const PoseTrack& track, double time);

}  // namespace sgrt
