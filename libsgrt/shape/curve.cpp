// Curves. docs/theory/curvature.md eq. 1-2.
#include "shape/curve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kHighest = 6, kMaxHalfWindow = 200;

// The samples of a window and the chord length from the middle one; false where one is absent or two coincide.
bool window_of(const Points& samples, std::int64_t i, int half, bool closed, Points& x, Eigen::VectorXd& t) {
  const std::int64_t n = samples.rows();
  std::int64_t first = i - half, last = i + half;
  if (!closed) {
    first = std::max<std::int64_t>(first, 0);
    last = std::min(last, n - 1);
  } else if (2 * half + 1 > n) {
    return false;
  }
  const auto count = static_cast<Eigen::Index>(last - first + 1);
  x.resize(count, 3);
  t.resize(count);
  for (std::int64_t k = first; k <= last; ++k) x.row(k - first) = samples.row(((k % n) + n) % n);
  if (!x.allFinite()) return false;
  t[0] = 0;
  for (Eigen::Index k = 1; k < count; ++k) {
    const double step = (x.row(k) - x.row(k - 1)).norm();
    if (!(step > 0)) return false;
    t[k] = t[k - 1] + step;
  }
  t.array() -= t[i - first];
  return true;
}

}  // namespace

CurvePoint curve_point(const Vec3& d1, const Vec3& d2, const Vec3& d3, const Vec3& plane) {
  const double speed2 = d1.squaredNorm();
  if (!(speed2 > 0)) return {kNan, kNan};
  const Vec3 cross = d1.cross(d2);
  CurvePoint out;
  out.curvature = cross.norm() / (speed2 * std::sqrt(speed2));
  if (!plane.isZero(0)) out.curvature = cross.dot(plane) / plane.norm() / (speed2 * std::sqrt(speed2));
  const double cross2 = cross.squaredNorm();
  // Straight to rounding: the plane of curvature, and so the torsion, is not defined.
  out.torsion = cross2 > 1e-26 * speed2 * d2.squaredNorm() && cross2 > 0 ? cross.dot(d3) / cross2 : kNan;
  return out;
}

std::vector<CurvePoint> curve_curvature(const NurbsCurve& curve, const double* u, std::int64_t n, const Vec3& plane) {
  std::vector<CurvePoint> out;
  out.reserve(static_cast<std::size_t>(n));
  Vec3 d[4];
  for (std::int64_t i = 0; i < n; ++i) {
    derivatives(curve, u[i], 3, d);
    out.push_back(curve_point(d[1], d[2], d[3], plane));
  }
  return out;
}

std::vector<CurvePoint> sampled_curvature(const Points& samples, int half_window, int degree, bool closed,
                                          const Vec3& plane, double sigma, double* sigma_curvature) {
  if (degree < 3 || degree > kHighest)
    fail(Status::kInvalidArgument, "degree: " + std::to_string(degree) + ", expected 3 to 6");
  if (half_window < (degree + 1) / 2 || half_window > kMaxHalfWindow)
    fail(Status::kInvalidArgument, "half_window: " + std::to_string(half_window) + ", expected " +
                                       std::to_string((degree + 1) / 2) + " to 200: fewer samples than unknowns");
  if (samples.rows() < degree + 1)
    fail(Status::kInsufficientData, "samples: " + std::to_string(samples.rows()) + " points, a polynomial of degree " +
                                        std::to_string(degree) + " needs " + std::to_string(degree + 1));
  std::vector<CurvePoint> out(static_cast<std::size_t>(samples.rows()), {kNan, kNan});
  if (sigma_curvature) std::fill_n(sigma_curvature, samples.rows(), kNan);
  for (std::int64_t i = 0; i < samples.rows(); ++i) {
    Points x;  // new ones each time: Eigen's resize frees twice where there is no memory
    Eigen::VectorXd t;
    if (!window_of(samples, i, half_window, closed, x, t) || t.size() < degree + 1) continue;
    const double scale = t.cwiseAbs().maxCoeff();
    Eigen::MatrixXd A(t.size(), degree + 1);
    A.col(0).setOnes();
    for (int k = 1; k <= degree; ++k) A.col(k) = A.col(k - 1).cwiseProduct(t / scale);
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A);
    if (qr.rank() < degree + 1) continue;
    const Vec3 middle = samples.row(i).transpose();
    const Eigen::MatrixXd c = qr.solve(Eigen::MatrixXd(x.rowwise() - middle.transpose()));
    const Vec3 d1 = c.row(1).transpose() / scale, d2 = 2 * c.row(2).transpose() / (scale * scale);
    const Vec3 d3 = 6 * c.row(3).transpose() / (scale * scale * scale);
    out[static_cast<std::size_t>(i)] = curve_point(d1, d2, d3, plane);
    if (!sigma_curvature) continue;
    // kappa is c'' across c' over |c'|^2: its noise is that of c'' across, and of the speed.
    const Eigen::MatrixXd inverse = (A.transpose() * A).inverse();
    const double speed2 = d1.squaredNorm(), kappa = out[static_cast<std::size_t>(i)].curvature;
    const double v11 = inverse(1, 1) / (scale * scale), v22 = 4 * inverse(2, 2) / std::pow(scale, 4);
    sigma_curvature[i] = sigma * std::sqrt(v22 / (speed2 * speed2) + 4 * kappa * kappa * v11 / speed2);
  }
  return out;
}

}  // namespace sgrt
