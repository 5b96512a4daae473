// Coarse to fine. docs/theory/icp.md section 3.
#include "registration/search.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "registration/refine.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::int64_t kCoarsePoints = 2000;
constexpr double kSettled = 0.02;  // sigmas: a step that does not matter
constexpr int kSettledSteps = 3;   // so many in a row are a limit cycle of flipping pairs, not progress

// Gauss-Newton's information and gradient over the pairs, turns scaled by 1 / lever.
struct Normal {
  Mat6 A = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  Normal& operator+=(const Normal& o) {
    A += o.A;
    g += o.g;
    return *this;
  }
};

Normal normal_equations(const Run& run, const std::vector<Pair>& pairs, const Vec3& pivot, double lever) {
  const auto n = static_cast<std::int64_t>(pairs.size());
  return parallel_sum(run, n, 4096, Normal{}, [&](std::int64_t begin, std::int64_t end) {
    Normal sum;
    for (std::int64_t i = begin; i < end; ++i) {
      const Pair& p = pairs[static_cast<std::size_t>(i)];
      const double w = p.weight / p.variance();
      Vec6 j;
      j << (p.y - pivot).cross(p.n) / lever, p.n;
      sum.A.noalias() += w * j * j.transpose();
      sum.g -= w * p.r * j;
    }
    return sum;
  });
}

// The step A^-1 g, without the directions that the pairs do not see at all.
Vec6 step_of(const Normal& normal, double lever) {
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(normal.A);
  Vec6 step = Vec6::Zero();
  for (int i = 0; i < 6; ++i) {
    const double lambda = eigen.eigenvalues()[i];
    if (lambda <= 1e-9 * eigen.eigenvalues()[5]) continue;
    step += eigen.eigenvectors().col(i).dot(normal.g) / lambda * eigen.eigenvectors().col(i);
  }
  step.head<3>() /= lever;
  return step;
}

// The farthest that a pair moves, mm.
double farthest(const std::vector<Pair>& pairs, const Vec6& twist, const Vec3& pivot) {
  const Vec3 w = twist.head<3>(), t = twist.tail<3>();
  double most2 = 0;
  for (const Pair& p : pairs) {
    if (p.weight > 0) most2 = std::max(most2, (w.cross(p.y - pivot) + t).squaredNorm());
  }
  return std::sqrt(most2);
}

// The step's length in sigmas of what the pairs determine.
double in_sigmas(const Normal& normal, Vec6 twist, double lever, double scale) {
  twist.head<3>() *= lever;
  return std::sqrt(std::max(0.0, twist.dot(normal.A * twist)) / 6) / scale;
}

// One round: pairs at the pose, weights, step. `solve` makes the step. Returns whether the search has come to rest.
template <class Solve>
bool iterate(const Run& run, const Problem& problem, const IcpOptions& options, std::int64_t step, const Taper& taper,
             double tolerance, double settled, int& settled_count, Search& s, Solve&& solve) {
  ++s.iterations;
  run.poll(static_cast<double>(s.iterations) / options.max_iterations, "registration");
  associate(run, problem, s.pose, {s.limit, std::cos(options.max_angle_deg * kPi / 180), step}, s.pairs);
  if (static_cast<std::int64_t>(s.pairs.size()) < kMinPairs) return true;
  const double scale = robust_scale(s.pairs);
  weigh(s.pairs, scale, taper);
  const Normal normal = normal_equations(run, s.pairs, problem.centre, problem.lever);
  const Vec6 twist = solve(normal);
  s.pose = motion_about(twist, problem.centre) * s.pose;
  const double moved = farthest(s.pairs, twist, problem.centre);
  settled_count = in_sigmas(normal, twist, problem.lever, scale) < settled ? settled_count + 1 : 0;
  // Pairs five times as far apart as the typical one, or three samples, are not of the same skin.
  const double reach = problem.field.reach[s.pairs[s.pairs.size() / 2].reference];
  s.limit = std::min(options.max_distance, std::max(5 * median_distance(s.pairs), 3 * reach));
  return moved < tolerance || settled_count >= kSettledSteps;
}

}  // namespace

Search search(const Run& run, const Problem& problem, const Pose& initial, const IcpOptions& options) {
  Search s{initial, {}, 0, false, options.max_distance};
  const std::int64_t step = std::max<std::int64_t>(1, static_cast<std::int64_t>(problem.rows.size()) / kCoarsePoints);
  int settled = 0;
  while (s.iterations < options.max_iterations) {
    if (iterate(run, problem, options, step, kTukey, 10 * options.step_tolerance, 0.1, settled, s,
                [&](const Normal& normal) { return step_of(normal, problem.lever); })) {
      break;
    }
  }
  settled = 0;
  while (s.iterations < options.max_iterations && static_cast<std::int64_t>(s.pairs.size()) >= kMinPairs &&
         !s.converged) {
    s.converged = iterate(run, problem, options, 1, kInliers, options.step_tolerance, kSettled, settled, s,
                          [&](const Normal&) { return refine(s.pairs, problem.centre); });
  }
  return s;
}

}  // namespace sgrt
