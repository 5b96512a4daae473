// The symmetric objective: zero for any two points of one sphere or cylinder, so it converges where planes zigzag.
// Rusinkiewicz (2019) turns both sides by half; about the middle of the pair that is this Jacobian.
// docs/theory/icp.md section 3.
#include "registration/pass.hpp"
#include "registration/residual.hpp"

namespace sgrt {

Vec6 step_along_both_normals(const std::vector<ClosestPair>& pairs, double lever) {
  Sums sums;
  for (const ClosestPair& c : pairs) {
    const Vec3 sum = c.n + (c.n.dot(c.m) < 0 ? Vec3(-c.m) : c.m);
    const Vec3 a = sum.normalized();
    Vec6 J;
    J << (0.5 * (c.y + c.q)).cross(a), a;
    sums.A += c.w * J * J.transpose();
    sums.g += c.w * a.dot(c.y - c.q) * J;
  }
  return step_of(sums, lever);
}

}  // namespace sgrt
