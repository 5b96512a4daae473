// A stored rig against images that it was not made from: the placements are fitted, the cameras are not.
// docs/theory/calibration.md, "Validation".
#pragma once

#include "calibration/calibrate.hpp"

namespace sgrt {

struct CheckResult {
  Status status = Status::kOk;
  std::string message;
  std::vector<std::string> cameras;    // ids, as the data has them
  std::vector<CameraFigures> figures;  // views, corners, rms and rms_all; the others 0
  std::vector<Discarded> discarded;
  std::vector<std::string> warnings;
  Bundle bundle;
  Scene scene;
  double noise = 0, rms = 0, rms_all = 0;
  double expected_rms =
      0;  // px a point: the rig's own noise and its calibration's uncertainty (eq. 23); NaN where not stated
};

// Cameras of `data` are found in the rig by id; their sizes must agree.
CheckResult check_rig(const Run& run, const Rig& rig, const CalibrationData& data, const CalibrationOptions& options);

}  // namespace sgrt
