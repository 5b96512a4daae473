// Interpolation and least squares on rows of points; a surface is done direction by direction.
#include "nurbs/interpolate.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "nurbs/blossom.hpp"
#include "nurbs/net.hpp"

namespace sgrt {
namespace {

using Eigen::Index;

void check_points(const Points& points) {
  for (Index i = 0; i < points.rows(); ++i) {
    for (int c = 0; c < 3; ++c) {
      if (std::abs(points(i, c)) <= kMaxCoordinate) continue;
      fail(Status::kInvalidArgument,
           "points[" + std::to_string(i) + "]: " + text_of(points(i, c)) + ", expected a coordinate within 1e5 mm");
    }
  }
}

// A9.3: parameters of the rows of Q, where each row holds a point of every line; the mean over the lines that have a
// length.
std::vector<double> parameters_of(const Rows& Q, Parameters kind, const char* name) {
  const Index n = Q.rows();
  std::vector<double> t(static_cast<std::size_t>(n), 0);
  int lines = 0;
  for (Index line = 0; line < Q.cols(); line += 3) {
    std::vector<double> at(static_cast<std::size_t>(n), 0);
    for (Index i = 1; i < n; ++i) {
      const double chord = (Q.row(i).segment(line, 3) - Q.row(i - 1).segment(line, 3)).norm();
      const double step = kind == Parameters::kUniform ? 1 : kind == Parameters::kChord ? chord : std::sqrt(chord);
      at[static_cast<std::size_t>(i)] = at[static_cast<std::size_t>(i - 1)] + step;
    }
    if (!(at.back() > 0)) continue;
    ++lines;
    for (std::size_t i = 0; i < at.size(); ++i) t[i] += at[i] / at.back();
  }
  if (lines == 0) fail(Status::kDegenerate, std::string(name) + ": all points coincide");
  for (double& x : t) x /= lines;
  t.back() = 1;
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] > t[i - 1]) continue;
    fail(Status::kDegenerate, std::string(name) + ": points " + std::to_string(i - 1) + " and " + std::to_string(i) +
                                  " coincide; drop one, or use uniform parameters");
  }
  return t;
}

// Eq. 9.8 for as many control points as parameters, else eq. 9.68 and 9.69.
SplineBasis knots_for(const std::vector<double>& t, int degree, int count) {
  SplineBasis basis{degree, std::vector<double>(static_cast<std::size_t>(degree) + 1, 0)};
  const auto points = static_cast<int>(t.size());
  const double d = static_cast<double>(points) / (count - degree);
  for (int j = 1; j < count - degree; ++j) {
    if (count == points) {
      double sum = 0;
      for (int i = j; i < j + degree; ++i) sum += t[static_cast<std::size_t>(i)];
      basis.knots.push_back(sum / degree);
    } else {
      const auto i = static_cast<std::size_t>(j * d);
      const double a = j * d - static_cast<double>(i);
      basis.knots.push_back((1 - a) * t[i - 1] + a * t[i]);
    }
  }
  basis.knots.insert(basis.knots.end(), static_cast<std::size_t>(degree) + 1, 1);
  return basis;
}

Rows interpolate(const ChangeOfBasis& M, const Rows& Q) {
  const Index n = M.columns, p = M.entries.cols() - 1;
  Banded A(n, p, p);
  for (Index i = 0; i < n; ++i) {
    for (Index a = 0; a <= p; ++a) {
      const Index j = M.first[static_cast<std::size_t>(i)] + a;
      if (M.entries(i, a) != 0) A.at(i, j) = M.entries(i, a);
    }
  }
  if (!A.factor()) fail(Status::kDegenerate, "points: too close to each other to be interpolated");
  Rows x = Q;
  A.solve(x);
  Rows rest = Q - M * x;  // once refined
  A.solve(rest);
  return x + rest;
}

// One direction: its knots and the values of their basis functions at the data.
struct Direction {
  SplineBasis basis;
  ChangeOfBasis values;
};

Direction prepare(const Rows& Q, int degree, int count, Parameters kind, const char* name) {
  const Index n = Q.rows();
  if (degree < 1 || degree > kMaxDegree)
    fail(Status::kInvalidArgument, "degree: " + std::to_string(degree) + ", expected 1 to 24");
  if (count < degree + 1 || count > n) {
    fail(n < degree + 1 ? Status::kInsufficientData : Status::kInvalidArgument,
         std::string(name) + ": " + std::to_string(count) + " control points for " + std::to_string(n) +
             " points, expected " + std::to_string(degree + 1) + " (degree + 1) to as many as points");
  }
  const std::vector<double> t = parameters_of(Q, kind, name);
  Direction d{knots_for(t, degree, count), {{}, Rows(n, degree + 1), count}};
  check_basis(d.basis, count, "knots");
  for (Index i = 0; i < n; ++i) {
    const double u = t[static_cast<std::size_t>(i)];
    const int k = find_span(d.basis, u);
    d.values.first.push_back(k - degree);
    basis_functions(d.basis, k, u, d.values.entries.row(i).data());
  }
  return d;
}

Rows control_points(const Direction& d, const Rows& Q) {
  return d.values.columns == Q.rows() ? interpolate(d.values, Q) : least_squares(d.values, Q);
}

// A grid of points, n x m in rows, the other way round.
Rows transposed(const Rows& grid) {
  const Index n = grid.rows(), m = grid.cols() / 3;
  Rows out(m, 3 * n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < m; ++j) out.row(j).segment(3 * i, 3) = grid.row(i).segment(3 * j, 3);
  }
  return out;
}

}  // namespace

NurbsCurve fit_curve(const Points& points, int degree, int count, Parameters parameters) {
  check_points(points);
  const Direction u = prepare(points, degree, count, parameters, "points");
  return curve_of(Net{u.basis, control_points(u, points), 3});
}

NurbsSurface fit_grid(const Points& points, int nu, int nv, const int degree[2], const int count[2],
                      Parameters parameters) {
  if (points.rows() != Index{nu} * nv)
    fail(Status::kInvalidArgument, "points: " + std::to_string(points.rows()) + ", expected nu x nv");
  check_points(points);
  const Rows Q = Eigen::Map<const Rows>(points.data(), nu, 3 * Index{nv});
  const Direction u = prepare(Q, degree[0], count[0], parameters, "points along u");
  const Direction v = prepare(transposed(Q), degree[1], count[1], parameters, "points along v");
  const Net net{v.basis, control_points(v, transposed(control_points(u, Q))), 3};
  return surface_of(net, NurbsSurface{{u.basis, v.basis}, {}, {}}, 1);
}

}  // namespace sgrt
