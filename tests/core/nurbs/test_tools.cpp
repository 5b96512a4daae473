// The tools leave the shape; exact conics; arc length.
#include "nurbs/conics.hpp"
#include "nurbs/draw.hpp"
#include "nurbs/knots.hpp"
#include "nurbs/length.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;
const double kPi = std::acos(-1.0);

double furthest(const NurbsCurve& a, const NurbsCurve& b, double begin, double end) {
  double worst = 0;
  for (int i = 0; i <= 200; ++i) {
    const double u = std::min(end, begin + (end - begin) * i / 200);
    worst = std::max(worst, (evaluate(a, u) - evaluate(b, u)).norm());
  }
  return worst;
}

double furthest(const NurbsCurve& a, const NurbsCurve& b) {
  return furthest(a, b, a.basis.begin(), a.basis.end());
}

double furthest(const NurbsSurface& a, const NurbsSurface& b) {
  double worst = 0;
  for (int i = 0; i <= 30; ++i) {
    for (int j = 0; j <= 30; ++j) {
      const double u =
          std::min(b.basis[0].end(), b.basis[0].begin() + (b.basis[0].end() - b.basis[0].begin()) * i / 30);
      const double v =
          std::min(b.basis[1].end(), b.basis[1].begin() + (b.basis[1].end() - b.basis[1].begin()) * j / 30);
      worst = std::max(worst, (evaluate(a, u, v) - evaluate(b, u, v)).norm());
    }
  }
  return worst;
}

constexpr double kSame = 100 * 1e-12;  // points are within 100 mm

// REQ-NURBS-003
TEST(NurbsTools, RefineElevateAndDecomposeKeepTheCurve) {
  Draw draw(11);
  for (int trial = 0; trial < 150; ++trial) {
    const int p = 1 + trial % 7;
    const NurbsCurve c =
        test::draw_curve(draw, p, p + 1 + static_cast<int>(draw.bits() % 9), trial % 3 > 0, trial % 2 > 0);
    std::vector<double> knots;
    for (int i = 0; i < 4; ++i) knots.push_back(test::draw_parameter(draw, c.basis));
    if (p > 2) knots.push_back(knots[0]);
    const NurbsCurve fine = refine(c, knots);
    EXPECT_EQ(fine.basis.size(), c.basis.size() + static_cast<int>(knots.size()));
    EXPECT_LT(furthest(c, fine), kSame) << "degree " << p;
    const NurbsCurve high = elevate(c, 2);
    EXPECT_EQ(high.basis.degree, p + 2);
    EXPECT_LT(furthest(c, high), kSame) << "degree " << p;
    const NurbsCurve bezier = to_bezier(c);
    EXPECT_EQ(bezier.basis.size(), (static_cast<int>(breaks(c.basis).size()) - 1) * p + 1);
    EXPECT_LT(furthest(c, bezier), kSame);
  }
}

TEST(NurbsTools, SplitAndReparameterise) {
  Draw draw(12);
  for (int trial = 0; trial < 50; ++trial) {
    const int p = 1 + trial % 7;
    const NurbsCurve c = test::draw_curve(draw, p, p + 6, trial % 3 > 0, trial % 2 > 0);
    const double u = trial % 5 == 0 ? breaks(c.basis)[1] : test::draw_parameter(draw, c.basis);
    const NurbsCurve left = restrict_to(c, c.basis.begin(), u), right = restrict_to(c, u, c.basis.end());
    EXPECT_LT(furthest(c, left, c.basis.begin(), u), kSame);
    EXPECT_LT(furthest(c, right, u, c.basis.end()), kSame);
    EXPECT_LT((left.points.bottomRows(1) - right.points.topRows(1)).norm(), kSame);
    const NurbsCurve back = reparameterise(c, 5, -2);
    EXPECT_EQ(back.basis.begin(), -2);
    EXPECT_EQ(back.basis.end(), 5);
    const double share = draw.uniform(0, 1), at = c.basis.begin() + share * (c.basis.end() - c.basis.begin());
    EXPECT_LT((evaluate(back, 5 - 7 * share) - evaluate(c, at)).norm(), 1e-9);
  }
}

