// One least-squares solve over fixed pairs with ceres::TinySolver (Levenberg-Marquardt):
// min over (w, t) of sum weight (n . (Exp(w) x + t - z))^2 / variance, x = y - pivot, z = q - pivot. docs/theory/icp.md
// eq. 6-7.
#pragma once

#include <vector>

#include "core/geometry.hpp"
#include "registration/correspondences.hpp"

namespace sgrt {

// Residuals and their analytic Jacobian as TinySolver wants them; parameters are (w rad, t mm).
class PlaneCost {
 public:
  typedef double Scalar;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 6 };

  PlaneCost(const std::vector<Pair>& pairs, const Vec3& pivot) : pairs_(pairs), pivot_(pivot) {}
  int NumResiduals() const { return static_cast<int>(pairs_.size()); }
  // jacobian: column-major, one column a parameter, or null.
  bool operator()(const double* parameters, double* residuals, double* jacobian) const;

 private:
  const std::vector<Pair>& pairs_;
  Vec3 pivot_;
};

// The motion after the one at which the pairs were made: x -> Exp(w) (x - pivot) + pivot + t.
Vec6 refine(const std::vector<Pair>& pairs, const Vec3& pivot);

// The twist as a pose of the room.
Pose motion_about(const Vec6& twist, const Vec3& pivot);

}  // namespace sgrt
