// Calibration of a time-of-flight camera: from a flat board at known poses to the error of the range over the range
// itself (wiggling), over the amplitude, and of each pixel. Lindner and Kolb (2006). docs/theory/tof.md eq. 13-15.
#pragma once

#include <string>
#include <vector>

#include "core/run.hpp"
#include "tof/tof.hpp"

namespace sgrt {

// The board in one placement, and what the camera measured of it.
struct TofPlacement {
  std::string name;
  Pose room_from_board;  // its plane is z = 0
  TapsView taps;
};

struct TofCalibrationOptions {
  Vec2 low = Vec2::Zero(), high = Vec2::Zero();  // mm: the rectangle of the board that is flat and bare
  double knot_spacing = 50;                      // mm
  int amplitude_knots = 8;
  double pixel_sigma = 10;  // mm, what a pixel's offset may be
};

struct TofPlacementFigures {
  std::string name;
  std::int64_t pixels = 0;
  double range = 0, before = 0, after = 0;  // mm: mean range, mean residual without and with the corrections
};

struct TofCalibration {
  Status status = Status::kOk;
  std::string message;
  Rig rig;  // with the corrections
  std::string unit;
  std::vector<float> pixel_offset;  // a number a pixel, mm
  std::vector<TofPlacementFigures> placements;
  std::vector<double> range_sigma;  // mm, of the correction at each knot, by noise
  std::int64_t samples = 0, outliers = 0;
  double rms_before = 0, rms_after = 0;  // mm, of single pixels
  double expected = 0;                   // mm, of single pixels by their own sigma
  double placement_rms = 0;              // mm, of the placements' means: what is left of the board's pose and the model
  double pixel_rms = 0;                  // mm, of the pixels' offsets
  std::vector<std::string> warnings;
};

// One sample: a pixel that saw the board.
struct TofSample {
  float range, error, amplitude, sigma;  // mm, counts; error: measured less true
  std::int32_t pixel, placement;
};

// The three terms of the error, fitted in turns until they stand (backfitting), with robust weights (eq. 14-15).
struct TofFit {
  std::vector<double> range_knots, range_error, range_sigma, amplitude_knots, amplitude_error;
  std::vector<float> pixel_offset;
  std::vector<char> used;  // of each sample
};
// wave: mm, the unambiguous range of the highest frequency: wiggling repeats four times in it, and so tells how smooth
// it is.
TofFit fit_tof(const std::vector<TofSample>& samples, std::size_t pixels, double wave,
               const TofCalibrationOptions& options);

// Any corrections that the rig holds are replaced.
TofCalibration calibrate_tof(const Run& run, const Rig& rig, int unit, const std::vector<TofPlacement>& placements,
                             const TofOptions& sensor_options, const TofCalibrationOptions& options);

}  // namespace sgrt
