// What a surface accepts, height fields, vertex normals.
#include "core/surface.hpp"

#include <cmath>
#include <functional>
#include <limits>

#include "expect.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// Six points with everything that a surface can carry.
Surface full_cloud() {
  Surface s;
  s.points = Points::Random(6, 3) * 100;
  s.normals = Points::Zero(6, 3);
  s.normals.col(2).setOnes();
  s.sigma = Eigen::VectorXd::Constant(6, 0.3);
  s.covariance = Covariances::Zero(6, 6);
  s.covariance.col(0).setConstant(0.01);
  s.covariance.col(3).setConstant(0.02);
  s.covariance.col(5).setConstant(0.09);
  s.modes.assign(2, Points::Constant(6, 3, 0.05));
  return s;
}

Surface full_grid() {
  Surface s = full_cloud();
  s.height = 2;
  s.width = 3;
  return s;
}

Surface full_mesh() {
  Surface s = full_cloud();
  s.faces.resize(2, 3);
  s.faces << 0, 1, 2, 3, 4, 5;
  return s;
}

using Change = std::function<void(Surface&)>;

void expect_refused(Surface s, const Change& change, const std::string& words,
                    Status status = Status::kInvalidArgument) {
  change(s);
  expect_error(status, words, [&] { make_surface(s); });
}

TEST(Surface, KeptRowsKeepAllThatTheyCarry) {
  Surface mesh = full_mesh();
  mesh.faces.resize(3, 3);
  mesh.faces << 0, 1, 2, 3, 4, 5, 2, 4, 5;
  for (Eigen::Index i = 0; i < 6; ++i) mesh.sigma[i] = 0.1 * static_cast<double>(i + 1), mesh.modes[1](i, 0) = i;
  const Surface left = kept(mesh, {true, true, true, false, true, true});
  ASSERT_EQ(left.size(), 5);
  const int from[] = {0, 1, 2, 4, 5};
  for (Eigen::Index i = 0; i < 5; ++i) {
    EXPECT_EQ(left.points.row(i), mesh.points.row(from[i]));
    EXPECT_EQ(left.sigma[i], mesh.sigma[from[i]]);
    EXPECT_EQ(left.covariance.row(i), mesh.covariance.row(from[i]));
    EXPECT_EQ(left.modes[1](i, 0), from[i]);
  }
  Faces faces(2, 3);  // the triangle of the point that went is gone, the others name their points anew
  faces << 0, 1, 2, 2, 3, 4;
  EXPECT_EQ(left.faces, faces);
  // A grid keeps its shape.
  const Surface grid = kept(full_grid(), {true, false, true, true, true, true});
  EXPECT_EQ(grid.size(), 6);
  EXPECT_FALSE(grid.present(1));
  EXPECT_TRUE(grid.present(0) && std::isnan(grid.modes[0](1, 2)) && std::isnan(grid.sigma[1]));
  expect_error(Status::kInsufficientData, "no point is left", [&] {
    kept(mesh, {false, false, false, false, false, false});
  });
}

TEST(Surface, TakesWhatIsGood) {
  EXPECT_EQ(make_surface(full_cloud()).size(), 6);
  EXPECT_TRUE(make_surface(full_grid()).organised());
  EXPECT_EQ(make_surface(full_mesh()).faces.rows(), 2);
  Surface bare;
  bare.points = Points::Zero(1, 3);
  EXPECT_FALSE(make_surface(bare).has_normals());
}

// REQ-SURF-005
TEST(Surface, NoPoint) {
  expect_refused(
      {}, [](Surface&) {}, "no point", Status::kInsufficientData);
  expect_refused(
      full_grid(), [](Surface& s) { s.points.setConstant(kNaN); }, "no point", Status::kInsufficientData);
}

// REQ-SURF-005
TEST(Surface, TooManyPoints) {
  // Only the count is looked at first: the map below lends no memory.
  Surface s;
  s.points.resize(0, 3);
  s.height = 10'000'000'000;
  s.width = 10'000'000'000;
  s.points.setZero(1, 3);
  expect_error(Status::kInvalidArgument, "height * width",
               [&] { make_surface(s); });  // and their product does not overflow
}

