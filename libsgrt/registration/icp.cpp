// Fine registration: prepare, search, certify, judge. docs/theory/icp.md.
#include "registration/icp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "registration/certificate.hpp"
#include "registration/problem.hpp"
#include "registration/search.hpp"
#include "surface/distance.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kWeakShare = 0.5;  // of the live points, or of the reference
constexpr double kWeakMisfit = 3;   // residuals this many times larger than the noise are not noise

void check(const Vec3& isocentre, const IcpOptions& o) {
  const auto positive = [](double v, const char* name) {
    if (!(v > 0 && std::isfinite(v))) {
      fail(Status::kInvalidArgument, std::string(name) + " is " + text_of(v) + ", expected a positive number");
    }
  };
  require(isocentre.allFinite(), "isocentre_mm is not finite");
  if (o.max_iterations < 1) {
    fail(Status::kInvalidArgument, "max_iterations is " + std::to_string(o.max_iterations) + ", expected at least 1");
  }
  positive(o.max_distance, "max_distance_mm");
  positive(o.step_tolerance, "step_tolerance_mm");
  positive(o.weak_sigma, "weak_sigma_mm");
  positive(o.degenerate_sigma, "degenerate_sigma_mm");
  if (!(o.max_angle_deg > 0 && o.max_angle_deg <= 90)) {
    fail(Status::kInvalidArgument, "max_angle_deg is " + text_of(o.max_angle_deg) + ", expected above 0, to 90");
  }
  if (!(o.min_inlier_share >= 0 && o.min_inlier_share <= 1)) {
    fail(Status::kInvalidArgument, "min_inlier_share is " + text_of(o.min_inlier_share) + ", expected 0 to 1");
  }
}

// Live points whose closest reference point, however far, lies in the ROI.
std::int64_t count_candidates(const Run& run, const Problem& problem, const Pose& pose) {
  const auto rows = static_cast<std::int64_t>(problem.rows.size());
  if (problem.in_roi.empty()) return rows;
  return parallel_sum(run, rows, 1024, std::int64_t{0}, [&](std::int64_t begin, std::int64_t end) {
    std::int64_t count = 0;
    for (std::int64_t i = begin; i < end; ++i) {
      const Vec3 y = pose * problem.live->point(problem.rows[static_cast<std::size_t>(i)]);
      const auto hit = problem.field.nearest.nearest(y, std::numeric_limits<double>::infinity());
      count += hit.index >= 0 && problem.counts(hit.index);
    }
    return count;
  });
}

// The share of the reference points that count which an inlier pair or one beside them covers: a small reference laid
// on a large live surface overlaps wholly although few of the live points match.
double coverage(const Problem& problem, const std::vector<Pair>& pairs) {
  std::vector<bool> covered(static_cast<std::size_t>(problem.reference().size()), false);
  for (const Pair& p : pairs) {
    if (!(p.weight > 0)) continue;
    covered[static_cast<std::size_t>(p.reference)] = true;
    for (const std::int32_t i : problem.field.ring.row(p.reference)) {
      if (i >= 0) covered[static_cast<std::size_t>(i)] = true;
    }
  }
  std::int64_t count = 0;
  for (std::int64_t i = 0; i < problem.reference().size(); ++i) {
    count += covered[static_cast<std::size_t>(i)] && problem.counts(i);
  }
  return static_cast<double>(count) / static_cast<double>(problem.reference_count);
}

std::string percent(double share) {
  return std::to_string(std::lround(100 * share)) + " %";
}

std::string rounded(double mm) {
  return text_of(std::round(1000 * mm) / 1000);
}

void give_up(IcpResult& result, Status status, const std::string& message) {
  result.status = status;
  result.message = result.verdict_words = message;
}

std::string join(const std::vector<FreeMotion>& free) {
  std::string words;
  for (const FreeMotion& f : free) words += (words.empty() ? "" : ", ") + f.words;
  return words;
}

// What speaks against trusting the pose; "" if nothing does.
std::string doubts(const Certificate& c, double overlap, const IcpResult& result, const IcpOptions& options) {
  std::string words;
  const auto add = [&](const std::string& text) { words += (words.empty() ? "" : "; ") + text; };
  if (c.worst_sigma > options.weak_sigma) add("sigma " + rounded(c.worst_sigma) + " mm where it " + c.worst_words);
  if (c.chi2 > kWeakMisfit * kWeakMisfit && result.rms > options.weak_sigma) {
    add("residuals of " + rounded(result.rms) + " mm are " + rounded(std::sqrt(c.chi2)) + " times the expected noise");
  }
  if (overlap < kWeakShare) add("only " + percent(result.inlier_share) + " of the live points match");
  return words;
}

