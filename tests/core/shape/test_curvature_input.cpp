// Curvature where input is bad or lacking: every point says why it has none.

#include <cmath>

#include "shape/curvature.hpp"
#include "shape/surfaces.hpp"

namespace sgrt {
namespace {

using test::expect_error;
using test::Wave;
using test::wave;

// REQ-CURV-003
TEST(ShapeCurvature, ReasonsWhy) {
  const int side = 31;
  Wave w = wave(side, 1, false, true);
  CurvatureOptions o;
  o.radius = 4;
  Surface& s = w.surface;
  for (int i = 13; i < 18; ++i)
    s.points.row(15 * side + i).setConstant(std::nan(""));  // a gap of one row: no hole to speak of
  s.normals.row(8 * side + 8).setConstant(std::nan(""));
  const CurvatureField f = surface_curvature(sgrt::Run{}, s, o);
  const auto reason = [&](int i, int j) { return static_cast<CurvatureReason>(f.reason[i * side + j]); };
  EXPECT_EQ(reason(15, 15), CurvatureReason::kAbsent);
  EXPECT_EQ(reason(8, 8), CurvatureReason::kNoNormal);
  EXPECT_EQ(reason(0, 10), CurvatureReason::kBorder);
  EXPECT_EQ(reason(22, 22), CurvatureReason::kNone);
  EXPECT_TRUE(std::isnan(f.k1[15 * side + 15]) && std::isnan(f.sigma_gauss[0]) && std::isnan(f.d1(0, 0)));
  EXPECT_NEAR(f.mean[22 * side + 22], w.mean[22 * side + 22], 2e-3);
  std::int64_t sum = 0;
  for (const std::int64_t c : f.count) sum += c;
  EXPECT_EQ(sum, side * side);
}

TEST(ShapeCurvature, BadInput) {
  const Wave w = wave(21, 1, true, false);
  Surface s = w.surface;
  CurvatureOptions o;
  o.radius = 0.5;  // fewer neighbours than unknowns
  EXPECT_EQ(surface_curvature(sgrt::Run{}, s, o).count[static_cast<int>(CurvatureReason::kTooFew)], s.size());
  o.radius = 1e4;  // larger than the surface: never a silent number at the border
  EXPECT_EQ(surface_curvature(sgrt::Run{}, s, o).known, 0);
  o.radius = 4;
  // Half the normals flipped: said where they meet, and where all neighbours are.
  for (std::int64_t i = 0; i < s.size(); i += 2) s.normals.row(i) *= -1;
  const CurvatureField flipped = surface_curvature(sgrt::Run{}, s, o);
  EXPECT_GT(flipped.count[static_cast<int>(CurvatureReason::kDisagree)] +
                flipped.count[static_cast<int>(CurvatureReason::kBorder)],
            s.size() * 9 / 10);
  s.normals.resize(0, 3);
  expect_error(Status::kInvalidArgument, "normals", [&] { surface_curvature(sgrt::Run{}, s, o); });
  o.degree = 5;
  expect_error(Status::kInvalidArgument, "degree", [&] { surface_curvature(sgrt::Run{}, w.surface, o); });
}

TEST(ShapeCurvature, DuplicatesIsolatedPointsAndPlanes) {
  const int side = 21;
  const Wave w = wave(side, 1, false, false);
  Surface s = w.surface;
  const int n = static_cast<int>(s.size());
  s.points.conservativeResize(n + 3, 3);
  s.normals.conservativeResize(n + 3, 3);
  s.points.row(n) = s.points.row(10 * side + 10);
  s.points.row(n + 1) = s.points.row(10 * side + 10);
  s.points.row(n + 2) << 500, 0, 0;
  for (int k = 0; k < 3; ++k) s.normals.row(n + k) = s.normals.row(10 * side + 10);
  CurvatureOptions o;
  o.radius = 4;
  const CurvatureField plain = surface_curvature(sgrt::Run{}, w.surface, o), f = surface_curvature(sgrt::Run{}, s, o);
  EXPECT_EQ(f.duplicates, 2);
  EXPECT_EQ(f.mean[10 * side + 10], plain.mean[10 * side + 10]);
  EXPECT_EQ(f.mean[n], f.mean[10 * side + 10]);
  EXPECT_EQ(f.reason[n + 2], static_cast<std::uint8_t>(CurvatureReason::kTooFew));
  // Every point twice: half as many places, not a finer grain.
  Surface pairs = test::sphere_cloud(10, 1);
  const double spacing = surface_curvature(sgrt::Run{}, pairs, {}).spacing;
  const auto half = pairs.size();
  pairs.points.conservativeResize(2 * half, 3);
  pairs.normals.conservativeResize(2 * half, 3);
  pairs.points.bottomRows(half) = pairs.points.topRows(half).eval();
  pairs.normals.bottomRows(half) = pairs.normals.topRows(half).eval();
  EXPECT_NEAR(surface_curvature(sgrt::Run{}, pairs, {}).spacing, spacing, 0.1 * spacing);
  Surface flat = w.surface;
  flat.points.col(2).setConstant(7);
  flat.normals.rowwise() = Eigen::RowVector3d(0, 0, 1);
  const CurvatureField plane = surface_curvature(sgrt::Run{}, flat, o);
  EXPECT_NEAR(plane.mean[10 * side + 10], 0, 1e-12);
  EXPECT_TRUE(std::isnan(plane.shape_index[10 * side + 10]));
  EXPECT_EQ(plane.hk[10 * side + 10], static_cast<std::uint8_t>(HkClass::kFlat));
  Surface line;
  line.points = Points::Zero(50, 3);
  for (int i = 0; i < 50; ++i) line.points(i, 0) = i;
  line.normals = Points::Zero(50, 3);
  line.normals.col(2).setOnes();
  EXPECT_EQ(surface_curvature(sgrt::Run{}, line, o).known, 0);
  Surface one_place = line;
  one_place.points.setConstant(3);
  EXPECT_EQ(surface_curvature(sgrt::Run{}, one_place, {}).known, 0);
}

// What is outward is never guessed: not of a place whose two points say opposite things, not where normals are chance.
TEST(ShapeCurvature, NormalsThatContradict) {
  const Surface sphere = test::sphere_cloud(10, 1);
  const auto n = sphere.size();
  Surface twice = sphere;
  twice.points.conservativeResize(n + 1, 3);
  twice.normals.conservativeResize(n + 1, 3);
  twice.points.row(n) = sphere.points.row(7);
  twice.normals.row(n) = -sphere.normals.row(7);
  const CurvatureField f = surface_curvature(sgrt::Run{}, twice, {});
  for (const std::int64_t i : {std::int64_t{7}, static_cast<std::int64_t>(n)}) {
    EXPECT_EQ(f.reason[static_cast<std::size_t>(i)], static_cast<std::uint8_t>(CurvatureReason::kDisagree));
    EXPECT_TRUE(std::isnan(f.mean[i]) && std::isnan(f.sigma_k1[i]) && std::isnan(f.normals(i, 0)));
  }
  EXPECT_EQ(f.known, n - 1);
  // Of three the first two agree.
  twice.points.conservativeResize(n + 2, 3);
  twice.normals.conservativeResize(n + 2, 3);
  twice.points.row(n) = twice.points.row(n + 1) = sphere.points.row(7);
  twice.normals.row(n) = sphere.normals.row(7), twice.normals.row(n + 1) = -sphere.normals.row(7);
  EXPECT_EQ(surface_curvature(sgrt::Run{}, twice, {}).known, n - 1);
  Surface chance = sphere;
  test::Draw draw(5);
  for (std::int64_t i = 0; i < n; ++i) {
    Vec3 v(test::normal_draw(draw), test::normal_draw(draw), test::normal_draw(draw));
    chance.normals.row(i) = v.normalized().transpose();
  }
  EXPECT_LT(surface_curvature(sgrt::Run{}, chance, {}).known, n / 20);
}

// A closed surface inside the disc has no border that would say so.
TEST(ShapeCurvature, ScaleLargerThanAClosedSurface) {
  const test::Known e = test::ellipsoid_cloud(20, 10, 1.2);
  CurvatureOptions o;
  for (const double radius : {60.0, 1e4}) {
    o.radius = radius;
    const CurvatureField f = surface_curvature(sgrt::Run{}, e.surface, o);
    EXPECT_EQ(f.known, 0) << radius;
  }
}

TEST(ShapeCurvature, MeshWithZeroAreaAndNonManifoldFaces) {
  const int side = 21;
  Wave w = wave(side, 1, true, false);
  Surface& s = w.surface;
  const auto faces = s.faces.rows();
  s.faces.conservativeResize(faces + 3, 3);
  s.faces.row(faces) << 5, 5, 6;              // zero area
  s.faces.row(faces + 1) << 0, 1, 2;          // three in a row
  s.faces.row(faces + 2) << 0, 1, 10 * side;  // a third face at an edge
  CurvatureOptions o;
  o.radius = 4;
  EXPECT_NEAR(surface_curvature(sgrt::Run{}, s, o).mean[10 * side + 10], w.mean[10 * side + 10], 2e-3);
}

}  // namespace
}  // namespace sgrt
