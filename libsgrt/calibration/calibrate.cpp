// The steps of a calibration, see calibration/calibrate.hpp: check, start, joint robust solve, covariance, figures.
#include "calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/figures.hpp"
#include "calibration/start.hpp"
#include "calibration/text.hpp"
#include "calibration/views.hpp"
#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kWarpShare = 0.01;  // of the half size: a board that is no worse bent than this

// Which distortion terms go first when the images do not support them: the highest powers.
constexpr int kDropOrder[] = {11, 10, 9, 8, 5, 4};

// The first camera whose distortion folds inside its image; -1: none.
int folding_camera(const Scene& scene) {
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    try {
      make_camera(scene.cameras[c]);
    } catch (const Error&) {
      return static_cast<int>(c);
    }
  }
  return -1;
}

const char* term_name(int i) {
  static constexpr const char* kTerms[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  return kTerms[i];
}

// Holds the highest free term of a camera at 0; false where none is left.
bool drop_term(Bundle& bundle, Scene& scene, int camera, std::vector<std::string>& warnings) {
  for (int i : kDropOrder) {
    LensPrior& prior = bundle.priors[camera];
    if (i >= lens_count(scene.cameras[camera]) || prior.sigma(i) == 0) continue;
    LensVector lens = lens_of(scene.cameras[camera]);
    lens(i) = prior.mean(i) = prior.sigma(i) = 0;
    set_lens(lens, scene.cameras[camera]);
    warnings.push_back("camera " + in_quotes(scene.cameras[camera].id) + ": " + term_name(i) +
                       " is dropped: with it the distortion would fold inside the image, where no board was");
    return true;
  }
  return false;
}

// A term whose posterior is no narrower than half its prior comes from the prior.
void name_held_terms(CalibrationResult& r) {
  constexpr double kHeld = 0.5;
  Eigen::Index first = 0;
  for (std::size_t c = 0; c < r.scene.cameras.size(); ++c) {
    std::string held;
    const int count = lens_count(r.scene.cameras[c]);
    for (int i = 4; i < count; ++i) {
      const double prior = r.priors[c].sigma(i);
      if (prior > 0 && std::sqrt(r.covariance(first + i, first + i)) > kHeld * prior)
        held += (held.empty() ? "" : ", ") + std::string(term_name(i));
    }
    first += count + 6;
    if (!held.empty())
      r.warnings.push_back("camera " + in_quotes(r.scene.cameras[c].id) + ": the images do not support " + held +
                           ", held near 0 by the prior; the uncertainty says by how much it may be off");
  }
}

// The covariance with rows for every parameter of the rig: what is held, the first camera's pose among it, has zeros.
void fill_covariance(CalibrationResult& r) {
  const Layout layout = layout_of(r.bundle, r.scene);
  const Eigen::MatrixXd C = inverse_of(information_of(r.bundle, r.scene, true));
  std::vector<int> from;
  for (std::size_t c = 0; c < r.scene.cameras.size(); ++c) {
    const Camera& camera = r.scene.cameras[c];
    for (const std::string& name : parameter_names(camera)) r.parameters.push_back(name);
    for (int i = 0; i < lens_count(camera); ++i) from.push_back(layout.lens[c][i]);
    for (int i = 0; i < 6; ++i) from.push_back(layout.pose[c] < 0 ? -1 : layout.pose[c] + i);
  }
  const auto n = static_cast<Eigen::Index>(from.size());
  r.covariance = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      if (from[i] >= 0 && from[j] >= 0) r.covariance(i, j) = C(from[i], from[j]);
    }
  }
}

void list_outliers(CalibrationResult& r) {
  for (const View& view : r.bundle.views) {
    const std::vector<Vec2> residuals = residuals_of(r.bundle, r.scene, view);
    const auto bad = std::count(view.weight.begin(), view.weight.end(), 0.0);
    if (bad == static_cast<std::ptrdiff_t>(view.weight.size())) {
      r.discarded.push_back({view.camera, view.placement, -1, std::nan(""), "does not fit the other images"});
      continue;
    }
    for (std::size_t i = 0; i < view.weight.size(); ++i) {
      if (view.weight[i] == 0)
        r.discarded.push_back({view.camera, view.placement, view.index[i], residuals[i].norm(), "outlier"});
    }
  }
  r.bundle.views.erase(
      std::remove_if(r.bundle.views.begin(), r.bundle.views.end(),
                     [](const View& v) { return *std::max_element(v.weight.begin(), v.weight.end()) == 0; }),
      r.bundle.views.end());
}

void check_views(const CalibrationData& data, const CalibrationOptions& options, const CalibrationResult& r) {
  for (std::size_t c = 0; c < data.cameras.size(); ++c) {
    const auto count = std::count_if(r.bundle.views.begin(), r.bundle.views.end(),
                                     [&](const View& v) { return v.camera == static_cast<int>(c); });
    if (count < options.min_views)
      fail(Status::kInsufficientData, "camera " + in_quotes(data.cameras[c].id) + ": only " + std::to_string(count) +
                                          " images agree with the rest, expected at least " +
                                          std::to_string(options.min_views));
  }
}

