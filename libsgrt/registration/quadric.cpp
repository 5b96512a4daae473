// Weighted least squares in a frame that is turned until its axis is the normal. docs/theory/icp.md eq. 3-4.
#include "registration/quadric.hpp"

#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kPlaneSamples = 5, kQuadricSamples = 9;
constexpr double kTilt = 0.02;  // the frame is turned again while it leans by more

struct Sample {
  Vec3 x;  // from p, in radii
  double w;
};

// The axis of least spread; zero where the samples fix no plane.
Vec3 least_spread(const std::vector<Sample>& samples) {
  Vec3 mean = Vec3::Zero();
  double sum = 0;
  for (const Sample& s : samples) {
    mean += s.w * s.x;
    sum += s.w;
  }
  mean /= sum;
  Mat3 scatter = Mat3::Zero();
  for (const Sample& s : samples) scatter.noalias() += s.w * (s.x - mean) * (s.x - mean).transpose();
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(scatter / sum);
  const Vec3& e = eigen.eigenvalues();
  // A line has no normal, nor has a ball of noise.
  if (!(e[1] > 1e-4 * e[2]) || !(e[1] > 3 * e[0])) return Vec3::Zero();
  return eigen.eigenvectors().col(0);
}

Vec6 monomials(double u, double v) {
  Vec6 m;
  m << 1, u, v, 0.5 * u * u, u * v, 0.5 * v * v;
  return m;
}

struct Solution {
  Vec6 a = Vec6::Zero();
  Mat6 inverse = Mat6::Zero();
  bool quadric = false, plane = false;
};

// h(u, v) = a . monomials in the frame (e1, e2, n); a plane where the samples fix no more.
Solution solve(const std::vector<Sample>& samples, const Vec3& e1, const Vec3& e2, const Vec3& n) {
  Mat6 M = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  for (const Sample& s : samples) {
    const Vec6 m = monomials(e1.dot(s.x), e2.dot(s.x));
    const Vec6 wm = s.w * m;
    M.noalias() += wm * m.transpose();
    g += wm * n.dot(s.x);
  }
  Solution out;
  if (samples.size() >= static_cast<std::size_t>(kQuadricSamples)) {
    const Eigen::LDLT<Mat6> ldlt(M);
    const Vec6 pivots = ldlt.vectorD();
    if (pivots.minCoeff() > 1e-5 * pivots.maxCoeff()) {
      out.inverse = ldlt.solve(Mat6::Identity());
      out.a = out.inverse * g;
      out.quadric = out.plane = true;
      return out;
    }
  }
  const Eigen::LDLT<Mat3> ldlt(Mat3(M.topLeftCorner<3, 3>()));
  if (!(Vec3(ldlt.vectorD()).minCoeff() > 1e-4 * M(0, 0))) return out;
  out.inverse.topLeftCorner<3, 3>() = ldlt.solve(Mat3::Identity());
  out.a.head<3>() = out.inverse.topLeftCorner<3, 3>() * g.head<3>();
  out.plane = true;
  return out;
}

// What unit noise of the samples becomes, and their own scatter.
void spread(const std::vector<Sample>& samples, const Solution& s, const Vec3& e1, const Vec3& e2, const Vec3& n,
            double radius, Quadric& out) {
  double height = 0, slope = 0, squares = 0, degrees = 0;
  for (const Sample& sample : samples) {
    const Vec6 m = monomials(e1.dot(sample.x), e2.dot(sample.x));
    const Vec6 z = sample.w * (s.inverse * m);
    height += z[0] * z[0];
    slope += z[1] * z[1] + z[2] * z[2];
    const double e = n.dot(sample.x) - s.a.dot(m);
    squares += sample.w * e * e;
    degrees += sample.w * (1 - z.dot(m));
  }
  out.height = height;
  out.slope = 0.5 * slope / (radius * radius);
  const bool enough = static_cast<int>(samples.size()) > (s.quadric ? 7 : 4);
  out.residual = enough && degrees > 0 ? squares / degrees * radius * radius : kNan;
}

}  // namespace

Quadric fit_quadric(const Points& points, const std::vector<std::int32_t>& rows, const Vec3& p, double radius,
                    const Vec3& hint) {
  Quadric out;
  out.residual = kNan;
  std::vector<Sample> samples;
  samples.reserve(rows.size());
  for (const std::int32_t row : rows) {
    const Vec3 x = (points.row(row).transpose() - p) / radius;
    const double fall = 1 - x.squaredNorm();
    if (fall > 0) samples.push_back({x, fall * fall});
  }
  Vec3 n = static_cast<int>(samples.size()) >= kPlaneSamples ? least_spread(samples) : Vec3::Zero();
  if (n.isZero()) {
    if (hint.isZero() || samples.empty()) return out;
    return {true, p, hint, Mat3::Zero(), 1, 0, kNan};
  }
  Vec3 e1, e2;
  Solution s;
  for (int turn = 0; turn < 3; ++turn) {
    e1 = n.unitOrthogonal();
    e2 = n.cross(e1);
    s = solve(samples, e1, e2, n);
    if (!s.plane || !(std::hypot(s.a[1], s.a[2]) < 1)) return out;  // no smooth sheet
    if (turn == 2 || std::hypot(s.a[1], s.a[2]) < kTilt) break;
    n = (n - s.a[1] * e1 - s.a[2] * e2).normalized();
  }
  spread(samples, s, e1, e2, n, radius, out);
  out.found = true;
  out.q = p + radius * s.a[0] * n;
  out.n = (n - s.a[1] * e1 - s.a[2] * e2).normalized();
  const Mat3 K = s.a[3] * e1 * e1.transpose() + s.a[4] * (e1 * e2.transpose() + e2 * e1.transpose()) +
                 s.a[5] * e2 * e2.transpose();
  const Mat3 P = Mat3::Identity() - out.n * out.n.transpose();
  out.K = P * K * P / radius;
  return out;
}

}  // namespace sgrt
