// The robust solve of a laser unit, see calibration/laser_problem.hpp: Levenberg and Marquardt, weights in between (eq.
// 20 of docs/theory/laser.md).
#include <algorithm>
#include <cmath>

#include "calibration/laser_problem.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

// Levenberg and Marquardt.
int solve(const Run& run, const LaserProblem& p, LaserState& s, int max_iterations) {
  LaserNormal q = normal_of(p, s);
  if (!std::isfinite(q.cost)) fail(Status::kDegenerate, "the start does not explain the stripes at all");
  double damping = 1e-4;
  int iteration = 0;
  for (; iteration < max_iterations; ++iteration) {
    run.poll(static_cast<double>(iteration) / max_iterations, "laser");
    Eigen::MatrixXd H = q.H;
    H.diagonal() *= 1 + damping;
    const LaserState next = stepped(s, H.ldlt().solve(q.g));
    LaserNormal trial = normal_of(p, next);
    if (trial.cost < q.cost) {
      const bool done = q.cost - trial.cost < 1e-9 * q.cost;
      s = next;
      q = std::move(trial);
      damping = std::max(damping / 10, 1e-12);
      if (done) break;
    } else {
      damping *= 10;
      if (damping > 1e8) break;
    }
  }
  return iteration;
}

// Cauchy weights while far, then 0 for what lies beyond the limit; returns the residuals' robust scale.
double weigh(LaserProblem& p, const LaserState& s, double outlier_sigma, bool final) {
  std::vector<double> r = stripe_residuals(p, s), size(r.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    r[i] /= p.sights[i].sigma;
    size[i] = std::isfinite(r[i]) ? std::abs(r[i]) : std::numeric_limits<double>::infinity();
  }
  const double scale = std::max(0.05, 1.4826 * median(size));
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double u = r[i] / (scale * (final ? outlier_sigma : 2));
    p.weight[i] = final ? (std::abs(u) < 1 ? 1 : 0) : 1 / (1 + u * u);
  }
  return scale;
}

}  // namespace

LaserSolution solve_robustly(const Run& run, LaserProblem& p, LaserState& s, const LaserCalibrationOptions& o) {
  constexpr int kRounds = 4;
  LaserSolution solution;
  for (int round = 0; round < kRounds; ++round) {
    weigh(p, s, o.outlier_sigma, round == kRounds - 1);
    solution.iterations += solve(run, p, s, o.max_iterations);
  }
  solution.noise_scale = weigh(p, s, o.outlier_sigma, true);
  return solution;
}

}  // namespace sgrt
