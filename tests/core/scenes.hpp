// Analytic surfaces and draws for the tests of surface and registration. Room axes, mm; the body lies face up.
#pragma once

#include <cmath>
#include <functional>

#include "core/geometry.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "expect.hpp"

namespace sgrt::test {

inline const Run kSilent;  // one thread, no callbacks

constexpr double kPi = 3.14159265358979323846;

// Standard normal (Box and Muller), the same on every machine.
inline double gauss(Draw& draw) {
  return std::sqrt(-2 * std::log(draw.uniform(0, 1) + 1e-300)) * std::cos(2 * kPi * draw.uniform(0, 1));
}
inline Vec3 gauss3(Draw& draw) {
  const double a = gauss(draw), b = gauss(draw);
  return {a, b, gauss(draw)};
}

// A point of a surface for (u, v) in the unit square.
using Shape = std::function<Vec3(double u, double v)>;

inline Vec3 torso(double u, double v) {
  const double a = kPi * (0.1 + 0.8 * u), y = -200 + 400 * v;
  Vec3 x((150 + 20 * std::sin(y / 120)) * std::cos(a), y, (100 + 15 * std::cos(y / 90)) * std::sin(a) - 100);
  const auto bump = [&](double cx, double cy, double size, double height) {
    x[2] += height * std::exp(-0.5 * (std::pow(x[0] - cx, 2) + std::pow(y - cy, 2)) / (size * size));
  };
  bump(60, 60, 45, 25);
  bump(-60, 60, 45, 22);
  bump(10, -100, 20, -6);
  return x;
}
inline Vec3 plane(double u, double v) {
  return {-150 + 300 * u, -200 + 400 * v, 20};
}
inline Vec3 cylinder(double u, double v) {  // its axis along Y through (0, ., -80)
  const double a = kPi * (0.1 + 0.8 * u);
  return {100 * std::cos(a), -200 + 400 * v, 100 * std::sin(a) - 80};
}
inline Vec3 sphere(double u, double v) {  // radius 100, centre (0, 0, -60)
  const double z = 0.1 + 0.9 * v, r = std::sqrt(1 - z * z), a = 2 * kPi * u;
  return {100 * r * std::cos(a), 100 * r * std::sin(a), 100 * z - 60};
}

// n random points of the shape with isotropic noise; sigma_mm is written where it is positive.
inline Surface sample(const Shape& shape, std::int64_t n, double sigma, Draw& draw) {
  Surface s;
  s.points.resize(n, 3);
  for (std::int64_t i = 0; i < n; ++i) {
    const double u = draw.uniform(0, 1), v = draw.uniform(0, 1);
    s.points.row(i) = (shape(u, v) + sigma * gauss3(draw)).transpose();
  }
  if (sigma > 0) s.sigma = Eigen::VectorXd::Constant(n, sigma);
  return s;
}

// A displacement by so many mm and degrees in random directions, about the isocentre.
inline Pose displacement(double mm, double deg, const Vec3& isocentre, Draw& draw) {
  const Vec3 t = mm * draw.direction();
  return about(Pose{so3_exp(deg * kPi / 180 * draw.direction()), t}, -isocentre);
}

}  // namespace sgrt::test
