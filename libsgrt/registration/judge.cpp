// See registration/judge.hpp.
#include "registration/judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "registration/words.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;
constexpr double kWeakShare = 0.5;     // of the live points, or of the reference
constexpr double kWeakMisfit = 2;      // residuals this many times larger than the noise are not noise
constexpr double kNoMatch = 3;         // mm rms, and ...
constexpr double kNoMatchMisfit = 5;   // ... times the noise: no pose lays one on the other
constexpr double kWeakChange = 0.15;   // of the points that lie on the reference may not fit it
constexpr double kFarIsocentre = 500;  // mm beyond the surface
constexpr double kThousand = 150;      // lengths that differ by more than this factor differ in their unit
constexpr double kTinyBody = 1.5;      // mm rms: no patient, but one in metres
constexpr int kMacro = 2;              // levels up: cells that several live points hit

std::string percent(double share) {
  return std::to_string(std::lround(100 * share)) + " %";
}

std::string rounded(double mm) {
  return text_of(std::round(1000 * mm) / 1000);
}

// The share of the reference that inlier pairs cover, told by cells of a coarse level: a small reference laid on a
// large live surface overlaps wholly although few of the live points match.
double coverage(const SurfelField& field, Workspace& work) {
  const auto top = std::min<std::size_t>(kMacro, field.levels.size() - 1);
  std::vector<std::uint8_t>& covered = work.covered;
  covered.assign(field.levels[top].surfels.size(), 0);
  for (std::size_t i = 0; i < static_cast<std::size_t>(work.live.count); ++i) {
    const std::int32_t code = work.surfel[i];
    if (!(work.w[i] > 0) || code < 0) continue;
    std::size_t m = index_of(code);
    auto level = static_cast<std::size_t>(level_of(code));
    if (level > top) continue;
    for (; level < top; ++level) m = static_cast<std::size_t>(field.levels[level].parent[m]);
    covered[m] = 1;
  }
  double sum = 0, all = 0;
  for (std::size_t m = 1; m < covered.size(); ++m) {
    all += field.levels[top].samples[m];
    if (covered[m] != 0) sum += field.levels[top].samples[m];
  }
  return all > 0 ? sum / all : 0;
}

// How far the isocentre lies outside the box of the surface that counts, mm.
double lever_arm(const SurfelField& field, const Vec3& isocentre) {
  const Vec3 x = isocentre - field.centre;
  return (x - x.cwiseMax(field.box_min).cwiseMin(field.box_max)).norm();
}

// The share of the live points on the reference, within a cell of it, that do not fit it.
double changed_share(const SurfelField& field, const Workspace& work) {
  double on = 0, off = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(work.live.count); ++i) {
    const std::int32_t code = work.surfel[i];
    if (code < 0 || level_of(code) > 1 || !(work.r[i] == work.r[i]) || !(surfel_of(field, code).counts > 0)) continue;
    on += 1;
    off += work.w[i] > 0 ? 0 : 1;
  }
  return on > 0 ? off / on : 0;
}

// What speaks against trusting the pose; "" if nothing does.
std::string doubts(const Reference& reference, const Certificate& c, double overlap, const Workspace& work,
                   const Pose& start, const IcpResult& result, const IcpOptions& options) {
  std::string words;
  const auto add = [&](const std::string& text) { words += (words.empty() ? "" : "; ") + text; };
  const Direction& worst = c.directions.front();
  if (worst.sigma > options.weak_sigma) {
    add("sigma " + rounded(worst.sigma) + " mm where it " + words_of(worst.motion, result.isocentre));
  }
  if (c.chi2 > kWeakMisfit * kWeakMisfit && result.rms > options.weak_sigma) {
    add("residuals of " + rounded(result.rms) + " mm are " + rounded(std::sqrt(c.chi2)) + " times the expected noise");
  }
  if (overlap < kWeakShare) add("only " + percent(result.inlier_share) + " of the live points match");
  const double changed = changed_share(reference.field, work);
  if (changed > kWeakChange)
    add(percent(changed) + " of the points on the reference do not fit it: changed or mirrored?");
  // Steps see no farther than the pairs: an answer far from where they began is luck, or another body's.
  const Pose way = result.reference_from_live * start.inverse();
  const double mm = (way * reference.field.centre - reference.field.centre).norm();
  const double deg = so3_log(way.R).norm() * 180 / kPi;
  if (!options.anywhere && (mm > 2 * options.max_distance || deg > options.max_angle_deg)) {
    add("found " + std::to_string(std::lround(mm)) + " mm and " + std::to_string(std::lround(deg)) +
        " deg from the start, beyond its reach");
  }
  const double arm = lever_arm(reference.field, result.isocentre);
  if (arm > kFarIsocentre) {
    add("the isocentre lies " + std::to_string(std::lround(arm)) + " mm from the surface: 0.1 deg there is " +
        rounded(arm * 0.1 * kPi / 180) + " mm");
  }
  return words;
}

void fill_maps(const Search& s, const Workspace& work, IcpResult& result) {
  const bool pose = s.converged;
  for (std::size_t i = 0; i < static_cast<std::size_t>(work.live.count); ++i) {
    const auto row = static_cast<std::size_t>(work.live.row[i]);
    if (work.w[i] > 0) result.inlier[row] = 1;
    if (pose) result.distance[static_cast<Eigen::Index>(row)] = static_cast<double>(work.r[i]);
  }
}

}  // namespace

