// Calibration of a laser unit: its stripe on a board in several placements, at many mirror angles, gives the fan, the
// mirror's axis, offset and scale; board poses are refined with it. docs/theory/laser.md eq. 18-22.
#pragma once

#include "calibration/calibrate.hpp"
#include "rig/laser.hpp"

namespace sgrt {

// One centre of the stripe.
struct StripeSight {
  int placement = 0;
  double reading = 0;  // mirror angle as read, rad
  Vec2 pixel = Vec2::Zero();
  double sigma = 0.1;  // px along the line that it was found on
};

struct LaserCalibrationOptions {
  bool fixed = false;       // a laser without a mirror: its plane is one
  double corner_noise = 0;  // px; 0: the rig's residual_px, or 0.1
  double outlier_sigma = 6;
  int max_iterations = 100;
};

struct LaserCalibration {
  Status status = Status::kOk;
  std::string message;
  LaserUnit unit;
  std::string rig_json;  // the rig with the unit and its uncertainty
  std::vector<std::string> parameters;
  Eigen::MatrixXd covariance;
  struct Placement {
    std::string name;
    int corners = 0, stripes = 0;
    double corner_rms = 0, stripe_rms = 0;  // px
    Pose room_from_board;
  };
  std::vector<Placement> placements;
  std::vector<StripeSight> sights;  // those on the board
  std::vector<double> residuals;    // px along the line, one each
  std::vector<bool> counts;         // no outlier
  double rms = 0, noise_scale = 1;  // px; residuals over their sigma
  double sigma_mm = 0;              // median effect of the covariance on the points of the stripes
  std::vector<std::string> unfixed, warnings;
  int iterations = 0;
};

// data: corners of the board in its placements as seen by the laser's camera (one camera); start: the rig's unit, or
// nullptr.
LaserCalibration calibrate_laser(const Run& run, const Rig& rig, const std::string& laser_id, const LaserUnit* start,
                                 const CalibrationData& data, const std::vector<StripeSight>& stripes,
                                 const LaserCalibrationOptions& options);

// laser_start.cpp: a unit from points of the room on the light planes of their readings (eq. 21-22). Throws kDegenerate
// where they do not tell the planes.
LaserUnit first_unit(const std::vector<Vec3>& x_in_room, const std::vector<double>& reading, bool fixed,
                     const Vec3& camera);

}  // namespace sgrt