// REQ-SURF-002
TEST(Surface, BadCoordinatesAreNamed) {
  for (double bad : {kNaN, kInf, -kInf, 1.1e5, -1e300}) {
    expect_refused(
        full_cloud(), [&](Surface& s) { s.points(4, 1) = bad; }, "points[4]");
    expect_refused(
        full_grid(), [&](Surface& s) { s.points(4, 1) = bad; }, "points[1, 1]");
    expect_refused(
        full_mesh(), [&](Surface& s) { s.points(0, 2) = bad; }, "points[0]");
  }
  expect_refused(
      full_cloud(), [](Surface& s) { s.points.row(2).setConstant(kNaN); }, "points[2]");
  Surface at_the_limit = full_cloud();
  at_the_limit.points(0, 0) = -1e5;
  make_surface(at_the_limit);
}

// REQ-SURF-003
TEST(Surface, AbsentGridPointsNeedNothing) {
  Surface s = full_grid();
  s.points.row(4).setConstant(kNaN);
  s.normals.row(4).setConstant(kNaN);
  s.sigma(4) = kNaN;
  s.covariance.row(4).setConstant(kNaN);
  for (Points& mode : s.modes) mode.row(4).setConstant(kNaN);
  const Surface made = make_surface(s);
  EXPECT_FALSE(made.present(4));
  EXPECT_TRUE(made.present(3));
}

// REQ-SURF-004
TEST(Surface, BadNormals) {
  expect_refused(
      full_cloud(), [](Surface& s) { s.normals(3, 2) = 1.01; }, "normals[3]: expected a unit vector");
  expect_refused(
      full_cloud(), [](Surface& s) { s.normals(3, 0) = kNaN; }, "normals[3]");
  expect_refused(
      full_cloud(), [](Surface& s) { s.normals(3, 0) = kInf; }, "normals[3]");
  expect_refused(
      full_cloud(), [](Surface& s) { s.normals.row(3).setZero(); }, "normals[3]");
  expect_refused(
      full_cloud(), [](Surface& s) { s.normals.conservativeResize(5, 3); }, "normals: expected one a point, 6, got 5");
  Surface unknown = full_cloud();
  unknown.normals.row(3).setConstant(kNaN);  // all three: the normal is not known
  unknown.normals(2, 2) = 1.0009;
  make_surface(unknown);
}

// REQ-SURF-004
TEST(Surface, BadSigma) {
  for (double bad : {0.0, -0.1, kNaN, kInf, 1e6}) {
    expect_refused(
        full_cloud(), [&](Surface& s) { s.sigma(5) = bad; }, "sigma_mm[5]");
  }
  expect_refused(
      full_grid(), [](Surface& s) { s.sigma.conservativeResize(3); }, "sigma_mm: expected one a point");
}

// REQ-SURF-004
TEST(Surface, BadCovariance) {
  for (double bad : {kNaN, kInf, -kInf, 1e11}) {
    for (int k = 0; k < 6; ++k) {
      expect_refused(
          full_cloud(), [&](Surface& s) { s.covariance(1, k) = bad; }, "covariance[1]");
    }
  }
  for (int k : {0, 3, 5})
    expect_refused(
        full_cloud(), [&](Surface& s) { s.covariance(1, k) = -1e-9; }, "positive semi-definite");
  for (int k : {1, 2, 4})
    expect_refused(
        full_cloud(), [&](Surface& s) { s.covariance(1, k) = 0.05; }, "positive semi-definite");
  // Every 2 x 2 minor is fine, the determinant is not.
  expect_refused(
      full_cloud(), [](Surface& s) { s.covariance.row(2) << 1, 0.8, 0.8, 1, -0.8, 1; }, "positive semi-definite");
  expect_refused(
      full_cloud(), [](Surface& s) { s.covariance.conservativeResize(2, 6); }, "covariance: expected one a point");
}

// Against the eigenvalues, and with what float32 leaves of a matrix of rank one.
TEST(Surface, CovarianceTestAgreesWithEigenvalues) {
  Draw draw(3);
  int good = 0, bad = 0;
  for (int i = 0; i < 3000; ++i) {
    Mat3 C;
    const Vec3 n = draw.direction(), m = draw.direction();
    if (i % 3 == 0) {
      C = draw.uniform(1e-6, 10) * n * n.transpose();
    } else {
      C = n * n.transpose() + draw.uniform(-0.5, 0.5) * m * m.transpose() + draw.uniform(-0.1, 0.5) * Mat3::Identity();
    }
    Surface s;
    s.points = Points::Zero(1, 3);
    s.covariance.resize(1, 6);
    s.covariance.row(0) << C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2);
    s.covariance = s.covariance.cast<float>().cast<double>().eval();
    const double least = Eigen::SelfAdjointEigenSolver<Mat3>(C).eigenvalues()(0);
    if (least > -1e-12) {
      ++good;
      EXPECT_NO_THROW(make_surface(s)) << C;
    } else if (least < -1e-3) {
      ++bad;
      EXPECT_THROW(make_surface(s), Error) << C;
    }
  }
  EXPECT_GT(good, 1000);
  EXPECT_GT(bad, 500);
}