void give_up(IcpResult& result, Status status, const std::string& message) {
  result.status = status;
  result.message = result.verdict_words = message;
}

std::string words_of(const std::vector<FreeMotion>& free) {
  std::string words;
  for (const FreeMotion& f : free) words += (words.empty() ? "" : ", ") + f.words;
  return words;
}

void blank(const Surface& live, const Vec3& isocentre, Detail detail, IcpResult& r) {
  r.status = Status::kOk;
  r.message.clear();
  r.verdict = Verdict::kNone;
  r.verdict_words.clear();
  r.iterations = 0;
  r.pair_count = 0;
  r.reference_from_live = {Mat3::Constant(kNan), Vec3::Constant(kNan)};
  r.isocentre = isocentre;
  static_cast<SixDof&>(r.displacement) = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
  static_cast<SixDof&>(r.correction) = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
  r.covariance.setConstant(kNan);
  r.random = r.shared = r.covariance;
  r.free.clear();
  r.directions.clear();
  r.rms = r.inlier_share = r.chi2 = r.coarse_score = r.coarse_runner_up = kNan;
  r.live_height = live.height;
  r.live_width = live.width;
  const std::int64_t n = detail == Detail::kAll ? live.size() : 0;
  r.distance = Eigen::VectorXd::Constant(n, kNan);
  r.inlier.assign(static_cast<std::size_t>(n), 0);
}

IcpResult blank_result(const Surface& live, const Vec3& isocentre) {
  IcpResult r;
  blank(live, isocentre, Detail::kAll, r);
  return r;
}

std::string misfit_of_size(const Reference& reference, const LivePoints& live) {
  const double a = reference.field.lever, b = live.lever;
  const auto of = [](double mm) { return text_of(std::round(1e4 * mm) / 1e4) + " mm"; };
  if (a > kThousand * b && b > 0) {
    return "the live surface spreads by " + of(b) + ", the reference by " + of(a) +
           ", near a factor of 1,000: is the live one in metres?";
  }
  if (b > kThousand * a) {
    return "the reference spreads by " + of(a) + ", the live surface by " + of(b) +
           ", near a factor of 1,000: is the reference in metres?";
  }
  if (a < kTinyBody && b < kTinyBody) {
    return "both surfaces spread by less than " + of(kTinyBody) + ": are they in metres?";
  }
  return "";
}

void judge(const Reference& reference, const Search& s, const Certificate& c, const Pose& start,
           const IcpOptions& options, Workspace& work, IcpResult& result) {
  const Sums& sums = s.sums;
  result.iterations = s.iterations;
  result.pair_count = std::llround(sums.pairs);
  result.free = c.free;
  double candidates = static_cast<double>(work.live.count);
  if (reference.has_roi) {
    candidates = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(work.live.count); ++i) {
      if (work.surfel[i] >= 0) candidates += surfel_of(reference.field, work.surfel[i]).counts;
    }
  }
  result.inlier_share = sums.pairs / std::max(1.0, candidates);
  if (result.inlier_share > 1) result.inlier_share = 1;
  if (result.distance.size() > 0) fill_maps(s, work, result);
  const double overlap = std::max(result.inlier_share, coverage(reference.field, work));
  const bool unfinished = !s.converged && s.iterations >= options.max_iterations;
  if (overlap < options.min_inlier_share && !unfinished) {
    const bool inside_out = sums.flipped > sums.pairs && sums.flipped > 0.3 * candidates;
    return give_up(result, Status::kNotFound,
                   "the surfaces do not overlap: " + percent(result.inlier_share) +
                       " of the live points match, at least " + percent(options.min_inlier_share) + " are needed" +
                       (inside_out ? "; the normals point the other way: is one surface inside out?" : ""));
  }
  if (!c.free.empty()) {
    return give_up(result, Status::kDegenerate, "the surfaces leave free: " + words_of(c.free));
  }
  if (!s.converged) {
    return give_up(result, Status::kNotConverged, "still moving after " + std::to_string(s.iterations) + " iterations");
  }
  const double rms = std::sqrt(sums.square / sums.weight);
  if (rms > kNoMatch && c.chi2 > kNoMatchMisfit * kNoMatchMisfit) {
    return give_up(result, Status::kNotFound,
                   "the surfaces do not match: residuals of " + rounded(rms) + " mm rms, " +
                       rounded(std::sqrt(c.chi2)) + " times the expected noise");
  }
  result.reference_from_live = s.pose;
  result.displacement = displacement_of(s.pose, result.isocentre);
  result.correction = correction_of(s.pose, result.isocentre);
  result.covariance = c.covariance;
  result.random = c.random;
  result.shared = c.shared;
  result.directions.assign(c.directions.begin(), c.directions.end());
  result.chi2 = c.chi2;
  result.rms = rms;
  const std::string words = doubts(reference, c, overlap, work, start, result, options);
  result.verdict = words.empty() ? Verdict::kOk : Verdict::kWeak;
  result.verdict_words = words.empty() ? "ok" : "weak: " + words;
}

}  // namespace sgrt