double rms_of(const std::vector<Pair>& pairs) {
  double sum = 0, weight = 0;
  for (const Pair& p : pairs) {
    sum += p.weight * p.r * p.r;
    weight += p.weight;
  }
  return std::sqrt(sum / weight);
}

void solve(const Run& run, const Problem& problem, const Pose& initial, const IcpOptions& options, IcpResult& result) {
  const Search s = search(run, problem, initial, options);
  result.iterations = s.iterations;
  for (const Pair& p : s.pairs) {
    if (!(p.weight > 0)) continue;
    ++result.pair_count;
    result.inlier[static_cast<std::size_t>(p.live)] = 1;
  }
  const std::int64_t candidates = count_candidates(run, problem, s.pose);
  result.inlier_share =
      static_cast<double>(result.pair_count) / static_cast<double>(std::max<std::int64_t>(1, candidates));
  const double overlap = std::max(result.inlier_share, coverage(problem, s.pairs));
  if (overlap < options.min_inlier_share) {
    return give_up(result, Status::kNotFound,
                   "the surfaces do not overlap: " + percent(result.inlier_share) +
                       " of the live points match, at least " + percent(options.min_inlier_share) + " are needed");
  }
  if (result.pair_count < kMinPairs) {
    return give_up(result, Status::kInsufficientData,
                   std::to_string(result.pair_count) + " pairs, at least 6 are needed");
  }
  const Certificate c = certify(problem, s.pairs, s.pose, result.isocentre, options.degenerate_sigma);
  result.free = c.free;
  if (!c.free.empty()) {
    return give_up(result, Status::kDegenerate, "the surfaces leave free: " + join(c.free));
  }
  if (!s.converged) {
    return give_up(result, Status::kNotConverged, "still moving after " + std::to_string(s.iterations) + " iterations");
  }
  result.reference_from_live = s.pose;
  result.displacement = displacement_of(s.pose, result.isocentre);
  result.correction = correction_of(s.pose, result.isocentre);
  result.covariance = c.covariance;
  result.rms = rms_of(s.pairs);
  result.distance = signed_distance(run, problem.field, *problem.live, s.pose, options.max_distance);
  const std::string words = doubts(c, overlap, result, options);
  result.verdict = words.empty() ? Verdict::kOk : Verdict::kWeak;
  result.verdict_words = words.empty() ? "ok" : "weak: " + words;
}

// All NaN: no number stands for "in place" unless it was found.
IcpResult blank(const Surface& live, const Vec3& isocentre) {
  IcpResult r;
  r.reference_from_live = {Mat3::Constant(kNan), Vec3::Constant(kNan)};
  r.isocentre = isocentre;
  static_cast<SixDof&>(r.displacement) = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
  static_cast<SixDof&>(r.correction) = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
  r.covariance.setConstant(kNan);
  r.rms = r.inlier_share = kNan;
  r.live_height = live.height;
  r.live_width = live.width;
  r.distance = Eigen::VectorXd::Constant(live.size(), kNan);
  r.inlier.assign(static_cast<std::size_t>(live.size()), 0);
  return r;
}

}  // namespace

IcpResult align(const Run& run, const Reference& reference, const Surface& live, const Vec3& isocentre,
                const Pose& initial_reference_from_live, const IcpOptions& options) {
  const Roi* roi = reference.roi ? &*reference.roi : nullptr;
  return align(run, reference.surface, live, isocentre, roi, initial_reference_from_live, options);
}

IcpResult align(const Run& run, const Surface& reference, const Surface& live, const Vec3& isocentre, const Roi* roi,
                const Pose& initial_reference_from_live, const IcpOptions& options) {
  check(isocentre, options);
  require(initial_reference_from_live.R.allFinite() && initial_reference_from_live.t.allFinite(),
          "initial_reference_from_live is not finite");
  IcpResult result = blank(live, isocentre);
  try {
    const Problem problem(run, reference, live, roi);
    solve(run, problem, initial_reference_from_live, options, result);
  } catch (const Error& e) {
    const auto status = static_cast<int>(e.status());
    if (status < 10 || status > 19) throw;
    give_up(result, e.status(), e.what());
  }
  return result;
}

}  // namespace sgrt