// REQ-SURF-004
TEST(Surface, BadModes) {
  expect_refused(
      full_cloud(), [](Surface& s) { s.modes.assign(9, Points::Zero(6, 3)); }, "modes: expected at most 8, got 9");
  expect_refused(
      full_cloud(), [](Surface& s) { s.modes[1] = Points::Zero(5, 3); }, "modes: expected 6 rows");
  expect_refused(
      full_cloud(), [](Surface& s) { s.modes[1](2, 0) = kNaN; }, "modes[1][2]");
}

// REQ-SURF-004
TEST(Surface, BadFaces) {
  for (int bad : {-1, 6, std::numeric_limits<int>::max()}) {
    expect_refused(
        full_mesh(), [&](Surface& s) { s.faces(1, 2) = bad; },
        "faces[1, 2]: expected 0 to 5, got " + std::to_string(bad));
  }
  expect_refused(
      full_grid(), [](Surface& s) { s.faces = Faces::Zero(1, 3); }, "faces: a grid has none");
}

TEST(Surface, BadShapes) {
  expect_refused(
      full_grid(), [](Surface& s) { s.width = 4; }, "height * width");
  expect_refused(
      full_grid(), [](Surface& s) { s.width = 0; }, "grid");
  expect_refused(
      full_grid(),
      [](Surface& s) {
        s.height = -2;
        s.width = -3;
      },
      "grid");
  for (double bad : {kNaN, kInf, 0.5, -1.0}) {
    expect_refused(
        full_cloud(), [&](Surface& s) { s.correlation_points = bad; }, "correlation_points");
  }
}

TEST(Surface, VarianceAlong) {
  Surface s = full_cloud();
  Mat3 C;
  C << 2, 0.3, 0.1, 0.3, 1, -0.2, 0.1, -0.2, 3;
  s.covariance.row(1) << C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2);
  Draw draw(4);
  for (int i = 0; i < 100; ++i) {
    const Vec3 n = draw.direction();
    EXPECT_NEAR(s.variance_along(1, n), n.dot(C * n), 1e-14);
  }
  s.covariance.resize(0, 6);
  EXPECT_DOUBLE_EQ(s.variance_along(1, Vec3::UnitX()), 0.09);
  s.sigma.resize(0);
  EXPECT_TRUE(std::isnan(s.variance_along(1, Vec3::UnitX())));
}

TEST(Surface, MeshGetsNormals) {
  // A unit cube's corner: three faces of unequal area about vertex 0, counter-clockwise seen from outside.
  Surface s;
  s.points.resize(5, 3);
  s.points << 0, 0, 0, -1, 0, 0, 0, -2, 0, 0, 0, -3, 9, 9, 9;
  s.faces.resize(3, 3);
  s.faces << 0, 1, 2, 0, 2, 3, 0, 3, 1;
  const Surface made = make_surface(s);
  EXPECT_LT((made.normal(0) - Vec3(6, 3, 2).normalized()).norm(), 1e-15);  // areas 1, 3, 1.5 along z, x, y
  EXPECT_TRUE(std::isnan(made.normals(4, 0)) && std::isnan(made.normals(4, 1)) && std::isnan(made.normals(4, 2)));
  s.normals = Points::Zero(5, 3);
  s.normals.col(0).setOnes();
  EXPECT_EQ(make_surface(s).normal(0), Vec3::UnitX());  // those given stay
}

TEST(Surface, SphereMeshNormals) {
  constexpr int n = 60;
  Surface s;
  s.points.resize(n * n, 3);
  std::vector<int> faces;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double theta = 0.5 + 2.0 * i / n, phi = 2.0 * j / n;
      s.points.row(i * n + j) << 90 * std::sin(theta) * std::cos(phi), 90 * std::sin(theta) * std::sin(phi),
          90 * std::cos(theta);
      if (i + 1 < n && j + 1 < n) {
        const int a = i * n + j, b = a + 1, c = a + n, d = c + 1;
        for (int v : {a, c, b, b, c, d}) faces.push_back(v);
      }
    }
  }
  s.faces = Eigen::Map<Faces>(faces.data(), static_cast<Eigen::Index>(faces.size() / 3), 3);
  const Surface made = make_surface(s);
  for (int i = 1; i + 1 < n; ++i) {
    for (int j = 1; j + 1 < n; ++j) EXPECT_GT(made.normal(i * n + j).dot(made.point(i * n + j)) / 90, 1 - 1e-5);
  }
}

