// Closest points against brute force, meshes against their stated error, interpolation, the chapter's mode, JSON.
#include "core/surface.hpp"
#include "nurbs/conics.hpp"
#include "nurbs/draw.hpp"
#include "nurbs/interpolate.hpp"
#include "nurbs/invert.hpp"
#include "nurbs/knots.hpp"
#include "nurbs/mesh.hpp"
#include "nurbs/nurbs_json.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

// REQ-NURBS-004
TEST(NurbsClosest, CurveAndSurfaceAgainstBruteForce) {
  Draw draw(21);
  for (int trial = 0; trial < 12; ++trial) {
    const NurbsCurve c = test::draw_curve(draw, 1 + trial % 5, 12, trial % 3 > 0, trial % 2 > 0);
    const NurbsSurface s = test::draw_surface(draw, 2 + trial % 2, 3, 7, 7, trial % 3 > 0, trial % 2 > 0);
    const ClosestFinder on_curve(c), on_surface(s);
    for (int i = 0; i < 5; ++i) {
      const Vec3 x = draw.vec3(120);
      double brute = 1e300;
      for (int k = 0; k <= 4000; ++k)
        brute = std::min(
            brute,
            (evaluate(c, std::min(c.basis.end(), c.basis.begin() + (c.basis.end() - c.basis.begin()) * k / 4000)) - x)
                .norm());
      const ClosestPoint a = on_curve(x);
      EXPECT_LE(a.distance, brute + 1e-6);
      EXPECT_LT(a.gap, 1e-5);
      EXPECT_LT((evaluate(c, a.u) - a.point).norm(), 1e-10);
      EXPECT_NEAR((a.point - x).norm(), a.distance, 1e-12);
      brute = 1e300;
      for (int k = 0; k <= 120; ++k) {
        for (int l = 0; l <= 120; ++l) {
          const double u =
              std::min(s.basis[0].end(), s.basis[0].begin() + (s.basis[0].end() - s.basis[0].begin()) * k / 120);
          const double v =
              std::min(s.basis[1].end(), s.basis[1].begin() + (s.basis[1].end() - s.basis[1].begin()) * l / 120);
          brute = std::min(brute, (evaluate(s, u, v) - x).norm());
        }
      }
      const ClosestPoint b = on_surface(x);
      EXPECT_LE(b.distance, brute + 1e-6);
      EXPECT_LT(b.gap, 1e-5);
      EXPECT_LT((evaluate(s, b.u, b.v) - b.point).norm(), 1e-10);
    }
  }
}

TEST(NurbsClosest, InvertsAndKnowsQuadrics) {
  Draw draw(22);
  const NurbsSurface s = test::draw_surface(draw, 3, 3, 8, 8, true, true);
  const ClosestFinder finder(s);
  for (int i = 0; i < 20; ++i) {  // points of the surface itself
    const double u = test::draw_parameter(draw, s.basis[0]), v = test::draw_parameter(draw, s.basis[1]);
    EXPECT_LT(finder(evaluate(s, u, v)).distance, 2e-6);
  }
  const ClosestFinder torus(make_torus(Vec3::Zero(), Vec3::UnitZ(), 60, 20));
  for (int i = 0; i < 20; ++i) {
    const Vec3 x = draw.vec3(100);
    const double expected = std::abs(std::hypot(std::hypot(x[0], x[1]) - 60, x[2]) - 20);
    EXPECT_NEAR(torus(x).distance, expected, 1e-6);
  }
  // Every point of a sphere is as near to its centre: an answer, an honest gap, and an end.
  const ClosestPoint centre = ClosestFinder(make_sphere(Vec3::Zero(), 50))(Vec3::Zero());
  EXPECT_NEAR(centre.distance, 50, 1e-10);
  EXPECT_LT(centre.gap, 1);
}

