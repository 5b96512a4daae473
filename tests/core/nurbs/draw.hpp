// Random curves and surfaces, and an independent evaluation in long double: de Boor's triangle on homogeneous points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "expect.hpp"
#include "nurbs/curve.hpp"
#include "nurbs/surface.hpp"

namespace sgrt::test {

// Knots with random gaps, some of them multiple; clamped or not.
inline SplineBasis draw_basis(Draw& draw, int degree, int count, bool clamped, int most_multiple = 3) {
  SplineBasis basis{degree, {}};
  double u = draw.uniform(-2, 2);
  std::vector<double> inner;
  const int wanted = count - degree - 1;
  while (static_cast<int>(inner.size()) < wanted) {
    u += draw.uniform(0.05, 1);
    const int times = 1 + static_cast<int>(draw.bits() % static_cast<unsigned>(std::min(degree, most_multiple)));
    for (int i = 0; i < times && static_cast<int>(inner.size()) < wanted; ++i) inner.push_back(u);
  }
  const double first = (wanted > 0 ? inner.front() : u) - draw.uniform(0.1, 1), last = u + draw.uniform(0.1, 1);
  double low = first, high = last;
  for (int i = 0; i <= degree; ++i) {
    basis.knots.insert(basis.knots.begin(), low);
    if (!clamped) low -= draw.uniform(0.05, 1);
  }
  basis.knots.insert(basis.knots.end(), inner.begin(), inner.end());
  for (int i = 0; i <= degree; ++i) {
    basis.knots.push_back(high);
    if (!clamped) high += draw.uniform(0.05, 1);
  }
  return basis;
}

inline Eigen::VectorXd draw_weights(Draw& draw, Eigen::Index n) {
  Eigen::VectorXd w(n);
  for (Eigen::Index i = 0; i < n; ++i) w[i] = std::pow(10.0, draw.uniform(-1, 1));
  return w;
}

inline Points draw_points(Draw& draw, Eigen::Index n, double scale = 100) {
  Points p(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) p.row(i) = draw.vec3(scale).transpose();
  return p;
}

inline NurbsCurve draw_curve(Draw& draw, int degree, int count, bool clamped, bool rational) {
  NurbsCurve c{draw_basis(draw, degree, count, clamped), draw_points(draw, count), {}};
  if (rational) c.weights = draw_weights(draw, count);
  return make_nurbs_curve(c);
}

inline NurbsSurface draw_surface(Draw& draw, int p, int q, int nu, int nv, bool clamped, bool rational) {
  NurbsSurface s{{draw_basis(draw, p, nu, clamped), draw_basis(draw, q, nv, clamped)}, draw_points(draw, nu * nv), {}};
  if (rational) s.weights = draw_weights(draw, nu * nv);
  return make_nurbs_surface(s);
}

inline double draw_parameter(Draw& draw, const SplineBasis& basis) {
  const double u = basis.begin() + (basis.end() - basis.begin()) * draw.uniform(0, 1);
  return std::clamp(u, basis.begin(), basis.end());
}

using Long = long double;
using Long4 = std::array<Long, 4>;

// De Boor: points d_{k-p} ... d_k pulled together p times. Finds its span by looking at every knot.
inline Long4 de_boor(const SplineBasis& basis, const std::vector<Long4>& control, Long u) {
  const int p = basis.degree, n = basis.size();
  int k = p;
  for (int i = p; i < n; ++i) {
    if (basis.knots[i] <= u && basis.knots[i] < basis.knots[i + 1]) k = i;
  }
  std::vector<Long4> d(control.begin() + (k - p), control.begin() + k + 1);
  for (int r = 1; r <= p; ++r) {
    for (int j = p; j >= r; --j) {
      const Long low = basis.knots[j + k - p], high = basis.knots[j + 1 + k - r];
      const Long a = (u - low) / (high - low);
      for (int c = 0; c < 4; ++c) d[j][c] = (1 - a) * d[j - 1][c] + a * d[j][c];
    }
  }
  return d[p];
}

inline Long4 lift(const Points& p, const Eigen::VectorXd& w, Eigen::Index i) {
  const Long weight = w.size() > 0 ? w[i] : 1;
  return {weight * p(i, 0), weight * p(i, 1), weight * p(i, 2), weight};
}

inline std::array<Long, 3> truth(const NurbsCurve& c, Long u) {
  std::vector<Long4> control;
  for (Eigen::Index i = 0; i < c.points.rows(); ++i) control.push_back(lift(c.points, c.weights, i));
  const Long4 h = de_boor(c.basis, control, u);
  return {h[0] / h[3], h[1] / h[3], h[2] / h[3]};
}

inline std::array<Long, 3> truth(const NurbsSurface& s, Long u, Long v) {
  std::vector<Long4> along;
  for (int i = 0; i < s.nu(); ++i) {
    std::vector<Long4> row;
    for (int j = 0; j < s.nv(); ++j) row.push_back(lift(s.points, s.weights, Eigen::Index{i} * s.nv() + j));
    along.push_back(de_boor(s.basis[1], row, v));
  }
  const Long4 h = de_boor(s.basis[0], along, u);
  return {h[0] / h[3], h[1] / h[3], h[2] / h[3]};
}

inline Vec3 vec3_of(const std::array<Long, 3>& x) {
  return Vec3(static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2]));
}

}  // namespace sgrt::test
