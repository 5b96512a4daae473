// Surfaces of known curvature.
#pragma once

#include <cmath>

#include "core/surface.hpp"
#include "expect.hpp"

namespace sgrt::test {

inline double normal_draw(Draw& draw) {
  double s = 0;
  for (int j = 0; j < 12; ++j) s += draw.uniform(-0.5, 0.5);
  return s;
}

// A sphere's points, evenly spread (Fibonacci), with outward normals.
inline Surface sphere_cloud(double radius, double spacing) {
  const int n = static_cast<int>(4 * 3.14159265358979 * radius * radius / (spacing * spacing));
  Surface s;
  s.points.resize(n, 3);
  s.normals.resize(n, 3);
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2 * i + 1.0) / n, turn = 2.399963229728653 * i, rho = std::sqrt(1 - z * z);
    s.normals.row(i) << rho * std::cos(turn), rho * std::sin(turn), z;
    s.points.row(i) = radius * s.normals.row(i);
  }
  return s;
}

// z = 8 cos(x / 15) cos(y / 20) on a grid, as mesh, grid or cloud.
struct Wave {
  Surface surface;
  Eigen::VectorXd mean, gauss;
};

inline Wave wave(int side, double spacing, bool mesh, bool grid) {
  Wave w;
  Surface& s = w.surface;
  const int n = side * side;
  s.points.resize(n, 3);
  s.normals.resize(n, 3);
  w.mean.resize(n);
  w.gauss.resize(n);
  for (int i = 0; i < n; ++i) {
    const double x = spacing * (i % side - side / 2), y = spacing * (i / side - side / 2);
    const double cx = std::cos(x / 15), sx = std::sin(x / 15), cy = std::cos(y / 20), sy = std::sin(y / 20);
    const double fx = -8 * sx * cy / 15, fy = -8 * cx * sy / 20, fxx = -8 * cx * cy / 225, fyy = -8 * cx * cy / 400,
                 fxy = 8 * sx * sy / 300, g = 1 + fx * fx + fy * fy;
    s.points.row(i) << x, y, 8 * cx * cy;
    s.normals.row(i) << -fx / std::sqrt(g), -fy / std::sqrt(g), 1 / std::sqrt(g);
    w.mean[i] = -((1 + fy * fy) * fxx - 2 * fx * fy * fxy + (1 + fx * fx) * fyy) / (2 * std::pow(g, 1.5));
    w.gauss[i] = (fxx * fyy - fxy * fxy) / (g * g);
  }
  if (grid) s.height = s.width = side;
  if (mesh) {
    s.faces.resize(2 * (side - 1) * (side - 1), 3);
    for (int i = 0, f = 0; i + 1 < side; ++i) {
      for (int j = 0; j + 1 < side; ++j) {
        const int a = i * side + j;
        s.faces.row(f++) << a, a + 1, a + side + 1;
        s.faces.row(f++) << a, a + side + 1, a + side;
      }
    }
  }
  return w;
}

}  // namespace sgrt::test
