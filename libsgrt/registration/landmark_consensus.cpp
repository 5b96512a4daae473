// Triples, agreement, weighted Procrustes. docs/theory/coarse.md section 2.
#include "registration/landmark_consensus.hpp"

#include <cmath>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kGate = 16.27;   // chi2 of three numbers that chance exceeds once in 1,000
constexpr double kFloor2 = 1e-4;  // mm2: no landmark is known better than 0.01 mm
constexpr int kRounds = 30;
constexpr double kRest = 1e-9;  // mm, or rad at 1 mm

int size_of(Mask mask) {
  int n = 0;
  for (; mask != 0; mask &= mask - 1) ++n;
  return n;
}

}  // namespace

// Every triple of pairs whose distances agree; what each leads to, once.
void LandmarkConsensus::propose(const Run& run) {
  const std::size_t n = pairs_.size();
  for (std::size_t a = 0; a < n; ++a) {
    run.poll(static_cast<double>(a) / static_cast<double>(n), "landmarks");
    for (std::size_t b = a + 1; b < n; ++b) {
      if (!as_far(a, b)) continue;
      for (std::size_t c = b + 1; c < n; ++c) {
        if (as_far(a, c) && as_far(b, c)) climb({a, b, c});
      }
    }
  }
}

Vec3 LandmarkConsensus::error(const Pose& T, std::size_t k) const {
  return reference_.position.row(pairs_[k].i).transpose() - T * Vec3(live_.position.row(pairs_[k].j).transpose());
}
double LandmarkConsensus::chi2(const Pose& T, std::size_t k) const {
  const Vec3 e = error(T, k);
  return e.dot(noise(T, k).ldlt().solve(e));
}

const Mat3& LandmarkConsensus::reference_noise(std::size_t k) const {
  return reference_.covariance[static_cast<std::size_t>(pairs_[k].i)];
}
const Mat3& LandmarkConsensus::live_noise(std::size_t k) const {
  return live_.covariance[static_cast<std::size_t>(pairs_[k].j)];
}
Mat3 LandmarkConsensus::noise(const Pose& T, std::size_t k) const {
  return reference_noise(k) + T.R * live_noise(k) * T.R.transpose() + kFloor2 * Mat3::Identity();
}

// A rigid motion keeps the distance of two landmarks, but for their noise.
bool LandmarkConsensus::as_far(std::size_t a, std::size_t b) const {
  const LandmarkPair &p = pairs_[a], &q = pairs_[b];
  if (p.i == q.i || p.j == q.j) return false;
  const Vec3 x = (reference_.position.row(p.i) - reference_.position.row(q.i)).transpose();
  const Vec3 y = (live_.position.row(p.j) - live_.position.row(q.j)).transpose();
  const double dx = x.norm(), dy = y.norm();
  const auto along = [](const Vec3& v, double d, const Mat3& A, const Mat3& B) {
    return d > 0 ? v.dot((A + B) * v) / (d * d) : (A + B).trace();
  };
  const double v =
      along(x, dx, reference_noise(a), reference_noise(b)) + along(y, dy, live_noise(a), live_noise(b)) + 2 * kFloor2;
  return (dx - dy) * (dx - dy) < kGate * v;
}

// From the motion of a triple to one whose pairs and fit agree with each other.
void LandmarkConsensus::climb(const std::array<std::size_t, 3>& triple) {
  Points p(3, 3), q(3, 3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    p.row(k) = live_.position.row(pairs_[triple[static_cast<std::size_t>(k)]].j);
    q.row(k) = reference_.position.row(pairs_[triple[static_cast<std::size_t>(k)]].i);
  }
  LandmarkMotion c;
  try {
    c.pose = rigid_fit_svd(p, q);
  } catch (const Error&) {
    line_ = true;
    return;
  }
  triple_ = true;
  c.mask = Mask{1} << triple[0] | Mask{1} << triple[1] | Mask{1} << triple[2];
  if (!fit(c)) return;
  for (int round = 0; round < 10; ++round) {
    const Mask before = c.mask;
    c.mask = agreeing(c.pose, round == 0 ? 4 * kGate : kGate);  // three landmarks fix the far ones badly
    if (size_of(c.mask) < 3 || found_.count(c.mask) > 0 || !fit(c)) return;
    if (c.mask == before) break;
  }
  if (agreeing(c.pose, kGate) != c.mask) return;
  c.count = size_of(c.mask);
  found_.emplace(c.mask, c);
}

// The pairs within the gate, each landmark once, with its best partner.
Mask LandmarkConsensus::agreeing(const Pose& T, double gate) const {
  std::vector<double> u(pairs_.size());
  Mask mask = 0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    u[k] = chi2(T, k);
    if (u[k] < gate) mask |= Mask{1} << k;
  }
  for (std::size_t k = 0; k < u.size(); ++k) {
    for (std::size_t l = 0; l < u.size() && has(mask, k); ++l) {
      if (l == k || !has(mask, l) || (pairs_[l].i != pairs_[k].i && pairs_[l].j != pairs_[k].j)) continue;
      if (u[l] < u[k] || (u[l] == u[k] && l < k)) mask &= ~(Mask{1} << k);
    }
  }
  return mask;
}

// Weighted Procrustes on the marked pairs: Gauss-Newton on e = q - T p with covariance C_q + R C_p R^T.
bool LandmarkConsensus::fit(LandmarkMotion& c) const {
  for (int round = 0; round < kRounds; ++round) {
    Vec6 g = Vec6::Zero();
    c.information.setZero();
    c.chi2 = 0;
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      if (!has(c.mask, k)) continue;
      const Vec3 e = error(c.pose, k);
      const Vec3 y = c.pose * Vec3(live_.position.row(pairs_[k].j).transpose()) - isocentre_;
      Eigen::Matrix<double, 3, 6> J;
      J << -skew(y), Mat3::Identity();
      const Mat3 W = noise(c.pose, k).inverse();
      c.information += J.transpose() * W * J;
      g += J.transpose() * W * e;
      c.chi2 += e.dot(W * e);
    }
    const Vec6 step = c.information.ldlt().solve(g);
    if (!step.allFinite()) return false;
    const Pose move = about(se3_exp(step), -isocentre_);
    c.pose = move * c.pose;
    if (step.norm() < kRest) return true;
  }
  return true;
}

}  // namespace sgrt
