// Triples, consensus, weighted Procrustes, verdict. docs/theory/coarse.md section 2.
#include "registration/landmark_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "registration/words.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kGate = 16.27;   // chi2 of three numbers that chance exceeds once in 1,000
constexpr double kFloor2 = 1e-4;  // mm2: no landmark is known better than 0.01 mm
constexpr double kApart2 = 9;     // two motions differ beyond three sigmas
constexpr int kRounds = 30;
constexpr double kRest = 1e-9;  // mm, or rad at 1 mm
using Mask = std::uint64_t;     // of pairs

struct Pair {
  std::int64_t i, j;  // rows of reference and live
};

struct Candidate {
  Pose pose;
  Mask mask = 0;
  int count = 0;
  double chi2 = 0;
  Mat6 information;  // at the isocentre
};

bool has(Mask mask, std::size_t k) {
  return (mask >> k & 1) != 0;
}

int size_of(Mask mask) {
  int n = 0;
  for (; mask != 0; mask &= mask - 1) ++n;
  return n;
}

class Consensus {
 public:
  Consensus(const LandmarkSet& reference, const LandmarkSet& live, const Vec3& isocentre, std::vector<Pair> pairs)
      : reference_(reference), live_(live), isocentre_(isocentre), pairs_(std::move(pairs)) {}

