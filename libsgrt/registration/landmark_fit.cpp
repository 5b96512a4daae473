// Triples, consensus, weighted Procrustes, verdict. docs/theory/coarse.md section 2.
#include "registration/landmark_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/surface.hpp"
#include "core/within.hpp"
#include "registration/landmark_consensus.hpp"
#include "registration/words.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kApart2 = 9;  // two motions differ beyond three sigmas

bool better(const LandmarkMotion& a, const LandmarkMotion& b) {
  return a.count != b.count ? a.count > b.count : a.chi2 < b.chi2;
}

// Another motion than the best: some of its pairs are not the best one's, and it differs beyond what noise explains.
bool rivals(const LandmarkMotion& best, const LandmarkMotion& other, const Vec3& isocentre) {
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
    const bool sound = within(C, kMaxCoordinate * kMaxCoordinate) && (C - C.transpose()).norm() <= 1e-6 * C.norm() &&
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

std::vector<LandmarkPair> pairs_of(const LandmarkSet& reference, const LandmarkSet& live) {
  std::vector<LandmarkPair> out;
  for (std::int64_t i = 0; i < reference.size(); ++i) {
    for (std::int64_t j = 0; j < live.size(); ++j) {
      if (reference.id[static_cast<std::size_t>(i)] == live.id[static_cast<std::size_t>(j)]) out.push_back({i, j});
    }
  }
  return out;
}

std::int64_t common_ids(const LandmarkSet& live, const std::vector<LandmarkPair>& pairs) {
  std::vector<std::int32_t> ids;
  ids.reserve(pairs.size());
  for (const LandmarkPair& p : pairs) ids.push_back(live.id[static_cast<std::size_t>(p.j)]);
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
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(Mat6(unit.asDiagonal() * information * unit.asDiagonal()));
  const double least = eigen.eigenvalues()[0];
  const Vec6 motion = unit.asDiagonal() * eigen.eigenvectors().col(0);
  return {least > 0 ? 1 / std::sqrt(least) : std::numeric_limits<double>::infinity(), words_of(motion, isocentre)};
}

void report(const LandmarkConsensus& consensus, const LandmarkMotion& best, LandmarkFit& out) {
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

void judge(const LandmarkConsensus& consensus, const LandmarkOptions& o, LandmarkFit& out) {
  const LandmarkMotion* best = nullptr;
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
  std::vector<LandmarkPair> pairs = pairs_of(reference, live);
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
  LandmarkConsensus consensus(a, b, isocentre, std::move(pairs));
  consensus.propose(run);
  judge(consensus, o, out);
  return out;
}

}  // namespace sgrt
