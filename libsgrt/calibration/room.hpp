// A rig into the room: a phantom whose points are known in the room's frame, seen by the cameras, gives room_from_rig;
// several rigs (pods calibrated by themselves) become one. docs/theory/calibration.md eq. 24-27.
#pragma once

#include "calibration/calibrate.hpp"

namespace sgrt {

struct RoomOptions {
  double point_sigma_mm = 0;  // one sigma of the phantom's own points, each coordinate
  double noise_px = 0;        // one sigma of a found point; 0: the residual_px of the rig, or what the residuals say
  double outlier_sigma = 6;
  std::string rig_id, room;  // of the result; empty: as the first rig, "IEC 61217 fixed, mm"
};

// Of one rig, or of one pair of it.
struct RoomFit {
  std::string name;
  Pose rig_from_room;  // identity where the rig was in this room already and nothing has moved
  Mat6 covariance;  // of (rotation rad, translation mm) at the room's origin, room axes, by noise and tolerance: where
                    // points there are measured
  int points = 0, sights = 0;
  double rms_px = 0, point_rms_mm = 0;  // residuals in the images; of the triangulated points against the phantom
};

struct RoomResult {
  Status status = Status::kOk;
  std::string message;
  Rig rig;
  std::vector<RoomFit> rigs, pairs;
  double pair_disagreement_mm =
      0;  // RMS between points as different pairs have them, after the fit; NaN below two pairs
  double noise_px = 0;
  std::vector<Discarded> discarded;  // camera as in data, point as in data
  std::vector<std::string> warnings;
};

// data: points are the phantom's, in the room; one placement; cameras by the ids of the rigs.
RoomResult room_from_phantom(const Run& run, const std::vector<const Rig*>& rigs, const CalibrationData& data,
                             const RoomOptions& options);

}  // namespace sgrt
