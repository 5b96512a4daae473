// Joint least squares of all cameras, all board placements and the board's warp (bundle adjustment),
// Levenberg-Marquardt with the placements eliminated by the Schur complement. Triggs et al., "Bundle adjustment - a
// modern synthesis" (2000); Lourakis and Argyros (2009). Not Ceres: the covariance needs these very normal equations,
// and Debian's Ceres brings copyleft parts into the library's needs. docs/theory/calibration.md eq. 4-9.
#pragma once

#include <array>
#include <vector>

#include "core/run.hpp"
#include "rig/parameters.hpp"

namespace sgrt {

// What one camera saw of the target in one placement. index: of each point in the target.
struct View {
  int camera = 0, placement = 0;
  std::vector<int> index;
  std::vector<Vec2> pixel;
  std::vector<double> sigma;   // relative one sigma of each pixel coordinate
  std::vector<double> weight;  // robust weight, 0 for an outlier
};

// The unknowns. Camera poses are relative to the room, which is the reference camera's frame.
struct Scene {
  std::vector<Camera> cameras;
  std::vector<Pose> room_from_target;  // one a placement
  Vec3 warp = Vec3::Zero();            // mm, of u^2, u v, v^2 along the target's z
};

// The target: points in mm, and the coordinates (u, v), -1 to 1 over the longer side, that its warp is a quadratic of.
struct Target {
  Points points;
  Vec2 centre = Vec2::Zero();
  double half_size = 1;  // mm

  Vec3 warp_basis(int i) const;
};
Target make_target(const Points& points);
// A point of the target as the scene's warp has it.
Vec3 warped(const Target& target, const Vec3& warp, int i);

// Normal priors of a camera's lens; sigma 0: the parameter is held at its value, infinity: no prior.
struct LensPrior {
  LensVector mean = LensVector::Zero(), sigma = LensVector::Constant(std::numeric_limits<double>::infinity());
};

struct Bundle {
  Target target;
  std::vector<View> views;
  std::vector<LensPrior> priors;  // one a camera
  int reference = 0;              // its pose is held
  bool hold_cameras = false;      // only the placements are solved for
  double warp_sigma = 0;          // mm; 0: a flat board
  double noise = 1;               // px; times a corner's relative sigma it is the corner's one sigma
};

// Where each free parameter stands in the reduced system; -1 where it is held.
struct Layout {
  std::vector<std::array<int, kMaxLens>> lens;
  std::vector<int> pose;  // of the first of six
  int warp = -1, size = 0;
};
Layout layout_of(const Bundle& bundle, const Scene& scene);

// Residuals (pixel seen less pixel projected) of a view; NaN where a point cannot be projected.
std::vector<Vec2> residuals_of(const Bundle& bundle, const Scene& scene, const View& view);

struct Solution {
  int iterations = 0;
  bool converged = false;
  double cost = 0;
};
// Improves the scene. Throws kDegenerate where a point of weight > 0 cannot be projected to begin with.
Solution solve(const Run& run, const Bundle& bundle, Scene& scene, int max_iterations);

// The information matrix of cameras and warp, placements eliminated, at the scene (unit: 1 over the noise squared is in
// it). with_priors: false leaves the data alone to speak.
Eigen::MatrixXd information_of(const Bundle& bundle, const Scene& scene, bool with_priors);
// Its inverse, by a Cholesky factor of the matrix scaled to a unit diagonal; NaN everywhere where it is not positive
// definite.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& information);

}  // namespace sgrt
