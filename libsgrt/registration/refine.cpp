// Refinement with ceres::TinySolver. docs/theory/icp.md eq. 6-7.
#include "registration/refine.hpp"

#include <ceres/tiny_solver.h>

#include <cmath>

namespace sgrt {
namespace {

// d Exp(w) x / dw = -[Exp(w) x]_x Jl(w), Jl the left Jacobian of SO(3) (Sola 2018 eq. 145).
Mat3 left_jacobian(const Vec3& w) {
  const double a2 = w.squaredNorm(), a = std::sqrt(a2);
  const Mat3 W = skew(w);
  if (a < 1e-4) return Mat3::Identity() + 0.5 * W + W * W / 6;
  return Mat3::Identity() + (1 - std::cos(a)) / a2 * W + (a - std::sin(a)) / (a2 * a) * W * W;
}

}  // namespace

bool PlaneCost::operator()(const double* parameters, double* residuals, double* jacobian) const {
  const Vec3 w(parameters[0], parameters[1], parameters[2]), t(parameters[3], parameters[4], parameters[5]);
  const Mat3 R = so3_exp(w), Jl = left_jacobian(w);
  const std::size_t n = pairs_.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Pair& p = pairs_[i];
    const double scale = std::sqrt(p.weight / p.variance());
    const Vec3 x = R * (p.y - pivot_);
    residuals[i] = scale * p.n.dot(x + t + pivot_ - p.q);
    if (jacobian == nullptr) continue;
    const Vec3 dw = scale * (Jl.transpose() * x.cross(p.n));
    for (std::size_t k = 0; k < 3; ++k) {
      jacobian[k * n + i] = dw[static_cast<int>(k)];
      jacobian[(3 + k) * n + i] = scale * p.n[static_cast<int>(k)];
    }
  }
  return true;
}

Vec6 refine(const std::vector<Pair>& pairs, const Vec3& pivot) {
  const PlaneCost cost(pairs, pivot);
  ceres::TinySolver<PlaneCost> solver;
  solver.options.max_num_iterations = 10;
  // The cost is in sigmas squared. Its first step is already good to second order; do not spend more on it than counts.
  solver.options.function_tolerance = 1e-9;
  solver.options.parameter_tolerance = 1e-9;
  Vec6 twist = Vec6::Zero();
  solver.Solve(cost, &twist);
  return twist;
}

Pose motion_about(const Vec6& twist, const Vec3& pivot) {
  const Mat3 R = so3_exp(twist.head<3>());
  return {R, twist.tail<3>() + pivot - R * pivot};
}

}  // namespace sgrt
