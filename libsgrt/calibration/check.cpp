// Cross-validation of a stored rig, see calibration/check.hpp.
#include "calibration/check.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "calibration/blunders.hpp"
#include "calibration/initial.hpp"
#include "calibration/robust.hpp"
#include "calibration/text.hpp"
#include "calibration/views.hpp"
#include "core/error.hpp"
#include "core/median.hpp"
#include "rig/uncertainty.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Of all poses that single views give, the one that explains all views of the placement best; half turns as the board
// allows.
void start_placements(const CalibrationData& data, Bundle& bundle, Scene& scene, std::vector<Discarded>& discarded) {
  std::map<int, std::vector<View*>> placements;
  for (View& view : bundle.views) placements[view.placement].push_back(&view);
  const std::vector<int> half = data.half_turn_ambiguous ? symmetry_of(bundle.target, -1, -1) : std::vector<int>{};
  const auto badness = [&](const View& view) {
    std::vector<double> lengths;
    for (const Vec2& r : residuals_of(bundle, scene, view)) lengths.push_back(r.allFinite() ? r.norm() : 1e6);
    return median(lengths);
  };
  for (auto& [placement, views] : placements) {
    double best = std::numeric_limits<double>::infinity();
    Pose chosen;
    for (const View* start : views) {
      const Camera& camera = scene.cameras[start->camera];
      const auto pose = plane_pose(bundle.target, camera, without_blunders(bundle.target, *start));
      if (!pose) continue;
      scene.room_from_target[placement] = camera.camera_from_room.inverse() * *pose;
      double sum = 0;
      for (const View* view : views)
        sum += std::min({badness(*view), half.empty() ? 1e9 : badness(renamed(*view, half)), 1e3});
      if (sum >= best) continue;
      best = sum;
      chosen = scene.room_from_target[placement];
    }
    scene.room_from_target[placement] = chosen;
    for (View* view : views) {
      if (!std::isfinite(best)) {
        discarded.push_back({view->camera, placement, -1, kNaN, "no pose of the board explains its points"});
        view->weight.clear();
      } else if (!half.empty()) {
        const View other = renamed(*view, half);
        if (badness(other) < badness(*view)) *view = other;
      }
    }
  }
  bundle.views.erase(
      std::remove_if(bundle.views.begin(), bundle.views.end(), [](const View& v) { return v.weight.empty(); }),
      bundle.views.end());
}

// eq. 23: what the rig's noise and modes leave after each placement's pose is fitted, a sum over both coordinates of
// all corners.
double expected_square(const Rig& rig, const Bundle& bundle, const Scene& scene) {
  std::map<int, std::vector<const View*>> placements;
  for (const View& view : bundle.views) placements[view.placement].push_back(&view);
  double sum = 0;
  const double noise2 = rig.uncertainty.residual_px * rig.uncertainty.residual_px;
  for (const auto& [placement, views] : placements) {
    Eigen::Index rows = 0;
    for (const View* view : views) rows += 2 * static_cast<Eigen::Index>(view->index.size());
    Eigen::MatrixXd J(rows, 6), M(rows, rig.uncertainty.modes.cols());
    Eigen::Index at = 0;
    for (const View* view : views) {
      for (int i : view->index) {
        const Vec3 x = scene.room_from_target[placement] * warped(bundle.target, scene.warp, i);
        Mat23 by_point;
        project(rig.cameras[view->camera], x, &by_point);
        J.middleRows<2>(at) << -by_point * skew(x), by_point;
        M.middleRows<2>(at) = pixel_modes(rig, view->camera, x);
        at += 2;
      }
    }
    if (!J.allFinite() || !M.allFinite()) return kNaN;
    const Eigen::MatrixXd left =
        M - J * Eigen::MatrixXd(J.transpose() * J).ldlt().solve(Eigen::MatrixXd(J.transpose() * M));
    sum += left.squaredNorm() + noise2 * static_cast<double>(rows - 6);
  }
  return sum;
}

CheckResult check_once(const Run& run, const Rig& rig, const CalibrationData& data, const CalibrationOptions& options) {
  constexpr double kWorse = 1.5, kWarpShare = 0.01;
  CheckResult r;
  std::vector<int> index;
  for (const CalibrationCamera& camera : data.cameras) {
    index.push_back(camera_index(rig, camera.id));
    const Camera& own = rig.cameras[index.back()];
    if (own.width != camera.width || own.height != camera.height)
      fail(Status::kInvalidArgument, "camera " + in_quotes(camera.id) + ": images of " + std::to_string(camera.width) +
                                         " x " + std::to_string(camera.height) + ", the rig states " +
                                         std::to_string(own.width) + " x " + std::to_string(own.height));
    r.cameras.push_back(camera.id);
  }
  r.bundle.target = make_target(data.points);
  r.bundle.views = views_of(data, r.discarded);
  for (View& view : r.bundle.views) view.camera = index[view.camera];
  r.bundle.hold_cameras = true;
  r.bundle.warp_sigma =
      options.warp_sigma_mm != 0 ? std::max(options.warp_sigma_mm, 0.0) : kWarpShare * r.bundle.target.half_size;
  r.bundle.priors.resize(rig.cameras.size());
  r.scene.cameras = rig.cameras;
  r.scene.room_from_target.resize(data.placements.size());
  start_placements(data, r.bundle, r.scene, r.discarded);
  if (r.bundle.views.empty()) fail(Status::kInsufficientData, "images: none in which the board can be used");
  // Held cameras may contradict the images: then the corners are not outliers, the rig is wrong. So no corner is left
  // out.
  solve(run, r.bundle, r.scene, options.max_iterations);
  r.noise = noise_of(r.bundle, r.scene);
  r.rms = r.rms_all = rms_of(r.bundle, r.scene, -1, true);
  double corners = 0;
  for (const View& view : r.bundle.views) corners += static_cast<double>(view.index.size());
  r.expected_rms =
      rig.uncertainty.residual_px > 0 ? std::sqrt(expected_square(rig, r.bundle, r.scene) / corners) : kNaN;
  for (int c : index) {
    CameraFigures f;
    for (const View& view : r.bundle.views) {
      if (view.camera != c) continue;
      ++f.views;
      f.corners += static_cast<int>(view.index.size());
    }
    f.rms = f.rms_all = f.views > 0 ? rms_of(r.bundle, r.scene, c, true) : kNaN;
    r.figures.push_back(f);
  }
  if (r.rms > kWorse * r.expected_rms)
    r.warnings.push_back("RMS " + rounded(r.rms, 3) + " px on these images, the rig's own uncertainty lets expect " +
                         rounded(r.expected_rms, 3) +
                         " px: the rig is not as it was calibrated, or the board is another one");
  return r;
}

}  // namespace

CheckResult check_rig(const Run& run, const Rig& rig, const CalibrationData& data, const CalibrationOptions& options) {
  check_data(data);
  try {
    return check_once(run, rig, data, options);
  } catch (const Error& error) {
    if (error.status() < Status::kInsufficientData || error.status() >= Status::kCancelled) throw;
    CheckResult r;
    r.status = error.status();
    r.message = error.what();
    return r;
  }
}

}  // namespace sgrt
