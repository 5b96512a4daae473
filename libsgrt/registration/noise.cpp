// See registration/noise.hpp.
#include "registration/noise.hpp"

#include <cmath>

#include "registration/robust.hpp"

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
double scatter(const SurfelField& field, Workspace& work) {
  const auto n = static_cast<std::size_t>(work.live.count);
  std::vector<float>& squares = work.values;
  for (const int kind : {0, 1, 2}) {  // on one surfel, else on one of the next level, else each by itself
    work.last.assign(field.levels[0].surfels.size(), NAN);
    squares.clear();
    for (std::size_t k = 0; k < n; ++k) {
      const float r = work.r[k];
      const std::int32_t code = work.surfel[k];
      if (!(r == r) || code < 0 || level_of(code) != 0) continue;
      auto at = static_cast<std::size_t>(code);
      if (kind == 1) at = static_cast<std::size_t>(field.levels[0].parent[at]);
      if (kind == 2) {
        squares.push_back(r * r);
      } else if (at >= work.last.size()) {
        continue;
      } else if (work.last[at] == work.last[at]) {
        squares.push_back((r - work.last[at]) * (r - work.last[at]));
        work.last[at] = NAN;
      } else {
        work.last[at] = r;
      }
    }
    if (kind < 2 && squares.size() >= kEnough) return median_of(squares, work.scratch) / (2 * kMedianOfSquare);
  }
  return median_of(squares, work.scratch) / kMedianOfSquare;
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
