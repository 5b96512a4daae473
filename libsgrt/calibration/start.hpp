// The start of the joint solve: each camera by itself, then the rig along the placements that cameras share.
// docs/theory/calibration.md, "Start".
#pragma once

#include "calibration/robust.hpp"

namespace sgrt {

// One camera alone: its lens and the target's pose in each of its views.
struct Mono {
  Camera camera;
  std::vector<View> views;  // the views that can be used, the camera's number kept
  std::vector<Pose> camera_from_target;
  double noise = 1;  // px
};

// Priors of a lens of this image, for `count` distortion terms (eq. 8).
LensPrior prior_of(const CalibrationCamera& camera, int count, double focal_length);

// Throws kInsufficientData or kDegenerate, naming the camera and what is missing.
Mono calibrate_alone(const Run& run, const CalibrationData& data, const CalibrationOptions& options,
                     const Target& target, const std::vector<View>& views, int camera,
                     std::vector<Discarded>& discarded);

// Poses of all cameras (the first one is the room) and placements; views that contradict the rig because their target
// is half-turned or mirrored are renamed where the target cannot tell, else discarded. Throws kInsufficientData naming
// a camera that nothing links to the first one.
Scene link_rig(const CalibrationData& data, const Target& target, std::vector<Mono>& alone,
               std::vector<Discarded>& discarded);

}  // namespace sgrt
