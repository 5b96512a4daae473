// Derivatives of the projection by the lens, see rig/parameters.hpp. docs/theory/calibration.md eq. 1-3.
#include "rig/parameters.hpp"

#include <array>

namespace sgrt {
namespace {

constexpr std::array<const char*, kMaxLens + 6> kNames = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3",
                                                          "k4", "k5", "k6", "rx", "ry", "rz", "tx", "ty", "tz"};

// What (2) of docs/theory/rig.md needs at a point: powers of u = r^2, numerator, denominator, L and dL/du.
struct Radial {
  double u, u2, u3, denominator, value, slope;
};
Radial radial(const std::array<double, 8>& k, double u) {
  const double u2 = u * u, u3 = u2 * u;
  const double n = 1 + k[0] * u + k[1] * u2 + k[4] * u3, dn = k[0] + 2 * k[1] * u + 3 * k[4] * u2;
  const double d = 1 + k[5] * u + k[6] * u2 + k[7] * u3, dd = k[5] + 2 * k[6] * u + 3 * k[7] * u2;
  return {u, u2, u3, d, n / d, (dn - n / d * dd) / d};
}

}  // namespace

LensVector lens_of(const Camera& camera) {
  LensVector lens;
  lens << camera.fx, camera.fy, camera.cx, camera.cy,
      Eigen::Map<const Eigen::Matrix<double, 8, 1>>(&camera.distortion[0]);
  return lens;
}

void set_lens(const LensVector& lens, Camera& camera) {
  camera.fx = lens(0);
  camera.fy = lens(1);
  camera.cx = lens(2);
  camera.cy = lens(3);
  for (int i = 0; i < 8; ++i) camera.distortion[i] = i < camera.distortion_count ? lens(4 + i) : 0;
}

std::vector<std::string> parameter_names(const Camera& camera) {
  std::vector<std::string> names;
  for (int i = 0; i < kMaxLens + 6; ++i) {
    if (i < lens_count(camera) || i >= kMaxLens) names.push_back(camera.id + "." + kNames[i]);
  }
  return names;
}

bool project_with_lens(const Camera& camera, const Vec3& x_in_camera, Vec2& pixel, Mat23& by_point,
                       LensJacobian& by_lens) {
  if (!(x_in_camera.z() > 0)) return false;
  const double w = 1 / x_in_camera.z(), x = x_in_camera.x() * w, y = x_in_camera.y() * w;
  const double p1 = camera.distortion[2], p2 = camera.distortion[3];
  const Radial L = radial(camera.distortion, x * x + y * y);
  const double xx = L.u + 2 * x * x, yy = L.u + 2 * y * y, xy = 2 * x * y;
  const double xd = x * L.value + p1 * xy + p2 * xx, yd = y * L.value + p1 * yy + p2 * xy;
  const double a = L.value + 2 * L.slope * x * x + 2 * p1 * y + 6 * p2 * x;
  const double b = L.slope * xy + 2 * p1 * x + 2 * p2 * y;
  const double c = L.value + 2 * L.slope * y * y + 6 * p1 * y + 2 * p2 * x;
  if (!(L.denominator > 0 && a > 0 && a * c - b * b > 0)) return false;
  pixel = Vec2(camera.fx * xd + camera.cx, camera.fy * yd + camera.cy);
  const double fx = camera.fx * w, fy = camera.fy * w;
  by_point << fx * a, fx * b, -fx * (a * x + b * y), fy * b, fy * c, -fy * (b * x + c * y);
  const double n = 1 / L.denominator, q = -L.value / L.denominator;
  const double powers[] = {n * L.u, n * L.u2, n * L.u3, q * L.u, q * L.u2, q * L.u3};
  const int places[] = {4, 5, 8, 9, 10, 11};
  by_lens.setZero();
  by_lens(0, 0) = xd;
  by_lens(1, 1) = yd;
  by_lens(0, 2) = by_lens(1, 3) = 1;
  for (int i = 0; i < 6; ++i) by_lens.col(places[i]) << camera.fx * x * powers[i], camera.fy * y * powers[i];
  by_lens.col(6) << camera.fx * xy, camera.fy * yy;
  by_lens.col(7) << camera.fx * xx, camera.fy * xy;
  return true;
}

bool project_with_lens(const Camera& camera, const Vec3& x_in_camera, Vec2& pixel) {
  Mat23 by_point;
  LensJacobian by_lens;
  return project_with_lens(camera, x_in_camera, pixel, by_point, by_lens);
}

}  // namespace sgrt
