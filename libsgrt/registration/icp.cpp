// Fine registration: prepare, search, certify, judge. docs/theory/icp.md.
#include "registration/icp.hpp"

#include <cmath>
#include <limits>

#include "registration/certificate.hpp"
#include "registration/classic.hpp"
#include "registration/coarse.hpp"
#include "registration/judge.hpp"
#include "registration/predict.hpp"
#include "registration/search.hpp"
#include "registration/words.hpp"

namespace sgrt {
namespace {

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
  if (!(o.keep_share > 0 && o.keep_share <= 1)) {
    fail(Status::kInvalidArgument, "keep_share is " + text_of(o.keep_share) + ", expected above 0, to 1");
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

// A pose with too few pairs, or none, to say anything more about.
bool too_few(const Search& s, IcpResult& result) {
  if (s.sums.pairs >= kMinPairs) return false;
  result.iterations = s.iterations;
  result.pair_count = std::llround(s.sums.pairs);
  result.inlier_share = 0;
  const bool inside_out = s.sums.flipped > 0.3 * s.sums.candidates && s.sums.flipped >= kMinPairs;
  give_up(result, Status::kNotFound,
          std::string("the surfaces do not overlap: fewer than 6 pairs") +
              (inside_out ? "; the normals point the other way: is one surface inside out?" : ""));
  return true;
}

void solve(const Run& run, const Reference& reference, const Surface& live, const Pose& initial, double start_error,
           const IcpOptions& options, Workspace& work, IcpResult& result) {
  read_live(live, work.live);
  if (work.live.count < kMinPairs) {
    return give_up(result, Status::kInsufficientData,
                   "the live surface has " + std::to_string(work.live.count) +
                       " usable points (present, with a normal), at least 6 are needed");
  }
  if (!(work.live.lever > 1e-9)) {
    return give_up(result, Status::kInsufficientData, "the live surface has one usable point: all coincide");
  }
  const std::string size = misfit_of_size(reference, work.live);
  if (!size.empty()) return give_up(result, Status::kNotFound, size);
  CoarseResult coarse;
  if (options.anywhere) {
    coarse = find_anywhere(run, reference, work.live);
    result.coarse_score = coarse.score;
    result.coarse_runner_up = coarse.runner_up_score;
    if (coarse.status == Status::kNotFound) return give_up(result, coarse.status, coarse.message);
  }
  const Pose& start = options.anywhere ? coarse.pose : initial;
  const Search s = is_classic(options)
                       ? classic_search(run, reference, live, start, options, work)
                       : search(run, reference, live, start, start_error, result.isocentre, options, work);
  if (too_few(s, result)) return;
  if (work.w.size() != work.live.x.size()) work.w.assign(work.live.x.size(), 0.0F);
  const Certificate c = certify(run, reference, live, s.pose, s.sums, result.isocentre, options, s.limit, work);
  judge(reference, s, c, start, options, work, result);
  // A free motion says more than that two poses fit alike.
  if (coarse.status == Status::kOk || result.status != Status::kOk) return;
  const int iterations = result.iterations;
  const double inlier_share = result.inlier_share;
  blank(live, result.isocentre, result.distance.size() > 0 ? Detail::kAll : Detail::kPose, result);
  result.coarse_score = coarse.score;
  result.coarse_runner_up = coarse.runner_up_score;
  result.iterations = iterations;
  result.inlier_share = inlier_share;
  give_up(result, coarse.status, coarse.message);
}

void name_directions(IcpResult& result) {
  for (Direction& d : result.directions) d.words = words_of(d.motion, result.isocentre);
}

}  // namespace

void align_into(const Run& run, const Reference& reference, const Surface& live, const Vec3& isocentre,
                const Pose& initial, double start_error, const IcpOptions& options, Detail detail, Workspace& work,
                IcpResult& result) {
  check(isocentre, options);
  require(initial.R.allFinite() && initial.t.allFinite(), "initial_reference_from_live is not finite");
  blank(live, isocentre, detail, result);
  solve(run, reference, live, initial, start_error, options, work, result);
  if (detail == Detail::kAll) name_directions(result);
}

IcpResult align(const Run& run, const Reference& reference, const Surface& live, const Vec3& isocentre,
                const Pose& initial_reference_from_live, const IcpOptions& options) {
  IcpResult result;
  Workspace work;
  align_into(run, reference, live, isocentre, initial_reference_from_live, std::numeric_limits<double>::infinity(),
             options, Detail::kAll, work, result);
  return result;
}

IcpResult promise_of(const Reference& reference, const Vec3& isocentre, double live_sigma) {
  IcpResult result = blank_result(Surface{}, isocentre);
  Workspace work;
  Certificate c =
      predict(reference, outlook_of(reference, nullptr, live_sigma, work), isocentre, IcpOptions{}.degenerate_sigma);
  result.free = std::move(c.free);
  if (!result.free.empty()) {
    give_up(result, Status::kDegenerate, "the reference leaves free: " + words_of(result.free));
    return result;
  }
  result.covariance = c.covariance;
  result.random = c.random;
  result.shared = c.shared;
  result.directions.assign(c.directions.begin(), c.directions.end());
  name_directions(result);
  return result;
}

IcpResult align(const Run& run, const Surface& reference, const Surface& live, const Vec3& isocentre, const Roi* roi,
                const Pose& initial_reference_from_live, const IcpOptions& options) {
  check(isocentre, options);
  std::shared_ptr<const Reference> prepared;
  try {
    prepared = prepare_reference(run, reference, roi);
  } catch (const Error& e) {
    const auto status = static_cast<int>(e.status());
    if (status < 10 || status > 19) throw;
    IcpResult result = blank_result(live, isocentre);
    give_up(result, e.status(), e.what());
    return result;
  }
  return align(run, *prepared, live, isocentre, initial_reference_from_live, options);
}

}  // namespace sgrt
