// Fundamental forms. docs/theory/curvature.md eq. 3-7.
#include "shape/forms.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;

}  // namespace

double shape_index(double k1, double k2) {
  return k1 == 0 && k2 == 0 ? kNan : 2 / kPi * std::atan2(k1 + k2, k1 - k2);
}

double curvedness(double k1, double k2) {
  return std::sqrt(0.5 * (k1 * k1 + k2 * k2));
}

Eigen::Matrix<double, 2, 3> tangent_plane(const Vec3& n) {
  const Vec3 e1 = n.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> axes;
  axes << e1.transpose(), n.cross(e1).transpose();
  return axes;
}

Curvature unknown_curvature() {
  const Vec3 none = Vec3::Constant(kNan);
  return {kNan, kNan, kNan, kNan, kNan, kNan, none, none, none};
}

Curvature curvature_of_tensor(double a, double b, double c, const Vec3& normal, const Vec3& e1, const Vec3& e2) {
  Curvature out;
  out.mean = 0.5 * (a + c);
  out.gauss = a * c - b * b;
  const double half = 0.5 * (a - c);
  const double difference = std::hypot(half, b);  // sqrt(H^2 - K), never of a negative number
  out.k1 = out.mean + difference;
  out.k2 = out.mean - difference;
  out.curvedness = curvedness(out.k1, out.k2);
  out.shape_index = shape_index(out.k1, out.k2);
  out.normal = normal;
  // The direction of k1: twice its angle is that of (half, b).
  double cosine = 1, sine = 0;
  if (difference > 0) {
    const double x = half / difference, y = b / difference;
    if (x >= 0) {
      cosine = std::sqrt(0.5 * (1 + x));
      sine = 0.5 * y / cosine;
    } else {
      sine = std::sqrt(0.5 * (1 - x));
      cosine = 0.5 * y / sine;
    }
  }
  out.d1 = cosine * e1 + sine * e2;
  out.d2 = normal.cross(out.d1);
  return out;
}

Curvature curvature_of_forms(const Vec3* d) {
  const Vec3 &su = d[0], &sv = d[1];
  const Vec3 cross = su.cross(sv);
  const double E = su.squaredNorm(), F = su.dot(sv), G = sv.squaredNorm();
  const double area2 = cross.squaredNorm();  // E G - F^2 without its cancellation
  if (!(area2 > 1e-24 * std::max(E, G) * std::max(E, G))) return unknown_curvature();
  const double area = std::sqrt(area2);
  const Vec3 n = cross / area;
  const double L = -n.dot(d[2]), M = -n.dot(d[3]), N = -n.dot(d[4]);
  // The tensor on e1 = S_u / |S_u|, e2 = n x e1, where S_v = (F / |S_u|) e1 + (area / |S_u|) e2.
  const double length = std::sqrt(E);
  const Vec3 e1 = su / length, e2 = n.cross(e1);
  const double a = L / E;
  const double b = (M - F / E * L) / area;
  const double c = (E * N - 2 * F * M + F * F / E * L) / area2;
  Curvature out = curvature_of_tensor(a, b, c, n, e1, e2);
  out.gauss = (L * N - M * M) / area2;
  return out;
}

HkClass hk_class(double mean, double gauss, double mean_zero, double gauss_zero) {
  if (!(mean == mean) || !(gauss == gauss) || !(mean_zero == mean_zero)) return HkClass::kUnknown;
  const int h = mean > mean_zero ? 1 : mean < -mean_zero ? -1 : 0;
  const int k = gauss > gauss_zero ? 1 : gauss < -gauss_zero ? -1 : 0;
  if (h == 0) return k < 0 ? HkClass::kMinimal : HkClass::kFlat;
  if (k > 0) return h > 0 ? HkClass::kPeak : HkClass::kPit;
  if (k < 0) return h > 0 ? HkClass::kSaddleRidge : HkClass::kSaddleValley;
  return h > 0 ? HkClass::kRidge : HkClass::kValley;
}

}  // namespace sgrt
