// The refinement's Jacobian against central differences, and its minimum against a known motion.
#include "registration/refine.hpp"

#include "scenes.hpp"

namespace sgrt {
namespace {

using namespace test;

std::vector<Pair> random_pairs(int n, const Pose& motion, Draw& draw) {
  std::vector<Pair> pairs(static_cast<std::size_t>(n));
  for (Pair& p : pairs) {
    p.y = 100 * draw.vec3();
    p.n = draw.direction();
    p.q = motion * p.y;
    p.weight = draw.uniform(0.1, 1);
    p.live_variance = draw.uniform(0.01, 1);
    p.reference_variance = draw.uniform(0.01, 1);
  }
  return pairs;
}

TEST(Refine, JacobianAgainstCentralDifferences) {
  Draw draw(1);
  const Vec3 pivot(10, -20, 30);
  const std::vector<Pair> pairs = random_pairs(20, displacement(5, 5, pivot, draw), draw);
  const PlaneCost cost(pairs, pivot);
  for (const double turn : {0.0, 1e-6, 1e-3, 0.5, 2.5}) {
    Vec6 x;
    x << turn * draw.direction(), 10 * draw.vec3();
    Eigen::VectorXd r(20), plus(20), minus(20);
    Eigen::MatrixXd J(20, 6);
    ASSERT_TRUE(cost(x.data(), r.data(), J.data()));
    for (int k = 0; k < 6; ++k) {
      const double h = k < 3 ? 1e-5 : 1e-3;
      Vec6 a = x, b = x;
      a[k] += h;
      b[k] -= h;
      cost(a.data(), plus.data(), nullptr);
      cost(b.data(), minus.data(), nullptr);
      const Eigen::VectorXd numeric = (plus - minus) / (2 * h);
      EXPECT_LT((numeric - J.col(k)).norm(), 1e-7 * (1 + J.col(k).norm())) << "parameter " << k << " turn " << turn;
    }
  }
}

TEST(Refine, FindsTheMotion) {
  Draw draw(2);
  const Vec3 pivot(300, 0, -100);
  for (int i = 0; i < 20; ++i) {
    const Pose truth = displacement(20, 20, pivot, draw);
    const Pose found = motion_about(refine(random_pairs(50, truth, draw), pivot), pivot);
    EXPECT_LT((found.R - truth.R).norm(), 1e-8);
    EXPECT_LT((found.t - truth.t).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace sgrt
