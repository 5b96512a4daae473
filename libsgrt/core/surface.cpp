// Surfaces: what is accepted, and normals that follow from the way a surface is given. See core/surface.hpp.
#include "core/surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kInvalidArgument, message);
}

// "points[7]", or "points[1, 3]" in a grid.
std::string place(const Surface& s, const std::string& name, std::int64_t i) {
  if (!s.organised()) return name + "[" + std::to_string(i) + "]";
  return name + "[" + std::to_string(i / s.width) + ", " + std::to_string(i % s.width) + "]";
}

template <class Row>
std::string text_of_row(const Row& row) {
  std::string text;
  for (Eigen::Index j = 0; j < row.size(); ++j) text += (j ? " " : "") + text_of(row(j));
  return text;
}

void check_rows(const Surface& s, const char* name, Eigen::Index rows) {
  if (rows != 0 && rows != s.size()) {
    refuse(std::string(name) + ": expected one a point, " + std::to_string(s.size()) + ", got " + std::to_string(rows));
  }
}

void check_shapes(const Surface& s) {
  if (s.height < 0 || s.width < 0 || (s.height == 0) != (s.width == 0))
    refuse("points: a grid of negative or half a size");
  if (s.size() == 0) fail(Status::kInsufficientData, "points: no point");
  if (s.size() > kMaxPoints) {
    fail(Status::kLimit,
         "points: expected at most " + std::to_string(kMaxPoints) + ", got " + std::to_string(s.size()));
  }
  if (s.organised() && (s.width > kMaxPoints || s.height > kMaxPoints || s.height * s.width != s.size())) {
    refuse("points: expected height * width of them, got " + std::to_string(s.size()));
  }
  check_rows(s, "normals", s.normals.rows());
  check_rows(s, "sigma_mm", s.sigma.size());
  check_rows(s, "covariance", s.covariance.rows());
  if (!s.mode_names.empty() && s.mode_names.size() != s.modes.size()) refuse("mode_names: expected one a mode");
  if (s.modes.size() > kMaxModes) refuse("modes: expected at most 8, got " + std::to_string(s.modes.size()));
  for (const Points& mode : s.modes) {
    if (mode.rows() != s.size())
      refuse("modes: expected " + std::to_string(s.size()) + " rows a mode, got " + std::to_string(mode.rows()));
  }
  if (s.organised() && s.faces.rows() > 0) refuse("faces: a grid has none, expected N x 3 points with them");
  if (!(s.correlation_points >= 1 && std::isfinite(s.correlation_points))) {
    refuse("correlation_points: expected a finite number >= 1, got " + text_of(s.correlation_points));
  }
}

// Returns the number of points present.
std::int64_t check_points(const Surface& s) {
  std::int64_t present = 0;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    const auto x = s.points.row(i);
    if (x.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxCoordinate) {
      ++present;
      continue;
    }
    if (s.organised() && std::isnan(x(0)) && std::isnan(x(1)) && std::isnan(x(2))) continue;
    refuse(place(s, "points", i) + ": expected |coordinate| <= 1e5 mm" +
           (s.organised() ? ", or NaN in all three where absent" : "") + ", got " + text_of_row(x));
  }
  return present;
}

void check_normals(const Surface& s) {
  constexpr double kTolerance = 1e-3;
  for (std::int64_t i = 0; i < s.normals.rows(); ++i) {
    const auto n = s.normals.row(i);
    if (!s.present(i) || std::abs(n.norm() - 1) <= kTolerance) continue;
    if (std::isnan(n(0)) && std::isnan(n(1)) && std::isnan(n(2))) continue;
    refuse(place(s, "normals", i) + ": expected a unit vector within 1e-3, or NaN in all three where unknown, got " +
           text_of_row(n));
  }
}

void check_sigma(const Surface& s) {
  for (std::int64_t i = 0; i < s.sigma.size(); ++i) {
    if (!s.present(i) || (s.sigma(i) > 0 && s.sigma(i) <= kMaxCoordinate)) continue;
    refuse(place(s, "sigma_mm", i) + ": expected > 0 and <= 1e5 mm, got " + text_of(s.sigma(i)));
  }
}

// All principal minors >= 0, within what float32 does to a matrix of rank one.
bool positive_semidefinite(double xx, double xy, double xz, double yy, double yz, double zz) {
  constexpr double kSlack = 1e-5;
  if (!(xx >= 0 && yy >= 0 && zz >= 0)) return false;
  if (!(xy * xy <= (1 + kSlack) * xx * yy && xz * xz <= (1 + kSlack) * xx * zz && yz * yz <= (1 + kSlack) * yy * zz))
    return false;
  const double det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  return det >= -kSlack * xx * yy * zz;
}

void check_covariance(const Surface& s) {
  for (std::int64_t i = 0; i < s.covariance.rows(); ++i) {
    if (!s.present(i)) continue;
    const auto c = s.covariance.row(i);
    if (!(c.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxCoordinate * kMaxCoordinate)) {
      refuse(place(s, "covariance", i) + ": expected |entry| <= 1e10 mm2, got " + text_of_row(c));
    }
    if (!positive_semidefinite(c(0), c(1), c(2), c(3), c(4), c(5))) {
      refuse(place(s, "covariance", i) + ": expected a positive semi-definite xx xy xz yy yz zz, got " +
             text_of_row(c));
    }
  }
}

void check_modes(const Surface& s) {
  for (std::size_t k = 0; k < s.modes.size(); ++k) {
    for (std::int64_t i = 0; i < s.size(); ++i) {
      const auto m = s.modes[k].row(i);
      if (!s.present(i) || m.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxCoordinate) continue;
      refuse(place(s, "modes[" + std::to_string(k) + "]", i) + ": expected |entry| <= 1e5 mm, got " + text_of_row(m));
    }
  }
}

