// The square root of the normal equations against the dense residuals it stands for, and the step against its minimum.
#include "registration/refine.hpp"

#include "scenes.hpp"

namespace sgrt {
namespace {

using namespace test;

struct Dense {
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
};

// Random planes and points about the centre; residuals of a motion by `twist` about it.
Dense random_rows(int n, const Vec6& twist, Draw& draw) {
  Dense d{Eigen::MatrixXd(n, 6), Eigen::VectorXd(n)};
  for (int i = 0; i < n; ++i) {
    const Vec3 x = 100 * draw.vec3(), m = draw.direction();
    d.J.row(i) << x.cross(m).transpose(), m.transpose();
    d.r[i] = -d.J.row(i).dot(twist) + 0.01 * gauss(draw);
  }
  return d;
}

Sums sums_of(const Dense& d) {
  Sums s;
  s.A = d.J.transpose() * d.J;
  s.g = d.J.transpose() * d.r;
  s.cost = d.r.squaredNorm();
  return s;
}

TEST(Refine, SevenResidualsStandForAll) {
  Draw draw(1);
  const Dense d = random_rows(50, Vec6::Constant(0.01), draw);
  const Sums s = sums_of(d);
  SquareRoot root;
  ASSERT_TRUE(square_root(s.A, s.g, s.cost, root));
  for (int i = 0; i < 5; ++i) {
    Vec6 x;
    x << 0.01 * draw.vec3(), draw.vec3();
    EXPECT_NEAR((root.f + root.J * x).squaredNorm(), (d.r + d.J * x).squaredNorm(), 1e-9 * s.cost);
  }
  EXPECT_LT((root.J.transpose() * root.J - s.A).norm(), 1e-12 * s.A.norm());
}

TEST(Refine, StepIsThatOfDenseLeastSquaresWhereverTheIsocentreLies) {
  Draw draw(2);
  const Dense d = random_rows(200, Vec6::Constant(0.02), draw);
  const Vec6 expected = d.J.colPivHouseholderQr().solve(-d.r);
  for (const Vec3& iso : {Vec3(0, 0, 0), Vec3(300, -20, 50), Vec3(0, 2000, 0)}) {
    const Vec6 step = refine(sums_of(d), Vec3::Zero(), iso, 100);
    EXPECT_LT((step - expected).norm(), 1e-6 * expected.norm());
  }
  EXPECT_LT((step_of(sums_of(d), 100) - expected).norm(), 1e-9);
}

TEST(Refine, SingularSumsAreNoSquareRoot) {
  Sums s;
  SquareRoot root;
  EXPECT_FALSE(square_root(s.A, s.g, 0, root));
  EXPECT_EQ(refine(s, Vec3::Zero(), Vec3::Zero(), 100), Vec6::Zero());
}

}  // namespace
}  // namespace sgrt
