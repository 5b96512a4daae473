// Spatial filter: noise falls as predicted, curved skin stays curved, edges stay sharp, outliers go, holes stay holes.
#include "surface/filter.hpp"

#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "scenes.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// z(x, y) on a grid with spacing 1 mm, with its exact normals and noise along them.
Surface grid_of(int height, int width, double sigma, Draw& draw, const std::function<double(double, double)>& z) {
  Surface s;
  s.height = height;
  s.width = width;
  s.points.resize(height * width, 3);
  s.normals.resize(height * width, 3);
  s.sigma = Eigen::VectorXd::Constant(height * width, sigma);
  constexpr double kStep = 1e-4;
  for (int i = 0; i < height * width; ++i) {
    const double x = i % width - 0.5 * width, y = i / width - 0.5 * height;
    const Vec3 n =
        Vec3(-(z(x + kStep, y) - z(x - kStep, y)) / (2 * kStep), -(z(x, y + kStep) - z(x, y - kStep)) / (2 * kStep), 1)
            .normalized();
    s.points.row(i) = (Vec3(x, y, z(x, y)) + sigma * gauss(draw) * n).transpose();
    s.normals.row(i) = n.transpose();
  }
  return s;
}
double dome(double x, double y) {  // a sphere of radius 80
  return std::sqrt(80 * 80 - x * x - y * y);
}
double step(double x, double /*y*/) {
  return x < 0 ? 0 : 5;
}

// REQ-SURF-013
TEST(Filter, NoiseFallsAsPredictedOnACurvedSurface) {
  Draw draw(1);
  const Surface noisy = grid_of(60, 60, 0.3, draw, dome);
  FilterOptions options;
  options.radius = 5;
  const Filtered f = filter(kSilent, noisy, options);
  double chi2 = 0, bias = 0, count = 0;
  for (std::int64_t i = 0; i < noisy.size(); ++i) {
    if (f.reason[static_cast<std::size_t>(i)] != FilterReason::kFiltered) continue;
    const double error = f.surface.point(i).norm() - 80;
    chi2 += std::pow(error / f.surface.sigma[i], 2);
    bias += error;
    ++count;
  }
  EXPECT_GT(count, 3590);
  EXPECT_NEAR(std::sqrt(chi2 / count), 1, 0.1);  // neighbours share noise: fewer independent errors than points
  EXPECT_LT(std::abs(bias / count), 0.02);
  EXPECT_LT(f.sigma_after, 0.4 * f.sigma_before);
  // What averages away over a patch is kept: sigma^2 times the points that share it.
  EXPECT_NEAR(f.surface.correlation_points * f.sigma_after * f.sigma_after, 0.09, 0.01);
}

TEST(Filter, NormalsOfTheQuadricAreBetter) {
  Draw draw(2);
  Surface noisy = grid_of(60, 60, 0.1, draw, dome);
  NormalsOptions near;
  near.neighbours = 9;
  noisy = estimate_normals(kSilent, noisy, near);
  FilterOptions options;
  options.radius = 5;
  const Filtered f = filter(kSilent, noisy, options);
  double before = 0, after = 0;
  for (std::int64_t i = 0; i < noisy.size(); ++i) {
    const Vec3 truth = f.surface.point(i).normalized();
    before += (noisy.normal(i) - truth).squaredNorm();
    after += (f.surface.normal(i) - truth).squaredNorm();
  }
  EXPECT_LT(std::sqrt(after), 0.5 * std::sqrt(before));
}

// REQ-SURF-013
TEST(Filter, AnEdgeStaysSharp) {
  Draw draw(3);
  Surface s = grid_of(40, 40, 0, draw, step);
  for (std::int64_t i = 0; i < s.size(); ++i) {
    s.points(i, 2) = step(s.points(i, 0), 0) + 0.1 * gauss(draw);
    s.normals.row(i) << 0, 0, 1;
  }
  s.sigma.setConstant(0.1);
  const Filtered f = filter(kSilent, s, {});
  for (std::int64_t i = 0; i < s.size(); ++i) {
    EXPECT_LT(std::abs(f.surface.points(i, 2) - step(s.points(i, 0), 0)), 0.4) << f.surface.points.row(i);
  }
  EXPECT_EQ(f.count[static_cast<std::size_t>(FilterReason::kOutlier)], 0);
}

// REQ-SURF-014
TEST(Filter, OutliersGoAndHolesStay) {
  Draw draw(4);
  Surface s = grid_of(40, 40, 0.1, draw, dome);
  for (const int i : {300, 301, 901}) s.points(i, 2) += 4;  // a pair and one alone
  s.points.row(777).setConstant(kNan);
  const Filtered f = filter(kSilent, s, {});
  for (const int i : {300, 301, 901}) {
    EXPECT_EQ(f.reason[static_cast<std::size_t>(i)], FilterReason::kOutlier) << i;
    EXPECT_FALSE(f.surface.present(i));
  }
  EXPECT_EQ(f.reason[777], FilterReason::kAbsent);
  EXPECT_FALSE(f.surface.present(777));
  EXPECT_EQ(f.count[static_cast<std::size_t>(FilterReason::kOutlier)], 3);
  EXPECT_EQ(f.surface.height, 40);
}

