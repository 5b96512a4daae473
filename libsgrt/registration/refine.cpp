// Refinement with ceres::TinySolver. docs/theory/icp.md eq. 8-9.
#include "registration/refine.hpp"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>

namespace sgrt {
namespace {

// What TinySolver asks for: f + J x, x the twist at the isocentre.
struct Cost {
  typedef double Scalar;
  enum { NUM_RESIDUALS = 7, NUM_PARAMETERS = 6 };
  const SquareRoot& root;

  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    const Eigen::Map<const Vec6> x(parameters);
    Eigen::Map<Eigen::Matrix<double, 7, 1>>(residuals, 7, 1) = root.f + root.J * x;
    if (jacobian != nullptr) Eigen::Map<Eigen::Matrix<double, 7, 6>>(jacobian, 7, 6) = root.J;
    return true;
  }
};

}  // namespace

bool square_root(const Mat6& A, const Vec6& g, double cost, SquareRoot& root) {
  const Vec6 unit = A.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Mat6> llt(Mat6(unit.asDiagonal() * A * unit.asDiagonal()));
  if (llt.info() != Eigen::Success) return false;
  const Mat6 L = unit.cwiseInverse().asDiagonal() * Mat6(llt.matrixL());
  root.f.head<6>() = L.triangularView<Eigen::Lower>().solve(g);
  root.f[6] = std::sqrt(std::max(0.0, cost - root.f.head<6>().squaredNorm()));
  root.J.topRows<6>() = L.transpose();
  root.J.row(6).setZero();
  return root.f.allFinite() && root.J.allFinite();
}

Vec6 refine(const Sums& sums, const Vec3& centre, const Vec3& isocentre, double lever) {
  // A twist at the isocentre, seen about the centre; turns in units of 1 / lever, so that the six compare.
  Mat6 G = adjoint(Pose{Mat3::Identity(), isocentre - centre});
  G.leftCols<3>() /= lever;
  SquareRoot root;
  if (!square_root(G.transpose() * sums.A * G, G.transpose() * sums.g, sums.cost, root)) return step_of(sums, lever);
  const Cost cost{root};
  ceres::TinySolver<Cost> solver;
  solver.options.max_num_iterations = 10;
  solver.options.gradient_tolerance = 1e-6;  // the cost is in sigmas squared
  solver.options.function_tolerance = 1e-12;
  Vec6 twist = Vec6::Zero();
  solver.Solve(cost, &twist);
  const Vec6 step = G * twist;
  // A motion that the pairs hardly see is left to the step that leaves it out.
  const Vec6 safe = step_of(sums, lever);
  return step.norm() <= 2 * safe.norm() || safe.isZero() ? step : safe;
}

}  // namespace sgrt
