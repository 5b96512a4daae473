// What the calls of a calibration share.
#pragma once

#include <sgrt.h>

#include "calibration/calibrate.hpp"

namespace sgrt {

// The caller's correspondences, shapes and sizes checked.
CalibrationData data_from_c(const sgrt_calibration_data* given);

}  // namespace sgrt