  // Every triple of pairs whose distances agree; what each leads to, once.
  void propose(const Run& run) {
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

  bool on_a_line() const { return line_ && !triple_; }
  const std::map<Mask, Candidate>& found() const { return found_; }
  const std::vector<Pair>& pairs() const { return pairs_; }

  Vec3 error(const Pose& T, std::size_t k) const {
    return reference_.position.row(pairs_[k].i).transpose() - T * Vec3(live_.position.row(pairs_[k].j).transpose());
  }
  double chi2(const Pose& T, std::size_t k) const {
    const Vec3 e = error(T, k);
    return e.dot(noise(T, k).ldlt().solve(e));
  }

 private:
  const Mat3& reference_noise(std::size_t k) const {
    return reference_.covariance[static_cast<std::size_t>(pairs_[k].i)];
  }
  const Mat3& live_noise(std::size_t k) const { return live_.covariance[static_cast<std::size_t>(pairs_[k].j)]; }
  Mat3 noise(const Pose& T, std::size_t k) const {
    return reference_noise(k) + T.R * live_noise(k) * T.R.transpose() + kFloor2 * Mat3::Identity();
  }

  // A rigid motion keeps the distance of two landmarks, but for their noise.
  bool as_far(std::size_t a, std::size_t b) const {
    const Pair &p = pairs_[a], &q = pairs_[b];
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
  void climb(const std::array<std::size_t, 3>& triple) {
    Points p(3, 3), q(3, 3);
    for (Eigen::Index k = 0; k < 3; ++k) {
      p.row(k) = live_.position.row(pairs_[triple[static_cast<std::size_t>(k)]].j);
      q.row(k) = reference_.position.row(pairs_[triple[static_cast<std::size_t>(k)]].i);
    }
    Candidate c;
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
  Mask agreeing(const Pose& T, double gate) const {
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
  bool fit(Candidate& c) const {
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

  const LandmarkSet &reference_, &live_;
  Vec3 isocentre_;
  std::vector<Pair> pairs_;
  std::map<Mask, Candidate> found_;
  bool triple_ = false, line_ = false;
};

bool better(const Candidate& a, const Candidate& b) {
  return a.count != b.count ? a.count > b.count : a.chi2 < b.chi2;
}

// Another motion than the best: some of its pairs are not the best one's, and it differs beyond what noise explains.
bool rivals(const Candidate& best, const Candidate& other, const Vec3& isocentre) {
  if ((other.mask & ~best.mask) == 0) return false;
  const Vec6 d = se3_log(about(other.pose * best.pose.inverse(), isocentre));
  const Mat6 covariance =
      best.information.ldlt().solve(Mat6::Identity()) + other.information.ldlt().solve(Mat6::Identity());
  return d.dot(covariance.ldlt().solve(d)) > kApart2;
}

void check(const LandmarkSet& l, const char* name) {
  if (!l.position.allFinite()) fail(Status::kInvalidArgument, std::string(name) + ": a position is not finite");
  for (std::size_t k = 0; k < l.covariance.size(); ++k) {
    const Mat3& C = l.covariance[k];
    const bool sound = C.allFinite() && (C - C.transpose()).norm() <= 1e-6 * C.norm() &&
                       Eigen::SelfAdjointEigenSolver<Mat3>(C).eigenvalues()[0] >= -1e-9 * C.norm();
    if (!sound) {
      fail(Status::kInvalidArgument, std::string(name) + "_covariance_mm2[" + std::to_string(k) +
                                         "] is not a covariance: expected finite, symmetric, not negative");
    }
  }
}

LandmarkSet with_covariance(LandmarkSet l, double sigma) {
  if (l.covariance.empty()) {
    l.covariance.assign(static_cast<std::size_t>(l.size()), sigma * sigma * Mat3::Identity());
  }
  return l;
}

std::vector<Pair> pairs_of(const LandmarkSet& reference, const LandmarkSet& live) {
  std::vector<Pair> out;
  for (std::int64_t i = 0; i < reference.size(); ++i) {
    for (std::int64_t j = 0; j < live.size(); ++j) {
      if (reference.id[static_cast<std::size_t>(i)] == live.id[static_cast<std::size_t>(j)]) out.push_back({i, j});
    }
  }
  return out;
}

std::int64_t common_ids(const LandmarkSet& live, const std::vector<Pair>& pairs) {
  std::vector<std::int32_t> ids;
  ids.reserve(pairs.size());
  for (const Pair& p : pairs) ids.push_back(live.id[static_cast<std::size_t>(p.j)]);
  std::sort(ids.begin(), ids.end());
  return std::unique(ids.begin(), ids.end()) - ids.begin();
}

std::string share_text(std::int64_t some, std::int64_t all) {
  return std::to_string(some) + " of " + std::to_string(all) + " landmarks";
}

void give_up(LandmarkFit& out, Status status, const std::string& message) {
  out.status = status;
  out.message = out.verdict_words = message;
}

LandmarkFit blank(const LandmarkSet& live, const Vec3& isocentre) {
  LandmarkFit out;
  out.reference_from_live = {Mat3::Constant(kNan), Vec3::Constant(kNan)};
  out.isocentre = isocentre;
  static_cast<SixDof&>(out.displacement) = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
  static_cast<SixDof&>(out.correction) = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
  out.covariance.setConstant(kNan);
  out.rms = out.chi2 = kNan;
  out.distance = Eigen::VectorXd::Constant(live.size(), kNan);
  out.inlier.assign(static_cast<std::size_t>(live.size()), 0);
  return out;
}

// One sigma of the motion that is least certain, turns at kTurnLever, and its words.
std::pair<double, std::string> worst_of(const Mat6& information, const Vec3& isocentre) {
  Vec6 unit;
  unit << Vec3::Constant(1 / kTurnLever), Vec3::Ones();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(unit.asDiagonal() * information * unit.asDiagonal());
  const double least = eigen.eigenvalues()[0];
  const Vec6 motion = unit.asDiagonal() * eigen.eigenvectors().col(0);
  return {least > 0 ? 1 / std::sqrt(least) : std::numeric_limits<double>::infinity(), words_of(motion, isocentre)};
}

void report(const Consensus& consensus, const Candidate& best, LandmarkFit& out) {
  out.reference_from_live = best.pose;
  out.displacement = displacement_of(best.pose, out.isocentre);
  out.correction = correction_of(best.pose, out.isocentre);
  out.chi2 = best.chi2 / std::max(1, 3 * best.count - 6);
  const Mat6 covariance = std::max(1.0, out.chi2) * best.information.ldlt().solve(Mat6::Identity());
  out.covariance = 0.5 * (covariance + covariance.transpose());
  double sum = 0;
  for (std::size_t k = 0; k < consensus.pairs().size(); ++k) {
    const std::int64_t j = consensus.pairs()[k].j;
    const double d = consensus.error(best.pose, k).norm();
    if (!(d >= out.distance[j])) out.distance[j] = d;
    if (!has(best.mask, k)) continue;
    out.inlier[static_cast<std::size_t>(j)] = 1;
    sum += d * d;
  }
  out.rms = std::sqrt(sum / best.count);
}

void judge(const Consensus& consensus, const LandmarkOptions& o, LandmarkFit& out) {
  const Candidate* best = nullptr;
  for (const auto& [mask, c] : consensus.found()) {
    if (best == nullptr || better(c, *best)) best = &c;
  }
  if (best == nullptr) {
    if (!consensus.on_a_line()) return give_up(out, Status::kNotFound, "no three landmarks agree on a motion");
    return give_up(out, Status::kDegenerate, "the landmarks that agree lie on a line, about which they turn freely");
  }
  out.used = best->count;
  for (const auto& [mask, c] : consensus.found()) {
    if (rivals(*best, c, out.isocentre)) out.runner_up = std::max<std::int64_t>(out.runner_up, c.count);
  }
  if (static_cast<double>(out.used) < o.min_share * static_cast<double>(out.common)) {
    return give_up(out, Status::kNotFound,
                   share_text(out.used, out.common) + " agree on a motion, at least a share of " +
                       text_of(o.min_share) + " is needed");
  }
  if (out.runner_up >= out.used) {
    return give_up(out, Status::kDegenerate,
                   "two motions explain " + share_text(out.used, out.common) + " each: which is right is not told");
  }
  const auto [sigma, words] = worst_of(best->information, out.isocentre);
  if (!(sigma <= o.degenerate_sigma)) return give_up(out, Status::kDegenerate, "the landmarks leave free: " + words);
  report(consensus, *best, out);
  std::string doubt;
  const auto add = [&](const std::string& text) { doubt += (doubt.empty() ? "" : "; ") + text; };
  if (out.used == 3) add("only three landmarks agree, which nothing checks");
  if (out.used < out.common - 1 && 2 * out.runner_up > out.used) {
    add(std::to_string(out.runner_up) + " agree on another motion");
  }
  if (sigma > o.weak_sigma) add("sigma " + text_of(std::round(100 * sigma) / 100) + " mm where it " + words);
  out.verdict = doubt.empty() ? Verdict::kOk : Verdict::kWeak;
  out.verdict_words = doubt.empty() ? "ok" : "weak: " + doubt;
}

}  // namespace

LandmarkFit fit_landmarks(const Run& run, const LandmarkSet& reference, const LandmarkSet& live, const Vec3& isocentre,
                          const LandmarkOptions& o) {
  require(isocentre.allFinite(), "isocentre_mm is not finite");
  check(reference, "reference");
  check(live, "live");
  LandmarkFit out = blank(live, isocentre);
  std::vector<Pair> pairs = pairs_of(reference, live);
  out.common = common_ids(live, pairs);
  if (static_cast<std::int64_t>(pairs.size()) > kMaxLandmarkPairs) {
    fail(Status::kLimit, std::to_string(pairs.size()) + " pairs of landmarks of one id, expected at most " +
                             std::to_string(kMaxLandmarkPairs));
  }
  if (out.common < 3) {
    give_up(out, Status::kInsufficientData,
            std::to_string(out.common) + " landmarks are on both sides, at least 3 are needed");
    return out;
  }
  const LandmarkSet a = with_covariance(reference, o.sigma), b = with_covariance(live, o.sigma);
  Consensus consensus(a, b, isocentre, std::move(pairs));
  consensus.propose(run);
  judge(consensus, o, out);
  return out;
}

}  // namespace sgrt
