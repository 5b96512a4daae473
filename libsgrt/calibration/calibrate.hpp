// Calibration of a rig: from what each camera saw of a target in many placements to lenses, poses and their covariance.
// docs/theory/calibration.md.
#pragma once

#include <string>
#include <vector>

#include "calibration/bundle.hpp"
#include "core/error.hpp"

namespace sgrt {

struct CalibrationCamera {
  std::string id;
  int width = 0, height = 0;  // px
};

// One point of the target, seen by one camera in one placement.
struct Sight {
  int camera = 0, placement = 0, point = 0;
  Vec2 pixel = Vec2::Zero();
  double sigma = 1;  // relative
};

struct CalibrationData {
  std::vector<CalibrationCamera> cameras;
  std::vector<std::string> placements;  // their names
  std::vector<StereoPair> pairs;
  Points points;                     // the target, mm
  bool half_turn_ambiguous = false;  // turned by half a turn in its plane the target looks the same
  std::vector<Sight> sights;
};

struct CalibrationOptions {
  int distortion_count = 5;  // 0 pinhole, 5 brown5, 8 rational8
  int max_iterations = 100;
  int min_views = 3;         // of each camera
  double outlier_sigma = 6;  // a corner further off than this is an outlier
  double warp_sigma_mm = 0;  // of the board's warp over its half; 0: 1 % of the half size; negative: a flat board
  bool split_half = true;
  std::string rig_id = "calibrated rig";
};

// Why a view or a corner does not count.
struct Discarded {
  int camera = 0, placement = 0, point = -1;  // point -1: the whole view
  double residual = 0;                        // px; NaN where there is none
  std::string why;
};

struct CameraFigures {
  int views = 0, corners = 0;
  double rms = 0, rms_all = 0;  // px a point (OpenCV's figure); of the corners that count, of all
  double coverage = 0;          // share of the image's cells (8 x 6) with a corner
  double tilt_min_deg = 0, tilt_max_deg = 0,
         tilt_spread_deg = 0;                 // of the board's normal against the line of sight; between views
  double distance_min = 0, distance_max = 0;  // mm
  double pattern = 0;  // square of the residuals' mean in cells of the image over what noise leaves there: 1 is right
  // One sigma of the projection over a grid of the image, a matrix a distance, px a coordinate, the camera's own place
  // and direction fitted to the covered part (eq. 15).
  std::vector<double> map_distances, map_x, map_y;
  std::vector<Eigen::MatrixXd> map_sigma;
  double projection_sigma_centre = 0, projection_sigma_worst = 0;
  double split_rms = 0, split_predicted = 0;  // px over the covered part; NaN where not tried
};

// A point that a pair triangulates in the middle of its left camera's view: one sigma along the room's axes,
// calibration and noise.
struct VolumeFigures {
  std::string pair;
  double distance = 0;
  Vec3 sigma;
};

struct CalibrationResult {
  Status status = Status::kOk;
  std::string message;
  Rig rig;
  std::vector<std::string> parameters;
  Eigen::MatrixXd covariance;  // of the parameters
  std::vector<LensPrior> priors;
  Bundle bundle;  // as it was solved: views, weights, noise
  Scene scene;
  std::vector<Discarded> discarded;
  std::vector<CameraFigures> cameras;
  std::vector<VolumeFigures> volume;
  std::vector<std::string> warnings;
  double noise = 0;             // px a coordinate, corrected for degrees of freedom
  double rms = 0, rms_all = 0;  // px a point, all cameras
  int iterations = 0;
};

CalibrationResult calibrate(const Run& run, const CalibrationData& data, const CalibrationOptions& options);

}  // namespace sgrt
