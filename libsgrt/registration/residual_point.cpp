// Point to closest point, the motion in closed form. docs/theory/icp.md section 3.
#include "registration/residual.hpp"

namespace sgrt {

Vec6 step_to_points(Residual residual, const std::vector<ClosestPair>& pairs) {
  const auto n = static_cast<Eigen::Index>(pairs.size());
  Points y(n, 3), q(n, 3);
  Eigen::VectorXd w(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const ClosestPair& c = pairs[static_cast<std::size_t>(i)];
    y.row(i) = c.y.transpose();
    q.row(i) = c.q.transpose();
    w[i] = c.w;
  }
  const Pose move = residual == Residual::kPointSvd ? rigid_fit_svd(y, q, w) : rigid_fit_quaternion(y, q, w);
  Vec6 twist;
  twist << so3_log(move.R), move.t;
  return twist;
}

}  // namespace sgrt
