// Normals against the analytic ones of planes and spheres; what fixes no plane stays without one.
#include <limits>

#include "core/parallel.hpp"
#include "scenes.hpp"
#include "surface/local_fit.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

using namespace test;

double worst_angle_on_sphere(const Surface& s, const Vec3& centre) {
  double worst = 0;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    worst = std::max(worst, (s.normal(i) - (s.point(i) - centre).normalized()).norm());
  }
  return worst;
}

// REQ-SURF-007
TEST(Normals, PlaneIsExact) {
  Draw draw(1);
  const Pose T = displacement(50, 70, Vec3(1, 2, 3), draw);
  const Surface s = estimate_normals(kSilent, moved(sample(plane, 1000, 0, draw), T), {});
  for (std::int64_t i = 0; i < s.size(); ++i) EXPECT_LT((s.normal(i) - T.R.col(2)).norm(), 1e-7);
}

// REQ-SURF-007
TEST(Normals, SphereToSecondOrderUpToItsBorder) {
  Draw draw(2);
  // 2,800 points on a cap of radius 100: 4.5 mm apart. A plane fit leans by 0.1 rad at the border.
  const Surface s = estimate_normals(kSilent, sample(sphere, 2800, 0, draw), {});
  EXPECT_LT(worst_angle_on_sphere(s, Vec3(0, 0, -60)), 0.01);
}

TEST(Normals, TurnTowardsTheViewpoint) {
  Draw draw(3);
  const Surface cap = sample(sphere, 2000, 0, draw);
  NormalsOptions below;
  below.viewpoint = Vec3(0, 0, -60);
  const Surface s = estimate_normals(kSilent, cap, below);
  for (std::int64_t i = 0; i < s.size(); ++i) EXPECT_LT(s.normal(i).dot(s.point(i) - Vec3(0, 0, -60)), 0);
}

TEST(Normals, GridKeepsItsHoles) {
  Draw draw(4);
  Surface grid = sample(torso, 40 * 50, 0.1, draw);
  grid.height = 40;
  grid.width = 50;
  grid.points.row(77).setConstant(std::numeric_limits<double>::quiet_NaN());
  const Surface s = estimate_normals(kSilent, grid, {});
  EXPECT_EQ(s.height, 40);
  EXPECT_TRUE(std::isnan(s.normals(77, 0)));
  EXPECT_EQ(s.sigma.size(), grid.sigma.size());
  EXPECT_NEAR(s.normal(78).norm(), 1, 1e-12);
}

// REQ-SURF-008
TEST(Normals, LinesAndLonelyPointsHaveNone) {
  Surface line;
  line.points = Points::Zero(40, 3);
  for (int i = 0; i < 30; ++i) line.points(i, 0) = i;
  for (int i = 30; i < 40; ++i) line.points.row(i) << 1000.0 * i, 5000, 0;
  EXPECT_TRUE(estimate_normals(kSilent, line, {}).normals.array().isNaN().all());
}

TEST(Normals, BadInput) {
  Draw draw(5);
  const Surface s = sample(plane, 100, 0, draw);
  expect_error(Status::kInsufficientData, "5 points", [&] {
    Surface five = s;
    five.points.conservativeResize(5, 3);
    estimate_normals(kSilent, five, {});
  });
  NormalsOptions o;
  o.neighbours = 5;
  expect_error(Status::kInvalidArgument, "neighbours is 5", [&] { estimate_normals(kSilent, s, o); });
  o = {};
  o.radius = 0;
  expect_error(Status::kInvalidArgument, "radius_mm is 0", [&] { estimate_normals(kSilent, s, o); });
  o = {};
  o.viewpoint[1] = std::numeric_limits<double>::infinity();
  expect_error(Status::kInvalidArgument, "viewpoint_mm", [&] { estimate_normals(kSilent, s, o); });
}

TEST(Normals, SameBitsAtAnyNumberOfThreads) {
  Draw draw(6);
  const Surface s = sample(torso, 5000, 0.3, draw);
  const Surface one = estimate_normals(kSilent, s, {});
  for (const int threads : {2, 3, 8}) {
    ThreadPool pool(threads);
    sgrt::Run run;
    run.pool = &pool;
    EXPECT_EQ(estimate_normals(run, s, {}).normals, one.normals);
  }
}

TEST(Roughness, IsTheNoise) {
  Draw draw(7);
  for (const double sigma : {0.05, 0.3, 1.0}) {
    const Surface s = sample(torso, 8000, sigma, draw);
    EXPECT_NEAR(roughness(kSilent, s, Nearest(kSilent, s.points)) / sigma, 1, 0.1);
  }
}

}  // namespace
}  // namespace sgrt