void check_faces(const Surface& s) {
  for (Eigen::Index i = 0; i < s.faces.rows(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const std::int64_t vertex = s.faces(i, k);
      if (vertex >= 0 && vertex < s.size()) continue;
      refuse("faces[" + std::to_string(i) + ", " + std::to_string(k) + "]: expected 0 to " +
             std::to_string(s.size() - 1) + ", got " + std::to_string(vertex));
    }
  }
}

}  // namespace

double Surface::variance_along(std::int64_t i, const Vec3& n) const {
  if (covariance.rows() > 0) {
    const auto c = covariance.row(i);
    return c(0) * n.x() * n.x() + c(3) * n.y() * n.y() + c(5) * n.z() * n.z() +
           2 * (c(1) * n.x() * n.y() + c(2) * n.x() * n.z() + c(4) * n.y() * n.z());
  }
  return sigma.size() > 0 ? sigma(i) * sigma(i) : kNaN;
}

Surface make_surface(Surface s) {
  check_shapes(s);
  if (check_points(s) == 0) fail(Status::kInsufficientData, "points: no point, all are NaN");
  check_normals(s);
  check_sigma(s);
  check_covariance(s);
  check_modes(s);
  check_faces(s);
  if (s.faces.rows() > 0 && !s.has_normals()) s.normals = vertex_normals(s.points, s.faces);
  return s;
}

Mat3 unpacked(const Eigen::Ref<const Eigen::Matrix<double, 1, 6>>& c) {
  Mat3 C;
  C << c(0), c(1), c(2), c(1), c(3), c(4), c(2), c(4), c(5);
  return C;
}

Eigen::Matrix<double, 1, 6> packed(const Mat3& C) {
  Eigen::Matrix<double, 1, 6> c;
  c << C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2);
  return c;
}

Surface moved(Surface s, const Pose& pose) {
  const auto turn = [&](Points& vectors) {
    for (Eigen::Index i = 0; i < vectors.rows(); ++i) vectors.row(i) = (pose.R * vectors.row(i).transpose()).eval();
  };
  for (Eigen::Index i = 0; i < s.points.rows(); ++i) s.points.row(i) = (pose * s.point(i)).transpose();
  turn(s.normals);
  for (Points& mode : s.modes) turn(mode);
  for (Eigen::Index i = 0; i < s.covariance.rows(); ++i)
    s.covariance.row(i) = packed(pose.R * unpacked(s.covariance.row(i)) * pose.R.transpose());
  return s;
}

void set_variance_along(Surface& s, std::int64_t i, const Vec3& n, double variance) {
  const Mat3 C = unpacked(s.covariance.row(i));
  const double old = n.dot(C * n);
  if (!(old > 0)) return;
  const Mat3 p = Mat3::Identity() - (1 - std::sqrt(variance / old)) * n * n.transpose();
  s.covariance.row(i) = packed(p * C * p.transpose());
}

namespace {

// The rows to keep, moved to the front.
template <class Matrix>
void compress(Matrix& a, const std::vector<std::int64_t>& rows) {
  if (a.rows() == 0) return;
  for (std::size_t i = 0; i < rows.size(); ++i) a.row(static_cast<Eigen::Index>(i)) = a.row(rows[i]).eval();
  a.conservativeResize(static_cast<Eigen::Index>(rows.size()), a.cols());
}

void drop_rows(Surface& s, const std::vector<bool>& keep) {
  std::vector<std::int64_t> rows;
  std::vector<std::int32_t> renamed(keep.size(), -1);
  rows.reserve(keep.size());
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (!keep[i]) continue;
    renamed[i] = static_cast<std::int32_t>(rows.size());
    rows.push_back(static_cast<std::int64_t>(i));
  }
  compress(s.points, rows);
  compress(s.normals, rows);
  compress(s.sigma, rows);
  compress(s.covariance, rows);
  for (Points& mode : s.modes) compress(mode, rows);
  Eigen::Index left = 0;
  for (Eigen::Index f = 0; f < s.faces.rows(); ++f) {
    Eigen::Matrix<std::int32_t, 1, 3> face;
    for (int k = 0; k < 3; ++k) face(k) = renamed[static_cast<std::size_t>(s.faces(f, k))];
    if (face.minCoeff() >= 0) s.faces.row(left++) = face;
  }
  s.faces.conservativeResize(left, 3);
}

}  // namespace

Surface kept(Surface s, const std::vector<bool>& keep) {
  if (std::find(keep.begin(), keep.end(), true) == keep.end())
    fail(Status::kInsufficientData, "surface: no point is left");
  if (!s.organised()) {
    drop_rows(s, keep);
    return s;
  }
  const auto absent = [](auto& a, std::size_t i) {
    if (a.rows() > 0) a.row(static_cast<Eigen::Index>(i)).setConstant(kNaN);
  };
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i]) continue;
    absent(s.points, i);
    absent(s.normals, i);
    absent(s.sigma, i);
    absent(s.covariance, i);
    for (Points& mode : s.modes) absent(mode, i);
  }
  return s;
}

Points vertex_normals(const Points& points, const Faces& faces) {
  Points sum = Points::Zero(points.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Vec3 a = points.row(faces(f, 0)), b = points.row(faces(f, 1)), c = points.row(faces(f, 2));
    const Vec3 twice_area = (b - a).cross(c - a);
    for (int k = 0; k < 3; ++k) sum.row(faces(f, k)) += twice_area.transpose();
  }
  for (Eigen::Index i = 0; i < sum.rows(); ++i) {
    const double length = sum.row(i).norm();
    if (length > 0) {
      sum.row(i) /= length;
    } else {
      sum.row(i).setConstant(kNaN);
    }
  }
  return sum;
}

}  // namespace sgrt
