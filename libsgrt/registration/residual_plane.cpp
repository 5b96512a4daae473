// Point to plane. docs/theory/icp.md section 3.
#include "registration/pass.hpp"
#include "registration/residual.hpp"

namespace sgrt {

Vec6 step_along_normals(const std::vector<ClosestPair>& pairs, double lever) {
  Sums sums;
  for (const ClosestPair& c : pairs) {
    Vec6 J;
    J << c.y.cross(c.n), c.n;
    sums.A += c.w * J * J.transpose();
    sums.g += c.w * c.r * J;
  }
  return step_of(sums, lever);
}

Vec6 step_of(Residual residual, const std::vector<ClosestPair>& pairs, double lever) {
  switch (residual) {
    case Residual::kPlane:
      return step_along_normals(pairs, lever);
    case Residual::kSymmetric:
      return step_along_both_normals(pairs, lever);
    default:
      return step_to_points(residual, pairs);
  }
}

}  // namespace sgrt
