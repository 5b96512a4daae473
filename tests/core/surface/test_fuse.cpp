// Fusion: weights, what is dropped, disagreement measured and predicted.
#include <array>
#include <limits>

#include "scenes.hpp"
#include "surface/fuse.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

using namespace test;

// A flat patch 100 x 100 mm, 2 mm apart, its corner at (x0, 0, z).
Surface patch(double x0, double z, double sigma) {
  Surface s;
  s.points.resize(51 * 51, 3);
  for (int i = 0; i < 51; ++i) {
    for (int j = 0; j < 51; ++j) s.points.row(51 * i + j) << x0 + 2 * j, 2 * i, z;
  }
  s.normals = Points::Zero(s.size(), 3);
  s.normals.col(2).setOnes();
  if (sigma > 0) s.sigma = Eigen::VectorXd::Constant(s.size(), sigma);
  return s;
}

// REQ-SURF-009
TEST(Fuse, OverlapMovesByInverseVariances) {
  Surface a = patch(0, 0, 0.1), b = patch(50, 0.5, 0.2);
  b.correlation_points = 100;  // so that a blend is no better than a point
  const Fusion f = fuse(kSilent, {&a, &b}, {});
  EXPECT_EQ(f.overlap_count, 26 * 51 + 51);  // and the column within reach of b's border
  EXPECT_NEAR(f.disagreement_mean, 0.5, 1e-12);
  EXPECT_NEAR(f.disagreement_rms, 0.5, 1e-12);
  EXPECT_NEAR(f.disagreement_expected, std::sqrt(0.05), 1e-12);
  EXPECT_EQ(f.surface.correlation_points, 100);
  for (std::int64_t i = 0; i < f.surface.size(); ++i) {
    const double x = f.surface.points(i, 0), z = f.surface.points(i, 2);
    if (x < 47) EXPECT_EQ(z, 0);
    if (x > 50 && x < 100) {
      EXPECT_NEAR(z, 0.1, 1e-12);  // 0.5 * 0.01 / (0.01 + 0.04)
      EXPECT_NEAR(f.surface.sigma[i], std::sqrt(0.01 * 0.04 / 0.05), 1e-12);
    }
    if (x > 103) EXPECT_EQ(z, 0.5);
  }
  EXPECT_NEAR(static_cast<double>(f.surface.size()), 51 * 76, 60);
  // No seam: a column of points every 2 mm, also where the overlap ends.
  std::array<int, 76> columns{};
  for (std::int64_t i = 0; i < f.surface.size(); ++i)
    ++columns[static_cast<std::size_t>(std::lround(f.surface.points(i, 0) / 2))];
  for (const int n : columns) EXPECT_GE(n, 51);
}

// REQ-SURF-010
TEST(Fuse, DisagreementOfNoiseIsAsPredicted) {
  Draw draw(1);
  for (const double sigma_b : {0.1, 0.4}) {
    const Surface a = estimate_normals(kSilent, sample(torso, 8000, 0.2, draw), {});
    const Surface b = estimate_normals(kSilent, sample(torso, 8000, sigma_b, draw), {});
    const Fusion f = fuse(kSilent, {&a, &b}, {});
    EXPECT_GT(f.overlap_count, 7500);
    EXPECT_LT(std::abs(f.disagreement_mean), 0.02);
    EXPECT_NEAR(f.disagreement_rms / f.disagreement_expected, 1, 0.15);
    // Nothing is left of the doubled points, and the merged ones are better than either.
    EXPECT_LT(f.surface.size(), 8600);
    EXPECT_LT(f.surface.sigma.minCoeff(), std::min(0.2, sigma_b));
  }
}

