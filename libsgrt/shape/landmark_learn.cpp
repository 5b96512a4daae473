// A model from a patient's reference: what stands out on it, with its curvature and the skin about it.
// docs/theory/landmarks.md, "Model".
#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"
#include "shape/locate.hpp"
#include "shape/scene.hpp"

namespace sgrt {
namespace {

constexpr double kScale = 6;           // mm, least of a model's own
constexpr double kApart = 12;          // mm between two points
constexpr double kLeastCurved = 0.02;  // 1/mm: flatter places are none
constexpr double kPatchSpacing = 2;    // mm
constexpr double kOwnSigma = 0.02;     // mm: how well a place of the reference is known to itself
constexpr double kNear = 6;            // mm: how far the extremum of the best scale may lie
constexpr double kFinest = 2.5;        // mm, of the scales
constexpr int kLeastPoints = 4;

// Smoothed points of the skin about x, about kPatchSpacing apart.
Points patch_about(const Run& run, const LandmarkScene& scene, const Vec3& x, const Vec3& normal, double radius,
                   double spacing) {
  std::vector<Nearest::Hit> hits(4096);
  const int n = scene.nearest.neighbours(x, static_cast<int>(hits.size()), radius, hits.data());
  JetFitter fitter(run, scene.grain->pyramid, kLandmarkDegree);
  std::vector<Vec3> kept;
  for (int k = 0; k < n; ++k) {
    const std::int64_t i = hits[static_cast<std::size_t>(k)].index;
    const Vec3 p = scene.surface->point(i), m = scene.surface->normal(i);
    if (!(m.dot(normal) > 0.2)) continue;
    if (std::any_of(kept.begin(), kept.end(), [&](const Vec3& q) { return (p - q).norm() < spacing; })) continue;
    const Jet skin = fitter.fit(p, m, std::max(2.6 * scene.grain->spacing, 2.0));
    if (skin.found()) kept.push_back(skin.foot);
  }
  Points out(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = kept[i].transpose();
  return out;
}

void add_point(const Run& run, const LandmarkScene& scene, const LearnOptions& o, const std::string& name,
               const Vec3& x, const Mat3& covariance, LandmarkModel& model) {
  const auto hit = scene.nearest.nearest(x, 5);
  if (hit.index < 0 || scene.field().reason[static_cast<std::size_t>(hit.index)] != 0) return;
  LandmarkPoint p;
  p.name = name;
  p.position = x;
  p.normal = scene.field().normals.row(hit.index).transpose();
  p.k1 = scene.field().k1[hit.index], p.k2 = scene.field().k2[hit.index];
  p.sigma = kOwnSigma;
  p.place_covariance = covariance;
  p.patch = patch_about(run, scene, x, p.normal, o.patch, model.patch_spacing);
  if (p.patch.rows() >= 6 && std::abs(p.k1 + p.k2) > 0) model.points.push_back(std::move(p));
}

}  // namespace

LandmarkModel learn_model(const Run& run, const Surface& reference, const LandmarkModel* named, const LearnOptions& o) {
  if (o.count < kLeastPoints || o.count > static_cast<int>(kMaxLandmarks))
    fail(Status::kInvalidArgument, "count: " + std::to_string(o.count) + ", expected 4 to 64");
  require(o.scale >= 0 && o.scale <= 50, "scale_mm: expected 0 (chosen) or up to 50");
  require(o.patch >= 5 && o.patch <= 50, "patch_mm: expected 5 to 50");
  const Grain grain = grain_of(run, reference, kLandmarkDegree, 0);
  LandmarkScene scene = make_landmark_scene(run, reference, grain, o.scale > 0 ? o.scale : kScale);
  LandmarkModel model;
  model.id = named ? named->id + " of a reference" : "reference";
  model.scale = scene.scale;
  model.patch_spacing = std::max(kPatchSpacing, grain.spacing);
  model.patch_sigma = grain.noise > 0 ? grain.noise * 0.5 : 0;
  if (named) {
    LocatedLandmarks found = locate(run, reference, grain, *named, LocateOptions{});
    if (found.status != Status::kOk) fail(found.status, found.message);
    LandmarkScene fine = make_landmark_scene(run, reference, grain, std::max(2.6 * grain.spacing, kFinest));
    widen(run, fine);
    for (std::size_t i = 0; i < found.points.size(); ++i) {
      Landmark& l = found.points[i];
      if (!l.found) continue;
      const LandmarkPoint& p = named->points[i];
      const Peak peak = polish(run, fine, l.position, found.live_from_model.R * p.normal, sign_of(p));
      const bool sharper = peak.found && (peak.x - l.position).norm() < kNear;
      add_point(run, scene, o, p.name, sharper ? peak.x : l.position, sharper ? peak.covariance : l.covariance, model);
    }
  } else {
    for (const Candidate& c : scene.candidates) {
      if (static_cast<int>(model.points.size()) == o.count) break;
      if (curvedness(c.k1, c.k2) < kLeastCurved || c.persistence < 4 * c.sigma) continue;
      const bool near = std::any_of(model.points.begin(), model.points.end(),
                                    [&](const LandmarkPoint& p) { return (p.position - c.x).norm() < kApart; });
      if (near) continue;
      const Peak peak = polish(run, scene, c.x, c.n, c.sign);
      const std::size_t n = model.points.size() + 1;
      if (peak.found)
        add_point(run, scene, o, (n < 10 ? "p0" : "p") + std::to_string(n), peak.x, peak.covariance, model);
    }
  }
  if (static_cast<int>(model.points.size()) < kLeastPoints)
    fail(Status::kNotFound, "the surface has too few places that stand out: " + std::to_string(model.points.size()) +
                                ", a landmark model needs " + std::to_string(kLeastPoints));
  return model;
}

}  // namespace sgrt
