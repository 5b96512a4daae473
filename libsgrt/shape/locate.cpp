// Scene, match, refinement, verdict. docs/theory/landmarks.md.
#include "shape/locate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "shape/constellation.hpp"
#include "shape/match_score.hpp"
#include "shape/patches.hpp"
#include "shape/scene.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kAmbiguous = 0.9;     // a runner-up so near the best
constexpr double kLeastEvidence = 40;  // nepers
constexpr double kClear = 4;           // nepers of evidence from the next pose
constexpr double kClearAlike = 7;      // the same from one that looks as well
constexpr double kAlike = 0.92;        // of the best score, of another pose that looks as well
constexpr double kShown = 0.75;        // share of the landmarks in view from which chance is no more a rival
constexpr double kChance = 0.2;        // what it takes off, with none in view
constexpr std::size_t kTried = 12;     // matches that are first held against the reference's skin
constexpr std::size_t kSparse = 5;     // first by every fifth of its points
constexpr double kSkinFits = 0.8;      // share of the skin about the landmarks that must fit
constexpr double kSame = 6;            // mm
constexpr double kMoved = 0.25;        // of the scale: how far noise and smoothing move an extremum
constexpr double kUsed = 0.1;          // value from which an extremum moves its landmark
constexpr std::size_t kSkinTried = 128;
constexpr double kLooks = 0.2;        // least cosine between the skin's normal and the landmark's
constexpr double kOffExtremum = 2.5;  // sigmas of its place: further away an extremum is another one

std::string rounded(double x) {
  return text_of(std::round(100 * x) / 100);
}

void not_found(LocatedLandmarks& out, const std::string& why) {
  out.status = Status::kNotFound;
  out.message = why;
  out.live_from_model = {Mat3::Constant(kNan), Vec3::Constant(kNan)};
  out.size = kNan;
  out.points.assign(out.points.size(), {});
}

// Two poses that lay the model on one place.
bool alike(const LandmarkModel& model, const Pose& a, const Pose& b) {
  double worst = 0;
  for (const LandmarkPoint& p : model.points) worst = std::max(worst, (a * p.position - b * p.position).norm());
  return worst < kSame;
}

// How well the matched extrema hold the place of x: covariance of a motion and a size fitted to them, taken to x.
Mat3 slack_at(const LandmarkScene& scene, const LandmarkModel& model, const Match& match, const Vec3& x) {
  const auto jacobian = [&](const Vec3& at) {
    Eigen::Matrix<double, 3, 7> J;
    J << -skew(at - match.pose.t), Mat3::Identity(), at - match.pose.t;
    return J;
  };
  // What is known without any: sizes, and a pose that a score was given to.
  Eigen::Matrix<double, 7, 1> loose;
  loose << 0.2, 0.2, 0.2, 20, 20, 20, std::max(1e-3, 0.5 * model.size_range);
  Eigen::Matrix<double, 7, 7> information = loose.cwiseAbs2().cwiseInverse().asDiagonal();
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    if (match.candidate[i] < 0) continue;
    const double s = std::hypot(model.points[i].sigma, kMoved * scene.scale);
    const auto J = jacobian(match.place(model.points[i].position));
    information += match.value[i] / (s * s) * J.transpose() * J;
  }
  const auto J = jacobian(x);
  return J * information.inverse() * J.transpose();
}

// The skin nearest to x that looks as the landmark does: another part of the body may lie nearer.
Jet skin_near(JetFitter& fitter, const LandmarkScene& scene, const Vec3& x, const Vec3& normal, double reach,
              double radius) {
  std::vector<Nearest::Hit> hits(kSkinTried);
  const int n = scene.nearest.neighbours(x, static_cast<int>(hits.size()), reach, hits.data());
  for (int k = 0; k < n; ++k) {
    const std::int64_t i = hits[static_cast<std::size_t>(k)].index;
    if (!oriented(*scene.surface, i) || !(scene.surface->normal(i).dot(normal) > kLooks)) continue;
    const Jet skin = fitter.fit(scene.surface->point(i), scene.surface->normal(i), radius);
    // At an edge the fit may lie anywhere.
    if (skin.found() && (skin.foot - scene.surface->point(i)).norm() < 0.5 * radius) return skin;
  }
  Jet none;
  none.fault = JetFault::kTooFew;
  return none;
}

