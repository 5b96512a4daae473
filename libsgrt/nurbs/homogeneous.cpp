// Checks of control points and weights, and binomial coefficients.
#include "nurbs/homogeneous.hpp"

#include <cmath>
#include <string>

#include "core/error.hpp"
#include "core/surface.hpp"

namespace sgrt {

void check_control_points(const Points& points, Eigen::VectorXd& weights, Eigen::Index count) {
  if (points.rows() != count) {
    fail(Status::kInvalidArgument, "control_points: " + std::to_string(points.rows()) + " points, expected " +
                                       std::to_string(count) + " for these knots and degrees");
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) {
      if (std::abs(points(i, c)) <= kMaxCoordinate) continue;
      fail(Status::kInvalidArgument, "control_points[" + std::to_string(i) + "]: " + text_of(points(i, c)) +
                                         ", expected a coordinate within 1e5 mm");
    }
  }
  if (weights.size() == 0) return;
  if (weights.size() != count) {
    fail(Status::kInvalidArgument,
         "weights: " + std::to_string(weights.size()) + ", expected one a control point, " + std::to_string(count));
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    if (weights[i] >= 1e-9 && weights[i] <= 1e9) continue;
    fail(Status::kInvalidArgument,
         "weights[" + std::to_string(i) + "]: " + text_of(weights[i]) + ", expected above 0, from 1e-9 to 1e9");
  }
  if ((weights.array() == weights[0]).all()) weights.resize(0);
}

double binomial(int d, int k) {
  double b = 1;
  for (int i = 1; i <= k; ++i) b = b * (d - k + i) / i;  // whole numbers all the way
  return b;
}

}  // namespace sgrt
