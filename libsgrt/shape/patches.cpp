// Point-to-plane steps of patches on the live skin. docs/theory/landmarks.md eq. 9-11.
#include "shape/patches.hpp"

#include <algorithm>
#include <cmath>

#include "core/median.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr int kRounds = 12;
constexpr double kAtRest = 1e-4;     // mm (and 1e-6 rad): a step that ends the fit
constexpr double kRoughly = 0.02;    // the same by few points
constexpr double kFarthest = 8;      // mm of a patch point from the skin
constexpr double kBeyond = 0.6;      // of a disc's radius
constexpr double kTukey = 4;         // sigmas
constexpr double kFits = 0.3;        // mm that shape may have changed
constexpr double kLeastMet = 0.25;   // of the patch points that must lie on skin
constexpr double kLeastShare = 0.4;  // of a patch that must meet the skin, unless the place itself does
constexpr double kAtPlace = 2.5;     // sigmas of a live point from a place that it is of

struct Contact {
  bool met = false;
  Vec3 x, n;        // the patch point in the live frame, the skin's normal
  double r = 0;     // mm, skin above the point
  double variance;  // mm2, as the sum over all contacts wants it
  double scatter;   // mm2, of this contact alone
};

struct Sample {
  std::size_t landmark;
  Vec3 y, normal;  // model frame
};

// Radius of the patches, mm.
double reach_of(const LandmarkModel& model) {
  double sum = 0;
  int count = 0;
  for (const LandmarkPoint& p : model.points) {
    if (p.patch.rows() == 0) continue;
    sum += (p.patch.rowwise() - p.position.transpose()).rowwise().norm().maxCoeff();
    ++count;
  }
  return count > 0 ? sum / count : 1;
}

std::vector<Contact> contacts(const Run& run, const LandmarkScene& scene, const LandmarkModel& model,
                              const std::vector<Sample>& samples, const Pose& pose) {
  std::vector<Contact> out(samples.size());
  const double spacing = scene.grain->spacing, noise = scene.grain->noise;
  const double radius = std::max(2.6 * spacing, 3.0);
  // A live point counts once, however many discs it lies in: a sample has the area of its share of the patch.
  const double own = noise > 0 ? noise * noise * scene.surface->correlation_points : 0;
  // The discs reach beyond the patch, so that the points about it have their say too.
  const double reach = reach_of(model);
  const double share = std::pow(spacing / std::max(model.patch_spacing, 1e-3) * reach / (reach + kBeyond * radius), 2);
  parallel_for(
      run, static_cast<std::int64_t>(samples.size()), 64,
      [&](std::int64_t begin, std::int64_t end) {
        JetFitter fitter(run, scene.grain->pyramid, kLandmarkDegree);
        for (std::int64_t i = begin; i < end; ++i) {
          const auto k = static_cast<std::size_t>(i);
          Contact& c = out[k];
          c.x = pose * samples[k].y;
          const Jet skin = fitter.fit(c.x, pose.R * samples[k].normal, radius);
          if (!skin.found() || (skin.foot - c.x).norm() > kFarthest) continue;
          c.met = true;
          c.n = skin.normal;
          c.r = skin.normal.dot(skin.foot - c.x);
          const double reference = model.patch_sigma * model.patch_sigma + 1e-6;
          c.variance = own * std::max(share, skin.foot_variance) + reference;
          c.scatter = own * skin.foot_variance + reference;
        }
      },
      "landmarks: patches");
  return out;
}

double scale_of(const std::vector<Contact>& contacts) {
  std::vector<double> z;
  z.reserve(contacts.size());
  for (const Contact& c : contacts) {
    if (c.met) z.push_back(std::abs(c.r) / std::sqrt(c.variance));
  }
  if (z.empty()) return 1;
  return std::max(1.0, 1.4826 * median(z));
}

double tukey(double u) {
  return std::abs(u) < kTukey ? std::pow(1 - u * u / (kTukey * kTukey), 2) : 0;
}

std::vector<Sample> samples_of(const LandmarkModel& model, std::size_t stride) {
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const LandmarkPoint& p = model.points[i];
    for (Eigen::Index k = 0; k < p.patch.rows(); k += static_cast<Eigen::Index>(stride))
      samples.push_back({i, p.patch.row(k).transpose(), p.normal});
  }
  return samples;
}

