// Reports as JSON text, schema sgrt-calibration/1, and a calibrated rig's provenance. docs/formats.md.
#pragma once

#include <string>

#include "calibration/check.hpp"
#include "calibration/laser.hpp"
#include "calibration/room.hpp"
#include "calibration/tof.hpp"

namespace sgrt {

std::string report_json(const CalibrationData& data, const CalibrationResult& result);
std::string report_json(const CalibrationData& data, const CheckResult& result);
std::string report_json(const CalibrationData& data, const RoomResult& result);
std::string report_json(const CalibrationData& data, const LaserCalibration& result);
std::string report_json(const TofCalibration& result);

// The rig's text with what it came from: images, noise, board warp.
std::string rig_with_provenance(const CalibrationData& data, const CalibrationResult& result);
std::string rig_with_provenance(const CalibrationData& data, const RoomResult& result);
std::string rig_with_provenance(const TofCalibration& result);

}  // namespace sgrt