TEST(NurbsTools, RemovalAndReductionUndoWhatWasAdded) {
  Draw draw(13);
  for (int trial = 0; trial < 60; ++trial) {
    const int p = 2 + trial % 4;
    const NurbsCurve c = test::draw_curve(draw, p, p + 5, true, trial % 2 > 0);
    const double u = test::draw_parameter(draw, c.basis);
    const NurbsCurve fine = refine(c, {u, u});
    const auto back = remove_knot(fine, u, 2, 1e-8);
    EXPECT_EQ(back.count, 2);
    EXPECT_EQ(back.shape.basis.knots, c.basis.knots);
    EXPECT_LT(furthest(c, back.shape), 10 * kSame);
    EXPECT_LE(furthest(fine, back.shape), back.bound_mm + kSame);
    const auto low = reduce_degree(elevate(c, 1), 1e-6);
    EXPECT_EQ(low.count, 1);
    EXPECT_EQ(low.shape.basis.degree, p);
    EXPECT_LE(furthest(c, low.shape), low.bound_mm + 10 * kSame);
  }
}

// REQ-NURBS-003
TEST(NurbsTools, BoundsOfRemovalAndReductionHold) {
  Draw draw(14);
  for (int trial = 0; trial < 60; ++trial) {
    const int p = 2 + trial % 4;
    NurbsCurve c = test::draw_curve(draw, p, p + 8, trial % 3 > 0, false);
    if (trial % 2) {
      c.weights = Eigen::VectorXd(c.points.rows());
      for (double& w : c.weights) w = draw.uniform(0.8, 1.2);
    }
    const double u = breaks(c.basis)[1];
    const auto fewer = remove_knot(c, u, 1, 1e4);
    ASSERT_EQ(fewer.count, 1);
    EXPECT_LE(furthest(c, fewer.shape), fewer.bound_mm);
    EXPECT_GT(fewer.bound_mm, 1e-3);
    EXPECT_EQ(remove_knot(c, u, 1, 1e-6).count, 0);
    const auto lower = reduce_degree(c, 1e4);
    ASSERT_EQ(lower.count, 1);
    EXPECT_LE(furthest(c, lower.shape), lower.bound_mm);
    EXPECT_EQ(reduce_degree(c, 1e-6).count, 0);
  }
}

TEST(NurbsTools, SurfacesInBothDirections) {
  Draw draw(15);
  for (int trial = 0; trial < 24; ++trial) {
    const NurbsSurface s = test::draw_surface(draw, 1 + trial % 5, 3, 8, 7, trial % 3 > 0, trial % 2 > 0);
    for (int d = 0; d < 2; ++d) {
      const double x = test::draw_parameter(draw, s.basis[d]);
      const NurbsSurface fine = refine(s, d, {x});
      EXPECT_LT(furthest(fine, s), kSame);
      EXPECT_LT(furthest(to_bezier(s, d), s), kSame);
      EXPECT_LT(furthest(elevate(s, d, 1), s), kSame);
      EXPECT_LT(furthest(s, restrict_to(s, d, s.basis[d].begin(), x)), kSame);
      const auto back = remove_knot(fine, d, x, 1, 1e-8);
      EXPECT_EQ(back.count, 1);
      EXPECT_LT(furthest(back.shape, s), 10 * kSame);
      if (elevate(s, d, 1).basis[d].degree > 1) {
        EXPECT_LT(furthest(reduce_degree(elevate(s, d, 1), d, 1e-6).shape, s), 10 * kSame);
      }
    }
  }
}

TEST(NurbsTools, BadArguments) {
  Draw draw(16);
  const NurbsCurve c = test::draw_curve(draw, 3, 8, true, false);
  expect_error(Status::kInvalidArgument, "inside the domain", [&] { refine(c, {c.basis.end()}); });
  expect_error(Status::kInvalidArgument, "stands 4 times", [&] {
    const double u = 0.5 * (c.basis.begin() + breaks(c.basis)[1]);
    refine(c, {u, u, u, u});
  });
  expect_error(Status::kInvalidArgument, "u: ", [&] { remove_knot(c, c.basis.begin(), 1, 1); });
  expect_error(Status::kInvalidArgument, "tolerance_mm: nan",
               [&] { remove_knot(c, breaks(c.basis)[1], 1, std::nan("")); });
  expect_error(Status::kInvalidArgument, "times: 22", [&] { elevate(c, 22); });
  expect_error(Status::kInvalidArgument, "begin", [&] { restrict_to(c, c.basis.end(), c.basis.begin()); });
  expect_error(Status::kInvalidArgument, "begin, end", [&] { reparameterise(c, 1, 1); });
}

