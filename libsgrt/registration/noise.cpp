// See registration/noise.hpp.
#include "registration/noise.hpp"

#include <cmath>

namespace sgrt {
namespace {

constexpr double kFloor2 = 5e-7;            // mm2: nothing is known better than a micron
constexpr double kMedianOfSquare = 0.4549;  // of a standard normal
constexpr std::size_t kEnough = 100;

// n^T C n with the surfel's normal turned into the live surface's axes.
void project_covariances(const SurfelField& field, const Surface& surface, const Pose& pose, Workspace& work) {
  LivePoints& live = work.live;
  live.v.assign(live.x.size(), 1.0F);
  for (std::size_t k = 0; k < static_cast<std::size_t>(live.count); ++k) {
    const std::int64_t row = live.row[k];
    Vec3 n(0, 0, 1);
    if (work.surfel[k] >= 0) {
      const float* m = surfel_of(field, work.surfel[k]).n;
      n = Vec3(m[0], m[1], m[2]);
    }
    live.v[k] = static_cast<float>(surface.variance_along(row, pose.R.transpose() * n) + kFloor2);
  }
}

// The residuals of points on one surfel share its error and the skin's shape: their differences are noise.
double scatter(const SurfelField& field, const Workspace& work) {
  const auto n = static_cast<std::size_t>(work.live.count);
  std::vector<float> squares, all;
  for (const bool wider : {false, true}) {  // on one surfel, else on one of the next level
    std::vector<float> last(field.levels[0].surfels.size(), NAN);
    squares.clear();
    for (std::size_t k = 0; k < n; ++k) {
      const float r = work.r[k];
      const std::int32_t code = work.surfel[k];
      if (!(r == r) || code < 0 || code >> 27 != 0) continue;
      auto at = static_cast<std::size_t>(code);
      if (wider) at = static_cast<std::size_t>(field.levels[0].parent[at]);
      if (at >= last.size()) continue;
      if (last[at] == last[at]) {
        squares.push_back((r - last[at]) * (r - last[at]));
        last[at] = NAN;
      } else {
        last[at] = r;
      }
      if (!wider) all.push_back(r * r);
    }
    if (squares.size() >= kEnough) return median_of(squares) / (2 * kMedianOfSquare);
  }
  return median_of(all) / kMedianOfSquare;
}

}  // namespace

void fill_live_noise(const Run& run, const Reference& reference, const Surface& surface, const Pose& pose,
                     const PassOptions& options, Workspace& work) {
  const bool covariances = surface.covariance.rows() > 0;
  if (!covariances && surface.sigma.size() > 0) return;
  work.r.resize(work.live.x.size());
  work.surfel.resize(work.live.x.size());
  PassOptions o = options;
  o.unit_noise = true;
  o.scale = 0;
  o.r = work.r.data();
  o.surfel = work.surfel.data();
  do_pass(run, reference.field, work.live, pose, o);
  if (covariances) return project_covariances(reference.field, surface, pose, work);
  work.live.v_all = static_cast<float>(scatter(reference.field, work) + kFloor2);
}

}  // namespace sgrt
