// The least-squares problem of a laser unit's calibration: what was seen, the unknowns, residuals and normal equations.
// For the files of calibration/laser.hpp alone; symbols and equations of docs/theory/laser.md.
#pragma once

#include <vector>

#include "calibration/laser.hpp"

namespace sgrt {

struct LaserProblem {
  Camera camera;
  Target target;
  double corner_noise;                // px
  std::vector<View> views{};          // one a placement
  std::vector<StripeSight> sights{};  // placement: of the views
  std::vector<double> weight{};       // robust, one a sight
  std::vector<double> readings{};     // distinct
  std::vector<int> reading_of{};      // of each sight
};

struct LaserState {
  LaserUnit unit;
  LaserVector off = LaserVector::Zero();  // from the start, for the prior
  std::vector<Pose> poses;                // room_from_board, one a view
};

// One sigma of the prior on each free direction of the unit, in its units: 0.1 rad, 100 mm.
constexpr double kLaserPrior = 100;

// The free directions of a unit among its parameters, a column each, 1 mrad or 1 mm long.
using LaserBasis = Eigen::Matrix<double, kLaserParameters, Eigen::Dynamic>;
LaserBasis basis_of(const LaserUnit& unit);

// Where the ray of a pixel meets the board's plane.
Vec3 point_on_board(const Camera& camera, const Pose& room_from_board, const Vec2& pixel);

// Where the ray of a stripe's centre meets the board, and how the plane's equation there changes.
struct Cut {
  Vec3 x, ray;
  double by_pixel;  // of e by the pixel across the stripe
  double error;     // e = n.x - d, mm; NaN where the board lies behind the camera
};
Cut cut_of(const Camera& camera, const Pose& room_from_board, const LightPlane& plane, const Vec2& pixel);

// Residuals of the stripes' centres, px along their lines, one a sight.
std::vector<double> stripe_residuals(const LaserProblem& p, const LaserState& s);

// Normal equations of the free directions of the unit, then of six numbers a board.
struct LaserNormal {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  double cost = 0;  // infinite where a residual is not finite; then the rest is not complete
};
LaserNormal normal_of(const LaserProblem& p, const LaserState& s);
// Of the stripes of one placement alone.
LaserNormal stripes_of_placement(const LaserProblem& p, const LaserState& s, int placement);

LaserState stepped(const LaserState& s, const Eigen::VectorXd& step);

// laser_solve.cpp: weights and steps in turns; the state's unit and poses are the start.
struct LaserSolution {
  int iterations = 0;
  double noise_scale = 1;  // robust, of the residuals over their sigma
};
LaserSolution solve_robustly(const Run& run, LaserProblem& p, LaserState& s, const LaserCalibrationOptions& options);

// laser_covariance.cpp: the unit's covariance, the directions that the sweep does not fix, and what both mean for the
// points of the stripes (eq. 19). Needs the residuals and noise_scale of the result.
void set_covariance(const LaserProblem& p, const LaserState& s, LaserCalibration& r);

// The rig's modes with the unit's covariance beside them.
RigUncertainty joined(const RigUncertainty& before, const LaserCalibration& r);

}  // namespace sgrt
