// Scene, match, refinement, verdict. docs/theory/landmarks.md.
#include "shape/locate.hpp"

#include <cmath>
#include <limits>

#include "shape/constellation.hpp"
#include "shape/patches.hpp"
#include "shape/scene.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kAmbiguous = 0.9;     // a runner-up so near the best
constexpr double kScaleBias = 0.08;    // of the scale: an extremum of smoothed curvature is not that of the skin's own
constexpr double kUsed = 0.1;          // value from which an extremum moves its landmark
constexpr double kOffExtremum = 2.5;   // sigmas of its place: further away an extremum is another one

std::string rounded(double x) {
  return text_of(std::round(100 * x) / 100);
}

void not_found(Landmarks& out, const std::string& why) {
  out.status = Status::kNotFound;
  out.message = why;
  out.live_from_model = {Mat3::Constant(kNan), Vec3::Constant(kNan)};
  out.size = kNan;
  for (Landmark& l : out.points) l = {false, Vec3::Constant(kNan), Mat3::Constant(kNan), 0};
}

// The place of a landmark of all patients: where the others let expect it, moved to the extremum of its kind, each by
// its covariance (eq. 5).
Landmark place_of(const Run& run, const Scene& scene, const LandmarkModel& model, const Match& match, std::size_t i) {
  const LandmarkPoint& p = model.points[i];
  Landmark out;
  const Vec3 normal = match.pose.R * p.normal;
  Vec3 x = match.place(p.position);
  JetFitter fitter(run, scene.pyramid, 2);
  const double radius = std::max(0.6 * scene.scale, 2.6 * scene.spacing);
  const auto hit = scene.nearest.nearest(x, std::max(8.0, 2.5 * p.sigma));
  if (hit.index < 0) return out;
  Vec3 at = scene.surface->point(hit.index);
  const Vec3 there = scene.surface->normal(hit.index);
  if (!(there.dot(normal) > 0.2)) return out;
  const JetFitter::Skin skin = fitter.skin(at, there, radius);
  if (!skin.found) return out;
  const double thick = skin.variance * scene.noise * scene.noise;
  Mat3 prior = p.sigma * p.sigma * (Mat3::Identity() - skin.normal * skin.normal.transpose());
  prior += (std::max(thick, 1e-8)) * skin.normal * skin.normal.transpose();
  out.found = true;
  out.position = skin.foot;
  out.covariance = prior;
  out.score = match.value[i];
  if (match.candidate[i] < 0 || !(match.value[i] > kUsed)) return out;
  const Candidate& c = scene.candidates[static_cast<std::size_t>(match.candidate[i])];
  Peak peak = polish(run, scene, c.x, c.n, c.sign);
  if (!peak.found) return out;
  const double bias = kScaleBias * scene.scale;
  peak.covariance += bias * bias * (Mat3::Identity() - c.n * c.n.transpose()) + 1e-8 * Mat3::Identity();
  // In the tangent plane of the extremum; the height is the skin's.
  const Vec3 e1 = c.n.unitOrthogonal(), e2 = c.n.cross(e1);
  Eigen::Matrix<double, 2, 3> plane;
  plane.row(0) = e1.transpose();
  plane.row(1) = e2.transpose();
  const Eigen::Matrix2d a = p.sigma * p.sigma * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d b = plane * peak.covariance * plane.transpose();
  const Vec2 d = plane * (peak.x - x);
  if (!(d.dot((a + b).inverse() * d) < kOffExtremum * kOffExtremum * 2)) return out;
  const Eigen::Matrix2d gain = a * (a + b).inverse();
  const Vec2 back = (Eigen::Matrix2d::Identity() - gain) * -d;
  at = peak.x + plane.transpose() * back;
  const JetFitter::Skin foot = fitter.skin(at, c.n, radius);
  if (!foot.found) return out;
  out.position = foot.foot;
  const Eigen::Matrix2d post = gain * b;
  out.covariance = plane.transpose() * post * plane +
                   std::max(foot.variance * scene.noise * scene.noise, 1e-8) * foot.normal * foot.normal.transpose();
  return out;
}

}  // namespace

Landmarks locate(const Run& run, const Surface& live, const LandmarkModel& model, const LocateOptions& options) {
  check_model(model);
  Landmarks out;
  for (const LandmarkPoint& p : model.points) out.names.push_back(p.name);
  out.points.resize(model.points.size());
  const Scene scene = make_scene(run, live, model.scale, options.noise);
  out.scale = scene.scale;
  out.noise = scene.noise;
  out.candidates = static_cast<int>(scene.candidates.size());
  const Match match = best_match(run, scene, model, &out.runner_up_score);
  out.score = match.score;
  out.seen = match.seen;
  out.matched = match.matched;
  if (match.candidate.empty() || match.score < options.min_score || match.matched < options.min_points) {
    not_found(out, "the model's landmarks are not on the surface: " + std::to_string(out.candidates) +
                       " places stand out, of " + std::to_string(match.seen) + " landmarks in view " +
                       std::to_string(match.matched) + " match (score " + rounded(match.score) + ", at least " +
                       rounded(options.min_score) + " and " + std::to_string(options.min_points) +
                       " matches are needed)");
    return out;
  }
  if (out.runner_up_score > kAmbiguous * match.score) {
    not_found(out, "the landmarks fit in two ways (scores " + rounded(match.score) + " and " +
                       rounded(out.runner_up_score) + ")");
    return out;
  }
  out.live_from_model = match.pose;
  out.size = match.size;
  if (model.patch_spacing > 0) {
    if (refine_by_patches(run, scene, model, out.live_from_model, out.points) < 3)
      not_found(out, "the skin about the landmarks is not the reference's");
  } else {
    for (std::size_t i = 0; i < model.points.size(); ++i) out.points[i] = place_of(run, scene, model, match, i);
  }
  for (Landmark& l : out.points) {
    if (!l.found) l = {false, Vec3::Constant(kNan), Mat3::Constant(kNan), 0};
  }
  return out;
}

}  // namespace sgrt
