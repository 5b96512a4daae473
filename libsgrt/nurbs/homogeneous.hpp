// Control points in homogeneous form (w x, w y, w z, w), where rational becomes polynomial, and the quotient rule that
// leads back. The NURBS Book, eq. 4.8 and 4.20. Weights above 0 keep the denominator above 0.
#pragma once

#include "core/eigen.hpp"

namespace sgrt {

using Vec4 = Eigen::Vector4d;

inline Vec4 homogeneous(const Points& points, const Eigen::VectorXd& weights, Eigen::Index i) {
  const double w = weights.size() > 0 ? weights[i] : 1;
  return Vec4(w * points(i, 0), w * points(i, 1), w * points(i, 2), w);
}

// Checks `count` control points and their weights; drops weights that are all alike. name: "control_points".
void check_control_points(const Points& points, Eigen::VectorXd& weights, Eigen::Index count);

// Row d of a table of binomial coefficients: binomial(d, k).
double binomial(int d, int k);

}  // namespace sgrt
