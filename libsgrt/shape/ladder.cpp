// Climbs the ladder of radii at every node. docs/theory/curvature.md eq. 14.
#include "shape/ladder.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "shape/jet.hpp"
#include "shape/outlook.hpp"

namespace sgrt {
namespace {

constexpr double kStep = 1.25;      // of the ladder
constexpr int kBeyond = 2;          // rungs over the largest radius
constexpr double kWidest = 1.15;    // radius of a disc over the smallest radius of curvature
constexpr double kWidestJet = 0.8;  // the same of degrees 3 and 4, which a sphere is no exact case of
constexpr double kOutgrown = 9;     // squared drift over the variance two rungs before
constexpr std::size_t kFirst = 3;   // rungs that stand however noisy
constexpr std::int64_t kBlock = 16;
constexpr double kMixed = 0.8;  // agreement of normals below which each point is asked for its own

std::vector<double> radii_of(const CurvatureOptions& options, double spacing, std::size_t* chosen) {
  *chosen = 1;
  if (options.radius > 0) return {options.radius};
  std::vector<double> radii;
  radii.reserve(kMostDiscs);
  int beyond = 0;
  for (double r = kLeastDisc[options.degree] * spacing; radii.size() < kMostDiscs && beyond < kBeyond; r *= kStep) {
    radii.push_back(r);
    if (radii.size() == 1 || r <= 1.001 * options.max_radius) {
      *chosen = radii.size();
    } else {
      ++beyond;
    }
  }
  return radii;
}

Vec3 normal_of(const SkinCells& cells, std::size_t i) {
  return {cells.nx[i], cells.ny[i], cells.nz[i]};
}

Vec3 mean_normal(const SkinCells& cells, std::size_t first, std::size_t last) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = first; i < last; ++i) sum += normal_of(cells, i);
  const double length = sum.norm();
  return length > 0.1 ? Vec3(sum / length) : normal_of(cells, first);
}

// The point of the cell nearest its points' mean: away from the cell's corners, where two sheets may meet.
std::size_t middle_point(const SkinCells& cells, std::size_t first, std::size_t last) {
  const auto at = [&](std::size_t i) { return Vec3(cells.x[i], cells.y[i], cells.z[i]); };
  Vec3 mean = Vec3::Zero();
  for (std::size_t i = first; i < last; ++i) mean += at(i);
  mean /= static_cast<double>(last - first);
  std::size_t best = first;
  for (std::size_t i = first; i < last; ++i) {
    if ((at(i) - mean).squaredNorm() < (at(best) - mean).squaredNorm()) best = i;
  }
  return best;
}

// Each rung takes its normal and its middle from the one before.
void climb(JetFitter& fitter, const Vec3& x, const Vec3& start, double variance, const std::vector<double>& radii,
           double widest, Rung* rungs) {
  Vec3 foot = x, normal = start;
  for (std::size_t k = 0; k < radii.size(); ++k) {
    const Jet jet = fitter.fit(foot, normal, radii[k]);
    // Few points may lie to one side by chance, or seem steep.
    if (jet.fault == JetFault::kTooFew || jet.fault == JetFault::kBorder) continue;
    if (jet.fault != JetFault::kNone && k < kFirst) continue;
    if (jet.fault != JetFault::kNone) break;
    // Beyond it the disc is no longer a sheet.
    const double k1 = std::abs(0.5 * (jet.a + jet.c)) + std::hypot(0.5 * (jet.a - jet.c), jet.b);
    if (k >= kFirst && radii[k] * (k1 - std::sqrt(variance * jet.covariance.trace())) > widest) break;
    Rung& r = rungs[k];
    r.found = true;
    r.normal = normal = jet.normal;
    r.foot = foot = x - normal * normal.dot(x - jet.foot);
    r.tensor = tensor_of(jet);
    r.variance = variance * (jet.covariance(0, 0) + 2 * jet.covariance(1, 1) + jet.covariance(2, 2));
    // Bias has outgrown noise: larger discs are out of the question, and the drift to here tells enough.
    if (k >= kFirst && rungs[k - 2].found &&
        (r.tensor - rungs[k - 2].tensor).squaredNorm() > kOutgrown * rungs[k - 2].variance)
      break;
  }
}

}  // namespace

Ladder climb_ladders(const Run& run, const Grain& grain, const CurvatureOptions& options) {
  const SkinCells& cells = grain.pyramid.levels[0];
  Ladder l;
  l.radii = radii_of(options, grain.spacing, &l.chosen);
  const auto all = static_cast<std::int64_t>(cells.begin.size()) - 1;
  l.node.assign(static_cast<std::size_t>(all), -1);
  for (std::int64_t c = 0; c < all; ++c) {
    const auto at = static_cast<std::size_t>(c);
    if (cells.begin[at] == cells.begin[at + 1]) continue;
    l.node[at] = static_cast<std::int32_t>(l.cell.size());
    l.cell.push_back(c);
  }
  const std::size_t nodes = l.cell.size();
  l.x.resize(nodes);
  l.normal.resize(nodes);
  l.mixed.resize(nodes);
  l.rungs.resize(nodes * l.radii.size());
  const double widest = options.degree == 2 ? kWidest : kWidestJet;
  parallel_for(
      run, static_cast<std::int64_t>(nodes), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        JetFitter fitter(run, grain.pyramid, options.degree);
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
          const auto cell = static_cast<std::size_t>(l.cell[i]);
          const auto first = static_cast<std::size_t>(cells.begin[cell]);
          const auto last = static_cast<std::size_t>(cells.begin[cell + 1]);
          const std::size_t at = middle_point(cells, first, last);
          l.x[i] = Vec3(cells.x[at], cells.y[at], cells.z[at]);
          l.normal[i] = mean_normal(cells, first, last);
          l.mixed[i] = fitter.agreement(l.x[i], normal_of(cells, at), cells.size) < kMixed ? 1 : 0;
          climb(fitter, l.x[i], l.normal[i], grain.heights.of(cells.row[at]), l.radii, widest,
                l.rungs.data() + i * l.radii.size());
        }
      },
      "curvature: scales");
  return l;
}

}  // namespace sgrt
