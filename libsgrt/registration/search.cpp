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
// A step this many sigmas long does not matter once the steps go to and fro; and that much may stay undecided by it.
constexpr double kSettled = 0.02, kFlicker = 0.25;

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

// Two twists' product in the metric of the information, in which a sigma has length 1.
double product(const Normal& normal, const Vec6& a, const Vec6& b, double lever) {
  Vec6 unit;
  unit << Vec3::Constant(lever), Vec3::Ones();
  return a.cwiseProduct(unit).dot(normal.A * b.cwiseProduct(unit)) / 6;
}

// Takes steps until they come to rest. New pairs make the sum jump, so near the minimum the steps may go to and fro for
// ever between poses a small part of a sigma apart: each turn back halves the gain, so that the search rests in
// between.
class Stage {
 public:
  Stage(const Run& run, const Problem& problem, const IcpOptions& options, bool coarse)
      : run_(run), problem_(problem), options_(options), coarse_(coarse) {
    const auto rows = static_cast<std::int64_t>(problem.rows.size());
    limits_.min_cos = std::cos(options.max_angle_deg * kPi / 180);
    limits_.step = coarse ? std::max<std::int64_t>(1, rows / kCoarsePoints) : 1;
    tolerance_ = coarse ? 10 * options.step_tolerance : options.step_tolerance;
  }

  // One round: pairs at the pose, weights, step. Returns whether the search has come to rest.
  bool iterate(Search& s) {
    ++s.iterations;
    run_.poll(static_cast<double>(s.iterations) / options_.max_iterations, "registration");
    limits_.max_distance = s.limit;
    associate(run_, problem_, s.pose, limits_, s.last, s.pairs);
    if (static_cast<std::int64_t>(s.pairs.size()) < kMinPairs) return false;
    const double scale = robust_scale(s.pairs);
    weigh(s.pairs, scale, coarse_ ? kTukey : kInliers);
    const Normal normal = normal_equations(run_, s.pairs, problem_.centre, problem_.lever);
    const Vec6 step = coarse_ ? step_of(normal, problem_.lever) : refine(s.pairs, problem_.centre);
    gain_ = product(normal, step, last_, problem_.lever) < 0 ? 0.5 * gain_ : std::min(1.0, 1.2 * gain_);
    last_ = step;
    const Vec6 taken = gain_ * step;
    const double moved = farthest(s.pairs, taken, problem_.centre);
    s.pose = motion_about(taken, problem_.centre) * s.pose;
    // Pairs five times as far apart as the typical one are not of the same skin, unless sampling alone does it.
    s.limit = std::min(options_.max_distance, std::max(5 * median_distance(s.pairs), 3 * problem_.spacing));
    const double sigmas = std::sqrt(product(normal, step, step, problem_.lever)) / scale;
    if (coarse_ && sigmas < kFlicker) return true;
    return gain_ < 1 ? sigmas < kSettled || (moved < tolerance_ && sigmas < kFlicker) : moved < tolerance_;
  }

 private:
  const Run& run_;
  const Problem& problem_;
  const IcpOptions& options_;
  const bool coarse_;
  PairLimits limits_{};
  double tolerance_;
  double gain_ = 1;
  Vec6 last_ = Vec6::Zero();
};

}  // namespace

Search search(const Run& run, const Problem& problem, const Pose& initial, const IcpOptions& options) {
  Search s{initial, {}, std::vector<std::int64_t>(problem.rows.size(), -1), 0, false, options.max_distance};
  const auto enough = [&] { return static_cast<std::int64_t>(s.pairs.size()) >= kMinPairs; };
  for (const bool coarse : {true, false}) {
    Stage stage(run, problem, options, coarse);
    const int end = coarse ? std::max(1, options.max_iterations / 2) : options.max_iterations;
    for (bool rest = false; !rest && s.iterations < end;) {
      rest = stage.iterate(s);
      if (!enough()) return s;
      s.converged = rest && !coarse;
    }
  }
  return s;
}

}  // namespace sgrt
