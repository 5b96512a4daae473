// See registration/surfel_fit.hpp.
#include "registration/surfel_fit.hpp"

#include <limits>

#include "registration/quadric.hpp"

namespace sgrt {
namespace {

using kernels::Surfel;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kFitRadius = 2.25;       // in cells
constexpr double kReach = 1.25;           // in cells: farther from its surfel a foot lies past the border
constexpr std::size_t kMostSamples = 64;  // of one cell in a fit

Vec3 mean_of(const Points& x, const Cells& cells, std::size_t c) {
  Vec3 sum = Vec3::Zero();
  for (std::int64_t i = cells.begin[c]; i < cells.begin[c + 1]; ++i) sum += x.row(cells.rows[i]).transpose();
  return sum / static_cast<double>(cells.begin[c + 1] - cells.begin[c]);
}

void gather(const Cells& cells, std::size_t c, std::vector<std::int32_t>& rows) {
  rows.clear();
  for_neighbours<2>(cells.keys[c], [&](std::uint32_t key) {
    const std::int32_t other = cells.find(key);
    if (other < 0) return;
    const auto begin = static_cast<std::size_t>(cells.begin[other]),
               end = static_cast<std::size_t>(cells.begin[other + 1]);
    const std::size_t step = (end - begin + kMostSamples - 1) / kMostSamples;
    for (std::size_t i = begin; i < end; i += step) rows.push_back(cells.rows[i]);
  });
}

}  // namespace

Made make_surfel(const Cloud& cloud, const Cells& cells, std::size_t c, double cell, std::vector<std::int32_t>& rows) {
  Made made{};
  made.surfel.reach2 = -1;
  made.residual = kNan;
  gather(cells, c, rows);
  Vec3 hint = Vec3::Zero();
  double counts = 0, variance = 0, slope = 0;
  for (std::int64_t i = cells.begin[c]; i < cells.begin[c + 1]; ++i) {
    const std::int32_t row = cells.rows[i];
    hint += cloud.normals.row(row).transpose();
    counts += cloud.counts[row];
    slope += cloud.slope[row];
    made.noise += cloud.noise[row] / static_cast<float>(cells.begin[c + 1] - cells.begin[c]);
    made.samples += cloud.samples[row];
  }
  const auto own = static_cast<double>(cells.begin[c + 1] - cells.begin[c]);
  if (hint.norm() > 0.1 * own) {
    hint.normalize();
  } else {
    hint.setZero();
  }
  Quadric fit = fit_quadric(cloud.x, rows, mean_of(cloud.x, cells, c), kFitRadius * cell, hint);
  if (!fit.found) return made;
  for (std::int64_t i = cells.begin[c]; i < cells.begin[c + 1]; ++i) {
    const auto row = static_cast<std::size_t>(cells.rows[i]);
    variance += cloud.surface != nullptr ? cloud.surface->variance_along(cloud.rows[row], fit.n) : cloud.variance[row];
  }
  if (fit.n.dot(hint) < 0) fit.n = -fit.n, fit.K = -fit.K;
  const Mat3& K = fit.K;
  Surfel& s = made.surfel;
  for (int k = 0; k < 3; ++k) {
    s.q[k] = static_cast<float>(fit.q[k]);
    s.n[k] = static_cast<float>(fit.n[k]);
  }
  const double six[6] = {K(0, 0), K(0, 1), K(0, 2), K(1, 1), K(1, 2), K(2, 2)};
  for (int k = 0; k < 6; ++k) s.k[k] = static_cast<float>(six[k]);
  s.variance = static_cast<float>(variance / own);
  s.height = static_cast<float>(fit.height);
  s.reach2 = static_cast<float>(kReach * kReach * cell * cell);
  s.counts = counts > 0.5 * own ? 1.0F : 0.0F;
  made.slope = static_cast<float>(slope < 0 ? fit.slope : slope / own);  // of the finest level's fits
  made.residual = fit.residual;
  return made;
}

}  // namespace sgrt