// The normal equations of a small motion about the pivot: rotation, then translation.
struct System {
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  double scale = 1;  // of the residuals over their own sigma
};

double weight_of(const Contact& c, double scale) {
  return c.met ? tukey(c.r / (scale * std::sqrt(c.variance))) : 0;
}

System system_of(const std::vector<Contact>& contacts, const Vec3& pivot) {
  System s;
  s.scale = scale_of(contacts);
  for (const Contact& c : contacts) {
    if (!c.met) continue;
    Vec6 j;
    j << (c.x - pivot).cross(c.n), c.n;
    const double w = weight_of(c, s.scale) / (s.scale * s.scale * c.variance);
    s.information.noalias() += w * j * j.transpose();
    s.gradient += w * c.r * j;
  }
  return s;
}

// The live surface has the place x itself, whatever it lacks about it.
bool skin_at(const LandmarkScene& scene, const Vec3& x, const Vec3& normal) {
  const auto hit = scene.nearest.nearest(x, std::hypot(scene.grain->spacing, kAtPlace * scene.grain->noise));
  return hit.index >= 0 && oriented(*scene.surface, hit.index) && normal.dot(scene.surface->normal(hit.index)) > 0;
}

}  // namespace

PatchFit fit_patches(const Run& run, const LandmarkScene& scene, const LandmarkModel& model,
                     const Pose& live_from_model, std::size_t stride) {
  PatchFit out{live_from_model, 0};
  const std::vector<Sample> samples = samples_of(model, stride);
  std::vector<Contact> met;
  const double enough = stride > 1 ? kRoughly : kAtRest;
  for (int round = 0; round <= kRounds; ++round) {
    met = contacts(run, scene, model, samples, out.live_from_model);
    if (round == kRounds) break;
    const Vec3 pivot = out.live_from_model * model.points[0].position;
    const System s = system_of(met, pivot);
    const Eigen::LDLT<Mat6> ldlt(s.information);
    if (!(ldlt.vectorD().minCoeff() > 0)) return out;
    Vec6 step = ldlt.solve(s.gradient);
    if (step.tail<3>().norm() > 5) step *= 5 / step.tail<3>().norm();
    const Mat3 R = so3_exp(step.head<3>());
    out.live_from_model = Pose{R, pivot - R * pivot + step.tail<3>()} * out.live_from_model;
    if (step.head<3>().norm() < 0.01 * enough && step.tail<3>().norm() < enough) break;
  }
  double all = 0, good = 0;
  for (const Contact& c : met) {
    if (!c.met) continue;
    ++all;
    const double u = c.r / (3 * std::sqrt(c.scatter) + kFits);
    good += std::max(0.0, 1 - u * u);
  }
  out.share = good / std::max(all, kLeastMet * static_cast<double>(samples.size()));
  out.evidence = good / std::max<double>(1, static_cast<double>(samples.size()));
  return out;
}

int place_by_patches(const Run& run, const LandmarkScene& scene, const LandmarkModel& model, const Pose& pose,
                     std::vector<Landmark>& points) {
  const std::vector<Sample> samples = samples_of(model, 1);
  const std::vector<Contact> met = contacts(run, scene, model, samples, pose);
  const Vec3 pivot = pose * model.points[0].position;
  const System system = system_of(met, pivot);
  const Mat6 covariance = system.information.inverse();
  int found = 0;
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    double all = 0, good = 0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      if (samples[k].landmark != i) continue;
      ++all;
      good += weight_of(met[k], system.scale);
    }
    Landmark& out = points[i];
    const Vec3 x = pose * model.points[i].position;
    const bool much = all > 0 && good > kLeastShare * all;
    found += much;
    out.found = much || (good > 0 && skin_at(scene, x, pose.R * model.points[i].normal));
    if (!out.found) continue;
    out.position = x;
    Eigen::Matrix<double, 3, 6> J;
    J << -skew(x - pivot), Mat3::Identity();
    out.repeat_covariance = J * covariance * J.transpose();
    out.covariance = out.repeat_covariance + pose.R * model.points[i].place_covariance * pose.R.transpose();
    out.score = good / all;
  }
  return found;
}

}  // namespace sgrt
