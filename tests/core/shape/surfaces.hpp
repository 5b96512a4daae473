// Surfaces of known curvature.
#pragma once

#include <cmath>
#include <vector>

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

// A surface of revolution's points, evenly spread, with outward normals and mean curvature.
struct Known {
  Surface surface;
  Eigen::VectorXd mean;
};

// place(t, &rho, &z, &n_rho, &n_z, &mean) of the profile at t in [from, to].
template <class F>
Known revolved(F&& place, double from, double to, double spacing) {
  constexpr int kSteps = 4000;
  const double pi = 3.14159265358979323846;
  std::vector<double> area(kSteps + 1, 0);
  double rho = 0, z = 0, nr = 0, nz = 0, mean = 0, before_rho = 0, before_z = 0;
  const auto at = [&](double k) { place(from + (to - from) * k / kSteps, &rho, &z, &nr, &nz, &mean); };
  for (int k = 0; k <= kSteps; ++k) {
    before_rho = rho, before_z = z;
    at(k);
    if (k > 0)
      area[static_cast<std::size_t>(k)] =
          area[static_cast<std::size_t>(k) - 1] + pi * (rho + before_rho) * std::hypot(rho - before_rho, z - before_z);
  }
  const int n = static_cast<int>(area.back() / (spacing * spacing));
  Known out;
  out.surface.points.resize(n, 3);
  out.surface.normals.resize(n, 3);
  out.mean.resize(n);
  std::size_t k = 0;
  for (int i = 0; i < n; ++i) {
    const double wanted = (i + 0.5) / n * area.back(), turn = 2.399963229728653 * i;
    while (area[k + 1] < wanted) ++k;
    at(static_cast<double>(k) + (wanted - area[k]) / (area[k + 1] - area[k]));
    out.surface.points.row(i) << rho * std::cos(turn), rho * std::sin(turn), z;
    out.surface.normals.row(i) << nr * std::cos(turn), nr * std::sin(turn), nz;
    out.mean[i] = mean;
  }
  return out;
}

// Half axis a along z, b across.
inline Known ellipsoid_cloud(double a, double b, double spacing) {
  const auto place = [&](double t, double* rho, double* z, double* nr, double* nz, double* mean) {
    const double s = std::sin(t), c = std::cos(t), w = std::hypot(a * s, b * c);
    *rho = b * s, *z = a * c, *nr = a * s / w, *nz = b * c / w;
    *mean = 0.5 * (a * b / (w * w * w) + a / (b * w));
  };
  return revolved(place, 0, 3.14159265358979323846, spacing);
}

inline Known torus_cloud(double R, double r, double spacing) {
  const auto place = [&](double t, double* rho, double* z, double* nr, double* nz, double* mean) {
    const double s = std::sin(t), c = std::cos(t);
    *rho = R + r * c, *z = r * s, *nr = c, *nz = s;
    *mean = 0.5 * (1 / r + c / (R + r * c));
  };
  return revolved(place, 0, 2 * 3.14159265358979323846, spacing);
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