// The place of a landmark of all patients: where the others let expect it, moved to the extremum of its kind, each by
// its covariance.
Landmark place_of(const Run& run, const LandmarkScene& scene, const LandmarkModel& model, const Match& match,
                  std::size_t i) {
  const LandmarkPoint& p = model.points[i];
  Landmark out;
  const double noise = scene.grain->noise;
  const Vec3 normal = match.pose.R * p.normal;
  Vec3 x = match.place(p.position);
  JetFitter fitter(run, scene.grain->pyramid, kLandmarkDegree);
  const double radius = std::max(0.6 * scene.scale, 2.6 * scene.grain->spacing);
  const Jet skin = skin_near(fitter, scene, x, normal, std::max(8.0, 2.5 * p.sigma), radius);
  if (!skin.found()) return out;
  const double thick = skin.foot_variance * noise * noise;
  const Mat3 flat = Mat3::Identity() - skin.normal * skin.normal.transpose();
  const Mat3 expected = slack_at(scene, model, match, x) + p.sigma * p.sigma * Mat3::Identity();
  Mat3 prior = flat * expected * flat;
  const double deep = 0.5 * curvedness(p.k1, p.k2) * prior.trace();
  prior += std::max(thick + deep * deep, 1e-8) * skin.normal * skin.normal.transpose();
  out.found = true;
  out.position = skin.foot;
  out.covariance = prior;
  out.score = match.value[i];
  if (match.candidate[i] < 0 || !(match.value[i] > kUsed) || taken(match, i)) return out;
  const Candidate& c = scene.candidates[static_cast<std::size_t>(match.candidate[i])];
  Peak peak = polish(run, scene, c.x, c.n, c.sign);
  if (!peak.found) return out;
  peak.covariance += 1e-8 * Mat3::Identity();
  // In the tangent plane of the extremum; the height is the skin's.
  const Eigen::Matrix<double, 2, 3> plane = tangent_plane(c.n);
  const Eigen::Matrix2d a = plane * expected * plane.transpose();
  const Eigen::Matrix2d b = plane * peak.covariance * plane.transpose();
  const Vec2 d = plane * (peak.x - x);
  if (!(d.dot((a + b).inverse() * d) < kOffExtremum * kOffExtremum * 2)) return out;
  const Eigen::Matrix2d gain = a * (a + b).inverse();
  const Vec2 back = (Eigen::Matrix2d::Identity() - gain) * -d;
  const Vec3 at = peak.x + plane.transpose() * back;
  const Jet foot = fitter.fit(at, c.n, radius);
  if (!foot.found()) return out;
  out.position = foot.foot;
  const Eigen::Matrix2d post = gain * b;
  // The skin bends away from the plane: a place off by s along it lies k s^2 / 2 deeper.
  const double sag = 0.5 * curvedness(c.k1, c.k2) * post.trace();
  const Mat3 tangent = Mat3::Identity() - foot.normal * foot.normal.transpose();
  const double depth = std::max(foot.foot_variance * noise * noise, 1e-8) + sag * sag;
  out.covariance =
      tangent * (plane.transpose() * post * plane) * tangent + depth * foot.normal * foot.normal.transpose();
  return out;
}

void note(const std::vector<Match>& matches, std::size_t i, LocatedLandmarks& out) {
  out.score = matches[i].score;
  out.seen = matches[i].seen;
  out.matched = matches[i].matched;
  out.size = matches[i].size;
  out.live_from_model = matches[i].pose;
}

// Share of the best score from which another pose is a rival: with little in view chance fits well, and it must be
// further off.
double most_of_a_rival(const LandmarkModel& model, int seen) {
  const double shown = std::min(1.0, seen / (kShown * static_cast<double>(model.points.size())));
  return kAmbiguous * (1 - kChance * (1 - shown));
}

void by_constellation(const Run& run, LandmarkScene& scene, const LandmarkModel& model,
                      const std::vector<Match>& matches, const LocateOptions& options, LocatedLandmarks& out) {
  if (!matches.empty()) note(matches, 0, out);
  const double least = options.min_score;
  if (scene.field().known == 0)
    return not_found(out, "nowhere on the surface is the curvature known at a scale of " + rounded(scene.scale) +
                              " mm: too few points, no normals, or normals that disagree");
  if (matches.empty() || out.score < least || out.matched < options.min_points ||
      matches[0].evidence < kLeastEvidence) {
    not_found(out, "the model's landmarks are not on the surface: " + std::to_string(out.candidates) +
                       " places stand out, of " + std::to_string(out.seen) + " landmarks in view " +
                       std::to_string(out.matched) + " match (score " + rounded(out.score) + ", at least " +
                       rounded(least) + " and " + std::to_string(options.min_points) +
                       " matches are needed; evidence " + rounded(matches.empty() ? 0 : matches[0].evidence) +
                       ", at least " + rounded(kLeastEvidence) + ")");
    return;
  }
  // Another pose must have less evidence by far, and must not look as well either.
  bool clear = true;
  for (std::size_t k = 1; k < matches.size(); ++k) {
    out.runner_up_score = std::max(out.runner_up_score, matches[k].score);
    const bool alike = matches[k].score > kAlike * out.score;
    clear = clear && matches[0].evidence - matches[k].evidence > (alike ? kClearAlike : kClear);
  }
  if (!clear) {
    not_found(out, "the landmarks fit in two ways (scores " + rounded(out.score) + " and " +
                       rounded(out.runner_up_score) + ")");
    return;
  }
  widen(run, scene);
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    out.points[i] = place_of(run, scene, model, matches[0], i);
    out.points[i].repeat_covariance = out.points[i].covariance;
  }
}