// REQ-NURBS-005
TEST(NurbsMesh, LiesWithinItsChordError) {
  Draw draw(23);
  for (const double chord : {1.0, 0.05}) {
    for (const NurbsSurface& s : {make_sphere(Vec3::Zero(), 50), test::draw_surface(draw, 3, 2, 6, 5, true, false)}) {
      const SurfaceEvaluator evaluator(s);
      const Surface mesh = mesh_of(sgrt::Run{}, evaluator, chord);
      const ClosestFinder closest(s);
      double worst = 0;
      for (Eigen::Index f = 0; f < mesh.faces.rows(); f += 1 + mesh.faces.rows() / 300) {
        Vec3 middle = Vec3::Zero();
        for (int k = 0; k < 3; ++k) middle += mesh.point(mesh.faces(f, k)) / 3;
        worst = std::max(worst, closest(middle).distance);
      }
      EXPECT_LE(worst, chord);
      EXPECT_GT(worst, 0.002 * chord);  // not wildly fine
    }
  }
  const SurfaceEvaluator sphere(make_sphere(Vec3(1, 2, 3), 50));
  const Surface mesh = mesh_of(sgrt::Run{}, sphere, 0.1);
  double volume = 0;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    volume += mesh.point(mesh.faces(f, 0)).dot(mesh.point(mesh.faces(f, 1)).cross(mesh.point(mesh.faces(f, 2)))) / 6;
  EXPECT_NEAR(volume / (4. / 3 * std::acos(-1.0) * 125000), 1, 0.01);  // closed, and outward
  expect_error(Status::kLimit, "chord_error_mm: 1e-12", [&] { mesh_of(sgrt::Run{}, sphere, 1e-12); });
  expect_error(Status::kInvalidArgument, "chord_error_mm: 0", [&] { mesh_of(sgrt::Run{}, sphere, 0); });
}

TEST(NurbsMesh, IsCancelledWhileItGrows) {
  const SurfaceEvaluator sphere(make_sphere(Vec3::Zero(), 50));
  for (const char* stage : {"mesh: points", "mesh: triangles"}) {
    int polls = 0;
    sgrt::Run run;
    run.progress = [&](double fraction, const char* at) {
      EXPECT_TRUE(fraction >= 0 && fraction <= 1) << fraction;
      return std::string(at) == stage && ++polls == 3;
    };
    expect_error(Status::kCancelled, stage, [&] { mesh_of(run, sphere, 3e-3); });
    EXPECT_EQ(polls, 3);
  }
}

TEST(NurbsInterpolate, PassesThroughItsPoints) {
  Draw draw(24);
  for (int degree = 1; degree <= 5; ++degree) {
    for (const Parameters kind : {Parameters::kUniform, Parameters::kChord, Parameters::kCentripetal}) {
      const Points p = test::draw_points(draw, 20);
      const ClosestFinder on(fit_curve(p, degree, 20, kind));
      for (Eigen::Index i = 0; i < 20; ++i) EXPECT_LT(on(p.row(i).transpose()).distance, 2e-6) << degree;
    }
  }
  Points grid(15 * 12, 3);
  for (int i = 0; i < 15; ++i) {
    for (int j = 0; j < 12; ++j) grid.row(i * 12 + j) << 5 * i, 4 * j, 10 * std::sin(0.4 * i) * std::cos(0.3 * j);
  }
  const int degree[2] = {3, 2}, count[2] = {15, 12}, fewer[2] = {9, 8};
  const NurbsSurface s = fit_grid(grid, 15, 12, degree, count, Parameters::kChord);
  const ClosestFinder on(s), near(fit_grid(grid, 15, 12, degree, fewer, Parameters::kChord));
  double worst = 0;
  for (Eigen::Index i = 0; i < grid.rows(); ++i) {
    EXPECT_LT(on(grid.row(i).transpose()).distance, 2e-6);
    worst = std::max(worst, near(grid.row(i).transpose()).distance);
  }
  EXPECT_LT(worst, 0.5);
  EXPECT_LT((s.points.row(0) - grid.row(0)).norm(), 1e-12);
}

TEST(NurbsInterpolate, LeastSquaresFindsTheSplineThatMadeThePoints) {
  Draw draw(25);
  Points line(30, 3);
  for (int i = 0; i < 30; ++i) line.row(i) = (Vec3(1, 2, 3) + i * Vec3(0.5, -1, 2)).transpose();
  for (const int count : {4, 9, 30}) {
    const NurbsCurve c = fit_curve(line, 3, count, Parameters::kChord);
    for (int i = 0; i <= 20; ++i)
      EXPECT_LT((evaluate(c, i / 20.) - Vec3(1, 2, 3) - i / 20. * 29 * Vec3(0.5, -1, 2)).norm(), 1e-11);
  }
  Points twice = line;
  twice.row(5) = twice.row(4);
  expect_error(Status::kDegenerate, "points 4 and 5 coincide", [&] { fit_curve(twice, 3, 30, Parameters::kChord); });
  expect_error(Status::kInsufficientData, "3 points", [&] { fit_curve(line.topRows(3), 3, 3, Parameters::kChord); });
  expect_error(Status::kInvalidArgument, "31 control points", [&] { fit_curve(line, 3, 31, Parameters::kChord); });
  twice.setZero();
  expect_error(Status::kDegenerate, "coincide", [&] { fit_curve(twice, 3, 30, Parameters::kChord); });
  twice(3, 1) = std::nan("");
  expect_error(Status::kInvalidArgument, "points[3]: nan", [&] { fit_curve(twice, 3, 30, Parameters::kChord); });
}