void solve_jointly(const Run& run, const CalibrationOptions& options, CalibrationResult& r) {
  Robust robust = solve_robustly(run, r.bundle, r.scene, options);
  r.iterations = robust.iterations;
  for (int camera = folding_camera(r.scene); camera >= 0; camera = folding_camera(r.scene)) {
    if (!drop_term(r.bundle, r.scene, camera, r.warnings))
      fail(Status::kDegenerate, "camera " + in_quotes(r.scene.cameras[camera].id) +
                                    ": no lens fits the images that is one to one over the whole image");
    robust = solve_robustly(run, r.bundle, r.scene, options);
    r.iterations += robust.iterations;
  }
  if (!robust.converged)
    fail(Status::kNotConverged, "no solution after " + std::to_string(r.iterations) + " iterations");
}

Rig rig_of(const CalibrationData& data, const CalibrationOptions& options, const Scene& scene) {
  Rig rig;
  rig.id = options.rig_id;
  rig.room = "camera " + data.cameras[0].id;
  rig.pairs = data.pairs;
  for (const Camera& camera : scene.cameras) rig.cameras.push_back(make_camera(camera));
  return rig;
}

CalibrationResult calibrate_once(const Run& run, const CalibrationData& data, const CalibrationOptions& options) {
  CalibrationResult r;
  const Target target = make_target(data.points);
  const std::vector<View> views = views_of(data, r.discarded);
  std::vector<Mono> alone;
  for (std::size_t c = 0; c < data.cameras.size(); ++c) {
    run.poll(static_cast<double>(c) / static_cast<double>(data.cameras.size()), "start");
    alone.push_back(calibrate_alone(run, data, options, target, views, static_cast<int>(c), r.discarded));
  }
  r.scene = link_rig(data, target, alone, r.discarded);
  const double warp = options.warp_sigma_mm != 0 ? std::max(options.warp_sigma_mm, 0.0) : kWarpShare * target.half_size;
  r.bundle = Bundle{target, {}, {}, 0, false, warp, 1};
  for (std::size_t c = 0; c < alone.size(); ++c) {
    r.bundle.priors.push_back(prior_of(data.cameras[c], options.distortion_count, alone[c].camera.fx));
    r.bundle.noise = c == 0 ? alone[c].noise : std::max(r.bundle.noise, alone[c].noise);
    r.bundle.views.insert(r.bundle.views.end(), alone[c].views.begin(), alone[c].views.end());
  }
  solve_jointly(run, options, r);
  r.priors = r.bundle.priors;
  list_outliers(r);
  check_views(data, options, r);
  fill_covariance(r);
  if (!r.covariance.allFinite()) fail(Status::kDegenerate, "the images leave a parameter of the rig free");
  r.noise = r.bundle.noise;
  r.rms = rms_of(r.bundle, r.scene, -1, false);
  r.rms_all = rms_of(r.bundle, r.scene, -1, true);
  r.rig = rig_of(data, options, r.scene);
  return r;
}

// Every other placement, by the order of the names.
CalibrationData half_of(const CalibrationData& data, int which) {
  std::vector<std::size_t> order(data.placements.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return data.placements[a] < data.placements[b]; });
  std::vector<bool> kept(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) kept[order[i]] = static_cast<int>(i % 2) == which;
  CalibrationData half = data;
  half.sights.clear();
  for (const Sight& s : data.sights) {
    if (kept[s.placement]) half.sights.push_back(s);
  }
  return half;
}

void try_halves(const Run& run, const CalibrationData& data, const CalibrationOptions& options, CalibrationResult& r) {
  try {
    const CalibrationResult a = calibrate_once(run, half_of(data, 0), options);
    const CalibrationResult b = calibrate_once(run, half_of(data, 1), options);
    compare_halves(a, b, r);
  } catch (const Error& error) {
    if (error.status() < Status::kInsufficientData || error.status() >= Status::kCancelled) throw;
    r.warnings.push_back(std::string("no comparison of two halves of the images: ") + error.what());
  }
}

}  // namespace

CalibrationResult calibrate(const Run& run, const CalibrationData& data, const CalibrationOptions& options) {
  check_data(data);
  CalibrationResult r;
  try {
    r = calibrate_once(run, data, options);
    describe_cameras(data, r);
    name_held_terms(r);
    if (options.split_half) try_halves(run, data, options, r);
  } catch (const Error& error) {
    if (error.status() < Status::kInsufficientData || error.status() >= Status::kCancelled) throw;
    r = CalibrationResult{};
    r.status = error.status();
    r.message = error.what();
  }
  return r;
}

}  // namespace sgrt
