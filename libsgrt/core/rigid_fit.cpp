// The least-squares rigid fit of point pairs, two ways from the same moments: singular values of the correlation matrix
// (Arun, Huang, Blostein 1987, with the sign of Umeyama 1991 against reflections) and the largest eigenvector of Horn's
// 4 x 4 matrix (Horn 1987). docs/theory/geometry.md.
#include <cmath>

#include "core/error.hpp"
#include "core/geometry.hpp"

namespace sgrt {
namespace {

// A cloud thinner than 1e-6 of its length leaves the turn about its axis free; its smaller singular values, which are
// areas, are then below 1e-12 of the largest.
constexpr double kThin = 1e-12;

struct Moments {
  Vec3 p, q;  // weighted centroids
  Mat3 H;     // sum w (p - pbar) (q - qbar)^T, scaled so that no entry exceeds 1
};

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kInvalidArgument, message);
}

void check(const Points& p, const Points& q, const Eigen::VectorXd& w) {
  const auto expected = [&](const char* what, Eigen::Index got) {
    return std::string(what) + std::to_string(p.rows()) + ", got " + std::to_string(got);
  };
  if (q.rows() != p.rows()) refuse(expected("q: expected as many points as p, ", q.rows()));
  if (w.size() != 0 && w.size() != p.rows()) refuse(expected("weights: expected one a pair, ", w.size()));
  for (Eigen::Index i = 0; i < p.rows(); ++i) {
    const auto at = [&](const char* name) { return name + ("[" + std::to_string(i) + "]"); };
    if (!p.row(i).allFinite()) refuse(at("p") + ": expected finite coordinates");
    if (!q.row(i).allFinite()) refuse(at("q") + ": expected finite coordinates");
    if (w.size() != 0 && !(w(i) >= 0 && std::isfinite(w(i)))) {
      refuse(at("weights") + ": expected a finite number >= 0, got " + text_of(w(i)));
    }
  }
}

Moments moments(const Points& p, const Points& q, const Eigen::VectorXd& w) {
  check(p, q, w);
  const Eigen::Index n = p.rows();
  const auto weight = [&](Eigen::Index i) { return w.size() ? w(i) : 1.0; };
  Eigen::Index count = 0;
  double total = 0;
  Moments m{Vec3::Zero(), Vec3::Zero(), Mat3::Zero()};
  for (Eigen::Index i = 0; i < n; ++i) {
    count += weight(i) > 0;
    total += weight(i);
    m.p += weight(i) * p.row(i).transpose();
    m.q += weight(i) * q.row(i).transpose();
  }
  if (count < 3)
    fail(Status::kInsufficientData, "expected at least 3 pairs of weight > 0, got " + std::to_string(count));
  m.p /= total;
  m.q /= total;
  double spread_p = 0, spread_q = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 a = p.row(i).transpose() - m.p, b = q.row(i).transpose() - m.q;
    spread_p += weight(i) * a.squaredNorm();
    spread_q += weight(i) * b.squaredNorm();
    m.H += weight(i) * a * b.transpose();
  }
  // Coincident points: what is left of their spread is rounding.
  const double limit_p = kThin * p.cwiseAbs().maxCoeff(), limit_q = kThin * q.cwiseAbs().maxCoeff();
  if (!(spread_p > total * limit_p * limit_p && spread_q > total * limit_q * limit_q)) {
    fail(Status::kDegenerate, "the points coincide: every turn is free");
  }
  m.H /= std::sqrt(spread_p) * std::sqrt(spread_q);
  return m;
}

// freedom: s2 + s3 with the sign of det H, half the gap of Horn's two largest eigenvalues; 0 where a turn is free.
void require_fixed(double freedom) {
  if (!(freedom > kThin)) fail(Status::kDegenerate, "the points lie on a line: the turn about it is free");
}

Pose pose_of(const Mat3& R, const Moments& m) {
  return {R, m.q - R * m.p};
}

}  // namespace

Pose rigid_fit_svd(const Points& p, const Points& q, const Eigen::VectorXd& weights) {
  const Moments m = moments(p, q, weights);
  const Eigen::JacobiSVD<Mat3> svd(m.H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec3& s = svd.singularValues();
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1;
  require_fixed(s(1) + sign * s(2));
  return pose_of(svd.matrixV() * Vec3(1, 1, sign).asDiagonal() * svd.matrixU().transpose(), m);
}

Pose rigid_fit_quaternion(const Points& p, const Points& q, const Eigen::VectorXd& weights) {
  const Moments m = moments(p, q, weights);
  const Mat3& H = m.H;
  const Vec3 delta(H(1, 2) - H(2, 1), H(2, 0) - H(0, 2), H(0, 1) - H(1, 0));
  Mat4 N;
  N(0, 0) = H.trace();
  N.block<1, 3>(0, 1) = delta.transpose();
  N.block<3, 1>(1, 0) = delta;
  N.block<3, 3>(1, 1) = H + H.transpose() - H.trace() * Mat3::Identity();
  const Eigen::SelfAdjointEigenSolver<Mat4> eigen(N);
  require_fixed((eigen.eigenvalues()(3) - eigen.eigenvalues()(2)) / 2);
  const Eigen::Vector4d v = eigen.eigenvectors().col(3);
  return pose_of(Eigen::Quaterniond(v(0), v(1), v(2), v(3)).normalized().toRotationMatrix(), m);
}

}  // namespace sgrt