// A patient's own skin tells the right match: where the patches lie on it.
void by_patches(const Run& run, const LandmarkScene& scene, const LandmarkModel& model,
                const std::vector<Match>& matches, LocatedLandmarks& out) {
  std::vector<PatchFit> fits;
  fits.reserve(2 * kTried);
  const auto less = [](const PatchFit& a, const PatchFit& b) { return a.evidence < b.evidence; };
  for (std::size_t i = 0; i < std::min(matches.size(), 2 * kTried); ++i) {
    // The worse half only where none of the better fits.
    if (i == kTried && std::max_element(fits.begin(), fits.end(), less)->share >= kSkinFits) break;
    fits.push_back(fit_patches(run, scene, model, matches[i].pose, kSparse));
  }
  const auto top = std::max_element(fits.begin(), fits.end(), less);
  const std::size_t chosen = static_cast<std::size_t>(top - fits.begin());
  PatchFit best;
  if (top != fits.end()) best = *top;
  const double rival = matches.empty() ? 0 : most_of_a_rival(model, matches[chosen].seen);
  double second = 0;  // evidence of the best at another pose
  for (PatchFit& fit : fits) {
    if (alike(model, fit.live_from_model, best.live_from_model)) continue;
    // What may have stopped on its way to the same pose goes on, by all points.
    if (fit.evidence > rival * best.evidence) fit = fit_patches(run, scene, model, fit.live_from_model, 1);
    // A match that slid onto the same pose is no rival.
    if (!alike(model, fit.live_from_model, best.live_from_model)) second = std::max(second, fit.evidence);
  }
  if (!matches.empty()) note(matches, chosen, out);
  out.score = best.share;
  out.runner_up_score = best.evidence > 0 ? best.share * second / best.evidence : 0;
  if (best.share < kSkinFits) {
    not_found(out, "the reference's skin is not on the surface: " + std::to_string(out.candidates) +
                       " places stand out, at best " + rounded(best.share) +
                       " of the skin about the landmarks fits (at least " + rounded(kSkinFits) + " is needed)");
    return;
  }
  if (second > rival * best.evidence) {
    not_found(out, "the skin about the landmarks fits in two ways (scores " + rounded(out.score) + " and " +
                       rounded(out.runner_up_score) + ")");
    return;
  }
  const Pose& pose = best.live_from_model;
  const PatchFit fit = fit_patches(run, scene, model, pose, 1);
  out.live_from_model = fit.live_from_model;
  out.size = 1;
  if (fit.share < kSkinFits || place_by_patches(run, scene, model, fit.live_from_model, out.points) < 3)
    not_found(out, "the skin about the landmarks is not the reference's");
}

}  // namespace

LocatedLandmarks locate(const Run& run, const Surface& live, const LandmarkModel& model, const LocateOptions& options) {
  return locate(run, live, grain_of(run, live, kLandmarkDegree, options.noise), model, options);
}

LocatedLandmarks locate(const Run& run, const Surface& live, const Grain& grain, const LandmarkModel& model,
                        const LocateOptions& options) {
  check_model(model);
  LocatedLandmarks out;
  out.names.reserve(model.points.size());
  for (const LandmarkPoint& p : model.points) out.names.push_back(p.name);
  out.points.resize(model.points.size());
  LandmarkScene scene = make_landmark_scene(run, live, grain, model.scale);
  out.scale = scene.scale;
  out.noise = grain.noise;
  out.candidates = static_cast<int>(scene.candidates.size());
  const std::vector<Match> matches = best_matches(run, scene, model);
  if (model.patch_spacing > 0) {
    by_patches(run, scene, model, matches, out);
  } else {
    by_constellation(run, scene, model, matches, options, out);
  }
  return out;
}

}  // namespace sgrt
