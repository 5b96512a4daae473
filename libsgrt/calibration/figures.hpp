// What a calibration says about itself beside its RMS: coverage, tilt, distances, projection uncertainty, patterns in
// the residuals, and the comparison of two halves of the images. docs/theory/calibration.md, "Validation".
#pragma once

#include "calibration/calibrate.hpp"

namespace sgrt {

constexpr int kCellsAcross = 8, kCellsDown = 6;  // of the coverage map

// Cells of the image that hold a corner, row by row.
std::vector<bool> coverage_of(const CalibrationResult& result, int camera);

// Fills result.cameras and result.volume, and adds warnings.
void describe_cameras(const CalibrationData& data, CalibrationResult& result);

// Difference of two calibrations of the same cameras over the covered cells, and what their covariances predict (eq.
// 16).
void compare_halves(const CalibrationResult& a, const CalibrationResult& b, CalibrationResult& result);

}  // namespace sgrt