TEST(Filter, ACloudLosesItsOutliersARowEach) {
  Draw draw(5);
  Surface s = grid_of(40, 40, 0.1, draw, dome);
  s.height = s.width = 0;
  s.points(500, 2) += 4;
  const Filtered f = filter(kSilent, s, {});
  EXPECT_EQ(f.surface.size(), 1599);
  EXPECT_EQ(f.reason.size(), 1600U);
  EXPECT_NEAR(f.surface.point(500).norm(), 80, 0.3);  // the next row moved up
}

TEST(Filter, AMeshKeepsTheFacesOfWhatIsLeft) {
  Draw draw(6);
  Surface s = grid_of(20, 20, 0.05, draw, dome);
  s.height = s.width = 0;
  s.faces.resize(2 * 19 * 19, 3);
  for (int r = 0, f = 0; r < 19; ++r) {
    for (int c = 0; c < 19; ++c) {
      const int a = 20 * r + c;
      s.faces.row(f++) << a, a + 1, a + 20;
      s.faces.row(f++) << a + 1, a + 21, a + 20;
    }
  }
  s.points(210, 2) += 3;
  const Filtered f = filter(kSilent, s, {});
  EXPECT_EQ(f.surface.size(), 399);
  EXPECT_EQ(f.surface.faces.rows(), 2 * 19 * 19 - 6);
  EXPECT_LT(f.surface.faces.maxCoeff(), 399);
}

TEST(Filter, SharedNoiseIsNotAveragedAway) {
  Draw draw(7);
  Surface s = grid_of(30, 30, 0.1, draw, dome);
  s.correlation_points = 49;  // more than the window holds
  const Filtered f = filter(kSilent, s, {});
  EXPECT_EQ(f.count[static_cast<std::size_t>(FilterReason::kKept)], 900);
  EXPECT_EQ(f.surface.points, s.points);
}

TEST(Filter, AShapeThatNoQuadricFollowsHasALargerSigma) {
  Draw draw(8);
  const auto waves = [](double x, double y) { return 0.5 * std::sin(x) * std::sin(y); };
  Surface s = grid_of(40, 40, 0.2, draw, waves);
  for (std::int64_t i = 0; i < s.size(); ++i) s.normals.row(i) << 0, 0, 1;
  FilterOptions options;
  options.radius = 5;
  const Filtered f = filter(kSilent, s, options);
  double chi2 = 0, count = 0;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    if (f.reason[static_cast<std::size_t>(i)] != FilterReason::kFiltered) continue;
    const Vec3 x = f.surface.point(i);
    chi2 += std::pow((x.z() - waves(x.x(), x.y())) / f.surface.sigma[i], 2);
    ++count;
  }
  ASSERT_GT(count, 0);
  EXPECT_LT(std::sqrt(chi2 / count), 2.6);  // 3.5 were the lack of fit not counted
}

TEST(Filter, CovarianceChangesAlongTheNormalAlone) {
  Draw draw(9);
  Surface s = grid_of(30, 30, 0.2, draw, [](double, double) { return 0.0; });
  s.covariance = Covariances::Zero(900, 6);
  s.covariance.col(0).setConstant(0.01);
  s.covariance.col(3).setConstant(0.02);
  s.covariance.col(5).setConstant(0.04);
  const Filtered f = filter(kSilent, s, {});
  EXPECT_NEAR(f.surface.covariance(435, 0), 0.01, 1e-12);
  EXPECT_NEAR(f.surface.covariance(435, 3), 0.02, 1e-12);
  EXPECT_NEAR(f.surface.covariance(435, 5), std::pow(f.surface.sigma[435], 2), 1e-12);
}

TEST(Filter, RoughnessStandsForAMissingSigma) {
  Draw draw(10);
  Surface s = grid_of(60, 60, 0.3, draw, dome);
  s.sigma.resize(0);
  const Filtered f = filter(kSilent, s, {});
  EXPECT_NEAR(f.sigma_before, 0.3, 0.03);
  EXPECT_EQ(f.surface.sigma.size(), s.size());
}

// REQ-DET-009
TEST(Filter, SameBitsAtAnyThreadCount) {
  Draw draw(11);
  const Surface s = grid_of(60, 60, 0.3, draw, dome);
  const Filtered one = filter(kSilent, s, {});
  for (const int threads : {2, 3, 8}) {
    ThreadPool pool(threads);
    EXPECT_EQ(filter(sgrt::Run{&pool}, s, {}).surface.points, one.surface.points) << threads;
  }
}

TEST(Filter, Refuses) {
  Draw draw(12);
  Surface s = grid_of(20, 20, 0.1, draw, dome);
  FilterOptions o;
  o.radius = -1;
  expect_error(Status::kInvalidArgument, "radius_mm is -1", [&] { filter(kSilent, s, o); });
  o = {};
  o.max_sigmas = kNan;
  expect_error(Status::kInvalidArgument, "max_sigmas", [&] { filter(kSilent, s, o); });
  o = {};
  o.min_support = 1;
  expect_error(Status::kInvalidArgument, "min_support is 1", [&] { filter(kSilent, s, o); });
  s.normals.resize(0, 3);
  expect_error(Status::kInvalidArgument, "no normals", [&] { filter(kSilent, s, {}); });
  Surface twins;  // all points equal: no spacing
  twins.points = Points::Constant(20, 3, 1);
  twins.normals = Points::Constant(20, 3, std::sqrt(1.0 / 3));
  twins.sigma = Eigen::VectorXd::Constant(20, 0.1);
  expect_error(Status::kInsufficientData, "spacing", [&] { filter(kSilent, twins, {}); });
}

}  // namespace
}  // namespace sgrt
