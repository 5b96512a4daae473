// Each camera by itself, see calibration/start.hpp.
#include <algorithm>
#include <cmath>

#include "calibration/blunders.hpp"
#include "calibration/initial.hpp"
#include "calibration/start.hpp"
#include "calibration/text.hpp"
#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

std::vector<View> of_camera(const std::vector<View>& views, int camera) {
  std::vector<View> own;
  std::copy_if(views.begin(), views.end(), std::back_inserter(own), [&](const View& v) { return v.camera == camera; });
  return own;
}

// A target seen from its back is one whose points were named in mirror order. Most views decide which side is the
// front.
void drop_mirrored(Mono& mono, std::vector<Discarded>& discarded) {
  const auto front = [](const Pose& pose) { return pose.R.col(2).dot(pose.t) > 0; };
  const auto count = std::count_if(mono.camera_from_target.begin(), mono.camera_from_target.end(), front);
  const bool most = 2 * count >= static_cast<std::ptrdiff_t>(mono.views.size());
  Mono kept{mono.camera, {}, {}, 1};
  for (std::size_t i = 0; i < mono.views.size(); ++i) {
    if (front(mono.camera_from_target[i]) == most) {
      kept.views.push_back(mono.views[i]);
      kept.camera_from_target.push_back(mono.camera_from_target[i]);
    } else {
      discarded.push_back({mono.views[i].camera, mono.views[i].placement, -1, std::nan(""),
                           "mirrored: its points run the other way round than in the other images"});
    }
  }
  mono = std::move(kept);
}

// The largest angle between two normals of the target, seen from the camera.
double spread_of(const std::vector<Pose>& poses) {
  double smallest = 1;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) smallest = std::min(smallest, poses[i].R.col(2).dot(poses[j].R.col(2)));
  }
  return std::acos(std::max(-1.0, smallest)) / kDegree;
}

// Parallel targets give one equation of the lens however many there are (Zhang 2000, section 3.3).
void check_motion(const Bundle& bundle, const Scene& scene, const std::string& id) {
  constexpr double kLeastSpreadDeg = 4, kMostFocal = 0.05, kNoise = 0.1;
  const double spread = spread_of(scene.room_from_target);
  if (spread < kLeastSpreadDeg) {
    double tilt = 0;
    for (const Pose& p : scene.room_from_target)
      tilt = std::max(tilt, std::acos(std::min(1.0, std::abs(p.R.col(2).z()))) / kDegree);
    const std::string text = rounded(spread, 1) + " deg (largest tilt " + rounded(tilt, 1) + " deg)";
    fail(Status::kDegenerate, "camera " + in_quotes(id) + ": the board's direction differs by only " + text +
                                  " between the images, so the focal length is free: tilt the board by 20 to 40 deg "
                                  "about both of its axes");
  }
  Bundle unit = bundle;
  unit.noise = std::max(kNoise, bundle.noise);
  for (LensPrior& prior : unit.priors) prior.sigma.head<2>().setConstant(std::numeric_limits<double>::infinity());
  const Eigen::MatrixXd C = inverse_of(information_of(unit, scene, true));
  const double sigma = std::sqrt(C(0, 0)) / scene.cameras[0].fx;
  if (sigma < kMostFocal) return;
  fail(Status::kDegenerate, "camera " + in_quotes(id) + ": the images leave the focal length free (one sigma " +
                                (std::isfinite(sigma) ? rounded(100 * sigma, 0) + " %" : "without bound") +
                                "): tilt the board by 20 to 40 deg about both of its axes, and vary its distance");
}

}  // namespace

LensPrior prior_of(const CalibrationCamera& camera, int count, double focal_length) {
  // Terms of the radial polynomial at the corner of the image, as a share of the radius; tangential terms by
  // themselves.
  constexpr double kTerms[] = {0.2, 0.1, 0.05}, kTangential = 0.005, kPrincipal = 0.1, kRational = 10;
  const double r2 =
      (camera.width * 1.0 * camera.width + camera.height * 1.0 * camera.height) / 4 / (focal_length * focal_length);
  LensPrior prior;
  prior.mean(2) = (camera.width - 1) / 2.0;
  prior.mean(3) = (camera.height - 1) / 2.0;
  prior.sigma(2) = prior.sigma(3) = kPrincipal * std::max(camera.width, camera.height);
  const int places[] = {4, 5, 8, 9, 10, 11};
  for (int i = 0; i < 6; ++i)
    prior.sigma(places[i]) = kTerms[i % 3] / std::pow(r2, i % 3 + 1) * (count == 8 ? kRational : 1);
  prior.sigma(6) = prior.sigma(7) = kTangential;
  return prior;
}

Mono calibrate_alone(const Run& run, const CalibrationData& data, const CalibrationOptions& options,
                     const Target& target, const std::vector<View>& views, int camera,
                     std::vector<Discarded>& discarded) {
  const CalibrationCamera& given = data.cameras[static_cast<std::size_t>(camera)];
  Mono mono;
  const auto need_views = [&](std::size_t count) {
    if (static_cast<int>(count) >= options.min_views) return;
    fail(Status::kInsufficientData, "camera " + in_quotes(given.id) + ": " + std::to_string(count) +
                                        " usable images of the board, expected at least " +
                                        std::to_string(options.min_views));
  };
  std::vector<View> own = of_camera(views, camera);
  need_views(own.size());
  for (View& view : own) view = without_blunders(target, std::move(view));
  mono.camera.id = given.id;
  mono.camera.width = given.width;
  mono.camera.height = given.height;
  mono.camera.distortion_count = options.distortion_count;
  mono.camera.fx = mono.camera.fy = first_focal_length(target, own, given.width, given.height);
  mono.camera.cx = (given.width - 1) / 2.0;
  mono.camera.cy = (given.height - 1) / 2.0;
  for (const View& view : own) {
    const auto pose = plane_pose(target, mono.camera, view);
    if (pose) {
      mono.views.push_back(view);
      mono.camera_from_target.push_back(*pose);
    } else {
      discarded.push_back({camera, view.placement, -1, std::nan(""), "no pose of the board explains its points"});
    }
  }
  drop_mirrored(mono, discarded);
  need_views(mono.views.size());
  // The views in a bundle of their own: placement i is view i.
  Bundle bundle{target, mono.views, {prior_of(given, options.distortion_count, mono.camera.fx)}, 0, false, 0, 1};
  for (std::size_t i = 0; i < bundle.views.size(); ++i) {
    bundle.views[i].camera = 0;
    bundle.views[i].placement = static_cast<int>(i);
  }
  Scene scene{{mono.camera}, mono.camera_from_target, Vec3::Zero()};
  solve_robustly(run, bundle, scene, options, true);
  check_motion(bundle, scene, given.id);
  mono.noise = bundle.noise;
  mono.camera = scene.cameras[0];
  mono.camera_from_target = scene.room_from_target;
  for (std::size_t i = 0; i < mono.views.size(); ++i) mono.views[i].weight = bundle.views[i].weight;
  return mono;
}

}  // namespace sgrt