// REQ-SURF-009
TEST(Fuse, CovarianceShrinksAlongTheNormalOnly) {
  Surface a = patch(0, 0, 0), b = patch(0, 0, 0);
  a.covariance = Covariances::Zero(a.size(), 6);
  a.covariance.col(0).setConstant(4);
  a.covariance.col(3).setConstant(9);
  a.covariance.col(5).setConstant(1);
  b.covariance = a.covariance;
  b.correlation_points = 100;
  const Fusion f = fuse(kSilent, {&a, &b}, {});
  const auto c = f.surface.covariance.row(700);
  EXPECT_NEAR(c[0], 4, 1e-12);
  EXPECT_NEAR(c[3], 9, 1e-12);
  EXPECT_NEAR(c[5], 0.5, 1e-12);
  EXPECT_NEAR(f.surface.sigma[700], std::sqrt(0.5), 1e-12);
}

TEST(Fuse, ApartNothingIsMerged) {
  const Surface a = patch(0, 0, 0.1), b = patch(0, 10, 0.1);
  const Fusion f = fuse(kSilent, {&a, &b}, {});
  EXPECT_EQ(f.surface.size(), a.size() + b.size());
  EXPECT_EQ(f.overlap_count, 0);
  EXPECT_TRUE(std::isnan(f.disagreement_mean) && std::isnan(f.disagreement_rms) && std::isnan(f.disagreement_expected));
}

TEST(Fuse, OppositeSheetsAreNotOneSkin) {
  const Surface a = patch(0, 0, 0.1);
  Surface b = patch(0, -1, 0.1);
  b.normals *= -1;
  EXPECT_EQ(fuse(kSilent, {&a, &b}, {}).surface.size(), a.size() + b.size());
}

TEST(Fuse, OneSurfaceLosesItsHolesAlone) {
  Surface a = patch(0, 0, 0.1);
  a.height = a.width = 51;
  a.points.row(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  const Fusion f = fuse(kSilent, {&a}, {});
  EXPECT_EQ(f.surface.size(), a.size() - 1);
  EXPECT_FALSE(f.surface.organised());
  EXPECT_EQ(f.surface.point(3), a.point(4));
}

TEST(Fuse, CarriesCommonModesAndOnlyWhatAllHave) {
  Surface a = patch(0, 0, 0.1), b = patch(50, 0, 0);
  a.modes = {Points::Constant(a.size(), 3, 1)};
  b.modes = {Points::Constant(b.size(), 3, 2)};
  const Fusion f = fuse(kSilent, {&a, &b}, {});
  EXPECT_EQ(f.surface.sigma.size(), 0);
  EXPECT_TRUE(std::isnan(f.disagreement_expected));
  ASSERT_EQ(f.surface.modes.size(), 1u);
  for (std::int64_t i = 0; i < f.surface.size(); ++i) {
    const double x = f.surface.points(i, 0);
    EXPECT_NEAR(f.surface.modes[0](i, 2), x < 47 ? 1 : x > 103 ? 2 : f.surface.modes[0](i, 2), 1e-12);
    if (x > 50 && x < 100) EXPECT_NEAR(f.surface.modes[0](i, 2), 1.5, 1e-12);
  }
  a.mode_names = {"cause"};
  b.mode_names = {"another"};
  const Surface apart = fuse(kSilent, {&a, &b}, {}).surface;  // of different causes: neither is kept
  EXPECT_TRUE(apart.modes.empty() && apart.mode_names.empty());
  b.mode_names.clear();
  b.modes.clear();
  EXPECT_TRUE(fuse(kSilent, {&a, &b}, {}).surface.modes.empty());
}

TEST(Fuse, BadInput) {
  Surface a = patch(0, 0, 0.1), bare = a;
  bare.normals.resize(0, 3);
  expect_error(Status::kInvalidArgument, "surfaces is empty", [&] { fuse(kSilent, {}, {}); });
  expect_error(Status::kInvalidArgument, "surfaces[1] has no normals", [&] { fuse(kSilent, {&a, &bare}, {}); });
  expect_error(Status::kInvalidArgument, "max_distance_mm is 0", [&] { fuse(kSilent, {&a}, {0, 60}); });
  expect_error(Status::kInvalidArgument, "max_angle_deg is 91", [&] { fuse(kSilent, {&a}, {3, 91}); });
}

}  // namespace
}  // namespace sgrt