// A cap of radius R sampled at pitch h is flattened by h^2 / (3 R): degree 3 averages the control points with weights
// 1/6, 4/6, 1/6 in each direction, and h^2 / 6 times the sum of both curvatures, 2 / R, is left out.
TEST(NurbsChapter, FlattensACapByItsRule) {
  const double R = 8, h = 0.9;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> z(15, 13);
  for (int i = 0; i < 15; ++i) {
    for (int j = 0; j < 13; ++j) z(i, j) = std::sqrt(R * R - h * h * ((i - 7.) * (i - 7) + (j - 6.) * (j - 6)) * 0.5);
  }
  const Surface cap = surface_from_height_field(z, {-6 * h / std::sqrt(2.), -7 * h / std::sqrt(2.)},
                                                {h / std::sqrt(2.), h / std::sqrt(2.)});
  const double pitch = h / std::sqrt(2.);
  const NurbsSurface s = chapter_surface(cap, 3, 3);
  const Vec3 top = evaluate(s, 0.5, 0.5);
  EXPECT_NEAR(top[0], 0, 1e-12);
  EXPECT_NEAR((R - top[2]) / (pitch * pitch / (3 * R)), 1, 0.01);
  EXPECT_GT(normal(s, 0.5, 0.5)[2], 0.999);  // outward
  EXPECT_EQ(s.nu(), 13);
  Surface holed = cap;
  holed.points.row(14).setConstant(std::nan(""));
  expect_error(Status::kInvalidArgument, "row 1, column 1", [&] { chapter_surface(holed, 3, 3); });
  expect_error(Status::kInvalidArgument, "13 control points, expected at least 15",
               [&] { chapter_surface(cap, 14, 3); });
  Surface cloud = cap;
  cloud.height = cloud.width = 0;
  expect_error(Status::kInvalidArgument, "without order", [&] { chapter_surface(cloud, 3, 3); });
}

// REQ-NURBS-007
TEST(NurbsJson, RoundTripsBitForBit) {
  Draw draw(26);
  const NurbsSurface s = test::draw_surface(draw, 3, 2, 6, 5, false, true);
  const std::string text = to_json(s);
  const NurbsSurface back = surface_from_json(text.data(), text.size());
  EXPECT_EQ(back.points, s.points);
  EXPECT_EQ(back.weights, s.weights);
  EXPECT_EQ(back.basis[1].knots, s.basis[1].knots);
  EXPECT_EQ(to_json(back), text);
  const std::string curve = to_json(test::draw_curve(draw, 2, 5, true, false));
  EXPECT_EQ(to_json(curve_from_json(curve.data(), curve.size())), curve);
  const auto refuse = [&](std::string bad, const std::string& words) {
    expect_error(Status::kFormat, words, [&] { surface_from_json(bad.data(), bad.size()); });
  };
  refuse(curve, "degree: 1 numbers, expected 2 for a surface");
  refuse("{}", "schema: missing");
  refuse(R"({"schema": "sgrt-nurbs/2"})", "schema: expected 'sgrt-nurbs/1'");
  refuse("[]", "expected an object");
  refuse("{", "syntax error");
  refuse(R"({"schema":"sgrt-nurbs/1","degree":[1,1],"size":[2,2],"knots":[[0,0,1,1],[0,0,1]],"control_points":[]})",
         "knots[1]: 3 knots, expected 4");
  refuse(
      R"({"schema":"sgrt-nurbs/1","degree":[1,1],"size":[2,2],"knots":[[0,0,1,1],[0,0,1,1]],"control_points":[[0,0,0]]})",
      "control_points: 1 points, expected 4");
  refuse(R"({"schema":"sgrt-nurbs/1","degree":[1.5,1],"size":[2,2],"knots":[],"control_points":[]})", "degree: 1.5");
}

}  // namespace
}  // namespace sgrt