using Heights = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// REQ-SURF-006
TEST(HeightField, PlaneIsExactWhateverTheSignOfTheSpacing) {
  for (const Vec2& spacing : {Vec2(2, 3), Vec2(-2, 3), Vec2(2, -3)}) {
    Heights z(4, 5);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 5; ++j) z(i, j) = 0.5 * (10 + j * spacing.x()) - 0.25 * (20 + i * spacing.y()) + 7;
    }
    z(1, 2) = kNaN;
    const Surface s = surface_from_height_field(z, Vec2(10, 20), spacing);
    EXPECT_EQ(s.height, 4);
    EXPECT_EQ(s.width, 5);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 5; ++j) {
        const std::int64_t k = i * 5 + j;
        EXPECT_EQ(s.present(k), !(i == 1 && j == 2));
        if (!s.present(k)) continue;
        EXPECT_EQ(s.point(k), Vec3(10 + j * spacing.x(), 20 + i * spacing.y(), z(i, j)));
        if (i == 0 && j == 2) {  // the border beside the hole: no slope along y
          EXPECT_TRUE(s.normal(k).array().isNaN().all());
          continue;
        }
        EXPECT_LT((s.normal(k) - Vec3(-0.5, 0.25, 1).normalized()).norm(), 1e-14);
      }
    }
  }
}

TEST(HeightField, NormalsOfADomeAreOfSecondOrder) {
  double worst[2];
  for (int refinement = 0; refinement < 2; ++refinement) {
    const int n = 41 << refinement;
    const double h = 80.0 / (n - 1);
    Heights z(n, n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) z(i, j) = std::sqrt(100 * 100 - std::pow(-40 + j * h, 2) - std::pow(-40 + i * h, 2));
    }
    const Surface s = surface_from_height_field(z, Vec2(-40, -40), Vec2(h, h));
    worst[refinement] = 0;
    for (int i = 1; i + 1 < n; ++i) {
      for (int j = 1; j + 1 < n; ++j) {
        const std::int64_t k = i * n + j;
        worst[refinement] = std::max(worst[refinement], (s.normal(k) - s.point(k) / 100).norm());
      }
    }
  }
  EXPECT_LT(worst[0], 1e-3);
  EXPECT_LT(worst[1], worst[0] / 3.5);
}

TEST(HeightField, OutOfReachOfASlopeTheNormalIsUnknown) {
  const Surface row = surface_from_height_field(Heights::Zero(1, 5), Vec2(0, 0), Vec2(1, 1));
  EXPECT_TRUE(row.present(2));
  EXPECT_TRUE(row.normal(2).array().isNaN().all());
  Heights z = Heights::Constant(3, 3, kNaN);
  z(1, 1) = 5;
  EXPECT_TRUE(surface_from_height_field(z, Vec2(0, 0), Vec2(1, 1)).normal(4).array().isNaN().all());
}

TEST(HeightField, Nonsense) {
  const Heights z = Heights::Zero(3, 4);
  const auto make = [](const Heights& heights, const Vec2& origin, const Vec2& spacing) {
    return surface_from_height_field(heights, origin, spacing);
  };
  for (double bad : {0.0, kNaN, kInf}) {
    expect_error(Status::kInvalidArgument, "spacing_mm[1]", [&] { make(z, Vec2(0, 0), Vec2(1, bad)); });
  }
  expect_error(Status::kInvalidArgument, "origin_mm", [&] { make(z, Vec2(0, kNaN), Vec2(1, 1)); });
  Heights bad = z;
  bad(1, 3) = kInf;
  expect_error(Status::kInvalidArgument, "z_mm[1, 3]", [&] { make(bad, Vec2(0, 0), Vec2(1, 1)); });
  expect_error(Status::kInsufficientData, "no point", [&] { make(Heights(0, 4), Vec2(0, 0), Vec2(1, 1)); });
  expect_error(Status::kInsufficientData, "no point",
               [&] { make(Heights::Constant(2, 2, kNaN), Vec2(0, 0), Vec2(1, 1)); });
  expect_error(Status::kInvalidArgument, "points[0, 1]", [&] { make(z, Vec2(0, 0), Vec2(1e6, 1)); });
}

}  // namespace
}  // namespace sgrt
