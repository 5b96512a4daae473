// The robust loop, see calibration/robust.hpp.
#include "calibration/robust.hpp"
#include "core/median.hpp"

#include <algorithm>
#include <cmath>

namespace sgrt {
namespace {

// px: less is no blunder, but an image that is a little worse than the others; leaving such ones out would make the
// rest look better than it is.
constexpr double kSmallestOutlier = 0.25;
constexpr double kSmallestNoise = 1e-5;                 // px: below it rounding speaks, not the images
constexpr double kMedianOfLength = 1.1774100225154747;  // of a normal 2-vector of unit sigma: sqrt(2 ln 2)

// Lengths of the residuals in relative sigmas, a list a view.
std::vector<std::vector<double>> lengths_of(const Bundle& bundle, const Scene& scene) {
  std::vector<std::vector<double>> lengths;
  for (const View& view : bundle.views) {
    const std::vector<Vec2> r = residuals_of(bundle, scene, view);
    std::vector<double> row;
    for (std::size_t i = 0; i < r.size(); ++i) {
      const double length = r[i].norm() / view.sigma[i];
      row.push_back(std::isfinite(length) ? length : 1e6);
    }
    lengths.push_back(std::move(row));
  }
  return lengths;
}

// The noise by the median, which half of the corners can be wrong without moving far.
double robust_noise(const std::vector<std::vector<double>>& lengths, double spent) {
  std::vector<double> all;
  for (const auto& row : lengths) all.insert(all.end(), row.begin(), row.end());
  if (all.empty()) return 1;
  const double count = 2.0 * static_cast<double>(all.size());
  return std::max(kSmallestNoise, median(all) / kMedianOfLength * std::sqrt(count / std::max(count - spent, 1.0)));
}

// Parameters spent: what the priors fix is not.
double spent_of(const Bundle& bundle, const Scene& scene) {
  const Layout layout = layout_of(bundle, scene);
  std::vector<bool> seen(scene.room_from_target.size(), false);
  for (const View& view : bundle.views) seen[static_cast<std::size_t>(view.placement)] = true;
  double spent = layout.size + 6.0 * static_cast<double>(std::count(seen.begin(), seen.end(), true));
  const Eigen::MatrixXd C = inverse_of(information_of(bundle, scene, true));
  if (!C.allFinite()) return spent;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    for (int i = 0; i < kMaxLens; ++i) {
      const int at = layout.lens[c][static_cast<std::size_t>(i)];
      const double sigma = bundle.priors[c].sigma(i);
      if (at >= 0 && std::isfinite(sigma)) spent -= C(at, at) / (sigma * sigma);
    }
  }
  for (int i = 0; i < 3 && layout.warp >= 0; ++i)
    spent -= C(layout.warp + i, layout.warp + i) / (bundle.warp_sigma * bundle.warp_sigma);
  return spent;
}

// Weight 1 within the limit, 0 beyond; whether any changed.
bool classify(Bundle& bundle, const std::vector<std::vector<double>>& lengths, double limit) {
  bool changed = false;
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    View& view = bundle.views[v];
    const auto bad = std::count_if(lengths[v].begin(), lengths[v].end(), [&](double x) { return x > limit; });
    const bool whole = 2 * bad > static_cast<std::ptrdiff_t>(lengths[v].size());  // more than half: the view is wrong
    for (std::size_t i = 0; i < view.weight.size(); ++i) {
      const double weight = whole || lengths[v][i] > limit ? 0 : 1;
      changed = changed || weight != view.weight[i];
      view.weight[i] = weight;
    }
  }
  return changed;
}

double largest(const std::vector<std::vector<double>>& lengths) {
  double most = 0;
  for (const auto& row : lengths) most = std::max(most, *std::max_element(row.begin(), row.end()));
  return most;
}

}  // namespace

double noise_of(const Bundle& bundle, const Scene& scene) {
  double sum = 0, count = 0;
  for (const View& view : bundle.views) {
    const std::vector<Vec2> r = residuals_of(bundle, scene, view);
    for (std::size_t i = 0; i < r.size(); ++i) {
      if (!(view.weight[i] > 0)) continue;
      sum += r[i].squaredNorm() / (view.sigma[i] * view.sigma[i]);
      count += 2;
    }
  }
  return std::max(kSmallestNoise, std::sqrt(sum / std::max(count - spent_of(bundle, scene), 1.0)));
}

double rms_of(const Bundle& bundle, const Scene& scene, int camera, bool all) {
  double sum = 0;
  std::size_t count = 0;
  for (const View& view : bundle.views) {
    if (camera >= 0 && view.camera != camera) continue;
    const std::vector<Vec2> r = residuals_of(bundle, scene, view);
    for (std::size_t i = 0; i < r.size(); ++i) {
      if ((!all && !(view.weight[i] > 0)) || !r[i].allFinite()) continue;
      sum += r[i].squaredNorm();
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

Robust solve_robustly(const Run& run, Bundle& bundle, Scene& scene, const CalibrationOptions& options, bool rough) {
  constexpr int kCauchyRounds = 8, kFinalRounds = 6;
  constexpr double kCauchy = 2.5, kSame = 0.02;
  Robust out;
  const auto once = [&] {
    const Solution s = solve(run, bundle, scene, options.max_iterations);
    out.iterations += s.iterations;
    out.converged = s.converged;
  };
  once();
  std::vector<std::vector<double>> lengths = lengths_of(bundle, scene);
  const double spent = spent_of(bundle, scene);
  double noise = robust_noise(lengths, spent);
  const auto limit = [&] { return std::max(options.outlier_sigma * noise, kSmallestOutlier); };
  for (int round = 0; round < kCauchyRounds && largest(lengths) > limit(); ++round) {
    bundle.noise = noise;
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
      for (std::size_t i = 0; i < lengths[v].size(); ++i) {
        const double t = lengths[v][i] / (kCauchy * noise);
        bundle.views[v].weight[i] = 1 / (1 + t * t);
      }
    }
    once();
    lengths = lengths_of(bundle, scene);
    const double before = noise;
    noise = robust_noise(lengths, spent);
    if (std::abs(noise - before) < kSame * noise) break;
  }
  if (rough) {
    classify(bundle, lengths, limit());
    bundle.noise = noise;
    return out;
  }
  for (int round = 0; round < kFinalRounds; ++round) {
    const bool changed = classify(bundle, lengths, limit());
    const double before = bundle.noise;
    bundle.noise = noise_of(bundle, scene);
    if (!changed && std::abs(bundle.noise - before) < kSame * before) break;
    once();
    lengths = lengths_of(bundle, scene);
    noise = robust_noise(lengths, spent);
  }
  bundle.noise = noise_of(bundle, scene);
  return out;
}

}  // namespace sgrt
