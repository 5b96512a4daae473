// Observability and covariance. docs/theory/icp.md eq. 8-13.
#include "registration/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "registration/words.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kSlopeFloor = 1e-3;  // rad: less relief than this is none, however little the noise

Vec6 row_of(const Vec3& x, const Vec3& n) {
  Vec6 j;
  j << x.cross(n), n;
  return j;
}

Vec3 mode_at(const Points& mode, std::int64_t row) {
  return mode.row(row).transpose();
}

// Sums over the pairs about the pivot (eq. 8-11).
struct Information {
  Mat6 shape = Mat6::Zero();       // across the two normal estimates: what both surfaces agree on
  Mat6 false_part = Mat6::Zero();  // half the square of their difference: what noise and sampling add to a naive sum
  Mat6 score = Mat6::Zero();       // covariance of the gradient
  double weight = 0, u2 = 0;
  std::int64_t count = 0;
};

// Adds the reference's noise: all pairs of one reference point share it (eq. 10).
void add_shared_noise(const std::vector<Pair>& pairs, const Vec3& pivot, double correlation, Mat6& score) {
  std::vector<std::pair<std::int64_t, std::size_t>> order;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].weight > 0) order.emplace_back(pairs[i].reference, i);
  }
  std::sort(order.begin(), order.end());
  for (std::size_t a = 0; a < order.size();) {
    Vec6 sum = Vec6::Zero();
    double variance = 0;
    const std::int64_t reference = order[a].first;
    for (; a < order.size() && order[a].first == reference; ++a) {
      const Pair& p = pairs[order[a].second];
      sum += p.weight / p.variance() * row_of(p.y - pivot, p.n);
      variance = p.reference_variance;
    }
    score += correlation * variance * sum * sum.transpose();
  }
}

Information gather(const Problem& problem, const std::vector<Pair>& pairs, const Vec3& pivot) {
  Information s;
  for (const Pair& p : pairs) {
    if (!(p.weight > 0)) continue;
    const double w = p.weight / p.variance();
    const Vec6 j_reference = row_of(p.q - pivot, p.m), j_live = row_of(p.y - pivot, p.l), j = row_of(p.y - pivot, p.n);
    const Vec6 difference = j_reference - j_live;
    const Mat6 cross = j_reference * j_live.transpose();
    s.shape += 0.5 * w * (cross + cross.transpose());
    s.false_part += 0.5 * w * difference * difference.transpose();
    s.score += problem.live->correlation_points * w * w * p.live_variance * j * j.transpose();
    s.weight += p.weight;
    s.u2 += w * p.r * p.r;
    ++s.count;
  }
  add_shared_noise(pairs, pivot, problem.reference().correlation_points, s.score);
  return s;
}

// The motions, scaled and at the isocentre, whose shape information does not exceed what noise makes up (eq. 9).
Motions free_motions(const Information& s, double lever, const Mat6& iso_from_pivot) {
  Vec6 unit;
  unit << Vec3::Constant(1 / lever), Vec3::Ones();
  const auto U = unit.asDiagonal();
  const Mat6 shape = U * s.shape * U;
  Mat6 total = shape + U * s.false_part * U;
  const double sum = total.diagonal().tail<3>().sum();  // of the weights: normals are unit
  total.diagonal().array() += kSlopeFloor * kSlopeFloor * sum;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Mat6> eigen(shape, total);
  // The sum of the false part over neighbours that share noise is itself uncertain by about 6 / sqrt(count) of it: 3
  // sigma.
  const double margin = 18 / std::sqrt(static_cast<double>(s.count));
  const double threshold = (1 + margin) / (2 + margin);
  Motions free(6, 0);
  for (int i = 0; i < 6; ++i) {
    if (eigen.eigenvalues()[i] > threshold) continue;
    free.conservativeResize(6, free.cols() + 1);
    free.col(free.cols() - 1) = scaled(iso_from_pivot * (U * eigen.eigenvectors().col(i)).eval()).normalized();
  }
  return free;
}

// Each shared error mode is one draw: the pose error that it makes, as an outer product (eq. 13).
Mat6 mode_covariance(const Problem& problem, const std::vector<Pair>& pairs, const Pose& T, const Vec3& pivot,
                     const Mat6& inverse) {
  Mat6 sum = Mat6::Zero();
  const auto add = [&](const std::vector<Points>& modes, bool of_live) {
    for (const Points& mode : modes) {
      Vec6 g = Vec6::Zero();
      for (const Pair& p : pairs) {
        const Vec3 u = of_live ? Vec3(T.R * mode_at(mode, p.live)) : mode_at(mode, p.reference);
        if (p.weight > 0 && u.allFinite()) g += p.weight / p.variance() * p.n.dot(u) * row_of(p.y - pivot, p.n);
      }
      const Vec6 error = inverse * g;
      sum += error * error.transpose();
    }
  };
  add(problem.live->modes, true);
  add(problem.reference().modes, false);
  return sum;
}

}  // namespace

Certificate certify(const Problem& problem, const std::vector<Pair>& pairs, const Pose& reference_from_live,
                    const Vec3& isocentre, double degenerate_sigma) {
  const Vec3 pivot = problem.centre;
  const Information s = gather(problem, pairs, pivot);
  Certificate c;
  c.chi2 = s.u2 / s.weight * static_cast<double>(s.count) / std::max<double>(1, static_cast<double>(s.count - 6));
  c.covariance.setConstant(kNan);
  c.worst_sigma = kNan;
  const Mat6 iso_from_pivot = adjoint(Pose{Mat3::Identity(), pivot - isocentre});
  c.free = name_motions(free_motions(s, problem.lever, iso_from_pivot), isocentre);
  if (!c.free.empty()) return c;

  const Mat6 inverse = s.shape.ldlt().solve(Mat6::Identity());
  Mat6 covariance = inverse * s.score * inverse * std::max(1.0, c.chi2) +
                    mode_covariance(problem, pairs, reference_from_live, pivot, inverse);
  covariance = (iso_from_pivot * covariance * iso_from_pivot.transpose()).eval();
  Vec6 unit;
  unit << Vec3::Constant(kTurnLever), Vec3::Ones();
  const Mat6 in_mm = unit.asDiagonal() * (0.5 * (covariance + covariance.transpose())) * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(in_mm);
  Motions loose(6, 0);
  for (int i = 0; i < 6; ++i) {
    if (std::sqrt(std::max(0.0, eigen.eigenvalues()[i])) <= degenerate_sigma) continue;
    loose.conservativeResize(6, loose.cols() + 1);
    loose.col(loose.cols() - 1) = eigen.eigenvectors().col(i);
  }
  c.free = name_motions(loose, isocentre);
  if (!c.free.empty()) return c;
  c.covariance = 0.5 * (covariance + covariance.transpose());
  c.worst_sigma = std::sqrt(eigen.eigenvalues()[5]);
  Vec6 worst = eigen.eigenvectors().col(5);
  worst.head<3>() /= kTurnLever;
  c.worst_words = words_of(worst, isocentre);
  return c;
}

}  // namespace sgrt
