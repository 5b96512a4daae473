// NURBS curves. The NURBS Book, A4.1 and A4.2.
#include "nurbs/curve.hpp"

#include <algorithm>

#include "core/error.hpp"
#include "nurbs/homogeneous.hpp"

namespace sgrt {

NurbsCurve make_nurbs_curve(NurbsCurve curve) {
  check_basis(curve.basis, static_cast<int>(std::min<Eigen::Index>(curve.points.rows(), kMaxKnots)), "knots");
  check_control_points(curve.points, curve.weights, curve.basis.size());
  return curve;
}

Vec3 evaluate(const NurbsCurve& curve, double u) {
  Vec3 point;
  derivatives(curve, u, 0, &point);
  return point;
}

void derivatives(const NurbsCurve& curve, double u, int order, Vec3* ders) {
  require(order >= 0 && order <= kMaxOrder, "order: expected 0 to 24");
  const int p = curve.basis.degree, k = find_span(curve.basis, u);
  double N[(kMaxOrder + 1) * (kMaxDegree + 1)];
  basis_derivatives(curve.basis, k, u, order, N);
  Vec4 A[kMaxOrder + 1];
  for (int d = 0; d <= order; ++d) {
    A[d].setZero();
    for (int a = 0; a <= p; ++a) A[d] += N[d * (p + 1) + a] * homogeneous(curve.points, curve.weights, k - p + a);
  }
  for (int d = 0; d <= order; ++d) {  // eq. 4.8
    ders[d] = A[d].head<3>();
    if (!curve.rational()) continue;
    for (int i = 1; i <= d; ++i) ders[d] -= binomial(d, i) * A[i][3] * ders[d - i];
    ders[d] /= A[0][3];
  }
}

}  // namespace sgrt