TEST(NurbsConics, CircleAndArcAreExact) {
  Draw draw(17);
  for (int trial = 0; trial < 40; ++trial) {
    const Vec3 n = draw.direction(), x = n.unitOrthogonal() * 70, y = n.cross(x), centre = draw.vec3(20);
    const double begin = draw.uniform(-4, 4), end = trial == 0 ? begin + 2 * kPi : begin + draw.uniform(-6, 6);
    const NurbsCurve arc = make_arc(centre, x, y, begin, end);
    for (int i = 0; i <= 50; ++i) {
      const Vec3 p = evaluate(arc, i / 50.) - centre;
      EXPECT_NEAR(p.norm() / 70, 1, 2e-15 + 1e-15 * 5);
      EXPECT_NEAR(p.dot(n) / 70, 0, 1e-14);
    }
    EXPECT_LT((evaluate(arc, 1) - centre - std::cos(end) * x - std::sin(end) * y).norm(), 1e-13 * 70);
    EXPECT_NEAR(arc_length(arc, 0, 1) / (70 * std::abs(end - begin)), 1, 1e-13);
  }
}

TEST(NurbsConics, QuadricsAreExactWithOutwardNormals) {
  const Vec3 centre(10, -20, 30), axis = Vec3(1, 2, 2) / 3;
  const NurbsSurface sphere = make_sphere(centre, 50), cylinder = make_cylinder(centre, 80 * axis, 30),
                     torus = make_torus(centre, axis, 60, 20);
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j <= 40; ++j) {
      const double u = i / 40., v = j / 40.;
      const Vec3 p = evaluate(sphere, u, v) - centre;
      EXPECT_NEAR(p.norm() / 50, 1, 1e-14);
      EXPECT_LT((normal(sphere, u, v) - p / 50).norm(), 1e-7) << u << " " << v;  // poles (v = 0, 1) by limit
      const Vec3 c = evaluate(cylinder, u, v) - centre, radial = c - axis * axis.dot(c);
      EXPECT_NEAR(radial.norm() / 30, 1, 1e-14);
      EXPECT_LT((normal(cylinder, u, v) - radial / 30).norm(), 1e-13);
      const Vec3 t = evaluate(torus, u, v) - centre, ring = (t - axis * axis.dot(t)).normalized() * 60;
      EXPECT_NEAR((t - ring).norm() / 20, 1, 4e-14);  // of its size, 80 mm: 1e-14
      EXPECT_LT((normal(torus, u, v) - (t - ring) / 20).norm(), 1e-13);
    }
  }
}

TEST(NurbsConics, BadArguments) {
  expect_error(Status::kInvalidArgument, "radius_mm: -1", [] { make_sphere(Vec3::Zero(), -1); });
  expect_error(Status::kInvalidArgument, "up to one turn",
               [] { make_arc(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), 0, 7); });
  expect_error(Status::kInvalidArgument, "direction, not 0", [] { make_cylinder(Vec3::Zero(), Vec3::Zero(), 1); });
  expect_error(Status::kInvalidArgument, "below radius_mm", [] { make_torus(Vec3::Zero(), Vec3::UnitZ(), 1, 2); });
}

TEST(NurbsLength, ParabolaAndAdditivity) {
  NurbsCurve parabola{uniform_basis(2, 3), Points(3, 3), {}};  // y = x^2, x = u
  parabola.points << 0, 0, 0, .5, 0, 0, 1, 1, 0;
  EXPECT_NEAR(arc_length(parabola, 0, 1), std::sqrt(5.) / 2 + std::asinh(2.) / 4, 1e-14);
  Draw draw(18);
  const NurbsCurve c = test::draw_curve(draw, 3, 9, false, true);
  const double a = c.basis.begin(), b = test::draw_parameter(draw, c.basis), e = c.basis.end();
  EXPECT_NEAR(arc_length(c, a, b) + arc_length(c, b, e), arc_length(c, a, e), 1e-9);
  EXPECT_EQ(arc_length(c, b, a), -arc_length(c, a, b));
  expect_error(Status::kInvalidArgument, "in the domain", [&] { arc_length(c, a - 1, e); });
}

}  // namespace
}  // namespace sgrt
