// Curvature of exact shapes: formulas by hand against the fundamental forms, NURBS to 1e-10, and the conventions.

#include <cmath>

#include "expect.hpp"
#include "nurbs/conics.hpp"
#include "shape/curve.hpp"
#include "shape/forms.hpp"
#include "shape/nurbs_curvature.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

constexpr double kPi = 3.14159265358979323846;

// z = f(x, y) with its derivatives, normal +z.
Curvature of_height(double fx, double fy, double fxx, double fxy, double fyy) {
  const Vec3 d[5] = {Vec3(1, 0, fx), Vec3(0, 1, fy), Vec3(0, 0, fxx), Vec3(0, 0, fxy), Vec3(0, 0, fyy)};
  return curvature_of_forms(d);
}

TEST(ShapeForms, HeightFields) {
  const double x = 0.7, y = -0.4;
  // Saddle z = x y: K = -1 / (1 + x^2 + y^2)^2, H = x y / (1 + x^2 + y^2)^1.5 (towards +z convex is positive).
  const double g = 1 + x * x + y * y;
  const Curvature saddle = of_height(y, x, 0, 1, 0);
  EXPECT_NEAR(saddle.gauss, -1 / (g * g), 1e-14);
  EXPECT_NEAR(saddle.mean, x * y / std::pow(g, 1.5), 1e-14);
  // Monkey saddle z = x^3 - 3 x y^2: K = -36 r^2 / (1 + 9 r^4)^2, H = -27 r^4 ... = -(1/2) div grad, by hand below.
  const double r2 = x * x + y * y, fx = 3 * x * x - 3 * y * y, fy = -6 * x * y;
  const Curvature monkey = of_height(fx, fy, 6 * x, -6 * y, -6 * x);
  EXPECT_NEAR(monkey.gauss, -36 * r2 / std::pow(1 + 9 * r2 * r2, 2), 1e-13);
  const double numerator = (1 + fy * fy) * 6 * x - 2 * fx * fy * -6 * y + (1 + fx * fx) * -6 * x;
  EXPECT_NEAR(monkey.mean, -numerator / (2 * std::pow(1 + fx * fx + fy * fy, 1.5)), 1e-13);
  EXPECT_NEAR(monkey.k1 * monkey.k2, monkey.gauss, 1e-12);
}

TEST(ShapeForms, DirectionsAndShapeIndex) {
  Draw draw(3);
  for (int trial = 0; trial < 200; ++trial) {
    const double fxx = draw.uniform(-2, 2), fxy = draw.uniform(-2, 2), fyy = draw.uniform(-2, 2);
    const Curvature c = of_height(draw.uniform(), draw.uniform(), fxx, fxy, fyy);
    EXPECT_GE(c.k1, c.k2);
    EXPECT_NEAR(c.d1.dot(c.d2), 0, 1e-12);
    EXPECT_NEAR((c.normal.cross(c.d1) - c.d2).norm(), 0, 1e-12);
    EXPECT_NEAR(c.shape_index, 2 / kPi * std::atan2(c.k1 + c.k2, c.k1 - c.k2), 1e-13);
  }
  // A cylinder along y, convex to +z: k1 = 1/R across, k2 = 0 along.
  const Curvature ridge = of_height(0, 0, -0.1, 0, 0);
  EXPECT_NEAR(ridge.k1, 0.1, 1e-15);
  EXPECT_NEAR(ridge.k2, 0, 1e-15);
  EXPECT_NEAR(std::abs(ridge.d1[0]), 1, 1e-15);
  EXPECT_NEAR(ridge.shape_index, 0.5, 1e-15);
  const Curvature cap = of_height(0, 0, -0.1, 0, -0.1), cup = of_height(0, 0, 0.1, 0, 0.1);
  EXPECT_NEAR(cap.shape_index, 1, 1e-15);
  EXPECT_NEAR(cup.shape_index, -1, 1e-15);
  EXPECT_NEAR(cap.curvedness, 0.1, 1e-15);
  const Curvature plane = of_height(0.3, 0.2, 0, 0, 0);
  EXPECT_TRUE(std::isnan(plane.shape_index));  // atan2(0, 0) would say saddle
  EXPECT_EQ(plane.k1, 0);
}

TEST(ShapeForms, NoTangentPlaneIsNan) {
  const Vec3 d[5] = {Vec3(1, 0, 0), Vec3(2, 0, 0), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  EXPECT_TRUE(std::isnan(curvature_of_forms(d).mean));
}

// Fig. 10.7: apex and alae convex caps, sulci concave valleys.
TEST(ShapeForms, HkClasses) {
  EXPECT_EQ(hk_class(0.1, 0.01, 1e-3, 1e-5), HkClass::kPeak);
  EXPECT_EQ(hk_class(-0.1, 0.01, 1e-3, 1e-5), HkClass::kPit);
  EXPECT_EQ(hk_class(0.1, 0, 1e-3, 1e-5), HkClass::kRidge);
  EXPECT_EQ(hk_class(-0.1, 1e-6, 1e-3, 1e-5), HkClass::kValley);
  EXPECT_EQ(hk_class(0.1, -0.01, 1e-3, 1e-5), HkClass::kSaddleRidge);
  EXPECT_EQ(hk_class(-0.1, -0.01, 1e-3, 1e-5), HkClass::kSaddleValley);
  EXPECT_EQ(hk_class(0, -0.01, 1e-3, 1e-5), HkClass::kMinimal);
  EXPECT_EQ(hk_class(0, 0, 1e-3, 1e-5), HkClass::kFlat);
  EXPECT_EQ(hk_class(std::nan(""), 0, 0, 0), HkClass::kUnknown);
}

void expect_everywhere(NurbsSurface surface, double (*k1)(const Vec3&), double (*k2)(const Vec3&)) {
  const SurfaceEvaluator evaluator(std::move(surface));
  const SplineBasis* basis = evaluator.surface().basis;
  std::vector<double> uv;
  Draw draw(5);
  for (int i = 0; i < 300; ++i) {
    for (int k = 0; k < 2; ++k) {
      const double margin = 0.02 * (basis[k].end() - basis[k].begin());
      uv.push_back(draw.uniform(basis[k].begin() + margin, basis[k].end() - margin));
    }
  }
  for (const Isa isa : {Isa::kBaseline, detect_isa()}) {
    sgrt::Run run;
    run.isa = isa;
    std::vector<Curvature> c(300);
    nurbs_curvature(run, evaluator, uv.data(), 300, c.data());
    for (int i = 0; i < 300; ++i) {
      const Vec3 x = evaluate(evaluator.surface(), uv[2 * i], uv[2 * i + 1]);
      const double size = std::abs(k1(x)) + std::abs(k2(x));
      ASSERT_NEAR(c[i].k1, k1(x), 1e-10 * size);
      ASSERT_NEAR(c[i].k2, k2(x), 1e-10 * size);
      ASSERT_NEAR(c[i].mean, 0.5 * (k1(x) + k2(x)), 1e-10 * size);
      ASSERT_NEAR(c[i].gauss, k1(x) * k2(x), 1e-10 * size * size);
    }
  }
}

// REQ-CURV-001
TEST(ShapeForms, NurbsSphereCylinderTorusExact) {
  const auto tenth = [](const Vec3&) { return 0.1; };
  const auto zero = [](const Vec3&) { return 0.0; };
  expect_everywhere(make_sphere(Vec3(3, 4, 5), 10), tenth, tenth);
  expect_everywhere(make_cylinder(Vec3(0, 0, 0), Vec3(0, 0, 30), 10), tenth, zero);
  // Tube 4 about a circle of 10 in the x-y plane: k = 1/4 and cos v / (10 + 4 cos v).
  expect_everywhere(
      make_torus(Vec3::Zero(), Vec3(0, 0, 1), 10, 4), [](const Vec3&) { return 0.25; },
      [](const Vec3& x) {
        const double rho = std::hypot(x[0], x[1]);
        return (rho - 10) / 4 / rho;
      });
}

// Eq. 10.17: the curvature of a circle of radius r is 1/r; torsion of a helix c / (a^2 + c^2).
TEST(ShapeCurve, CircleAndHelix) {
  const NurbsCurve circle = make_arc(Vec3(1, 2, 3), Vec3(8, 0, 0), Vec3(0, 8, 0), 0, 2 * kPi);
  std::vector<double> u;
  for (int i = 0; i <= 40; ++i)
    u.push_back(circle.basis.begin() + (circle.basis.end() - circle.basis.begin()) * i / 40);
  for (const CurvePoint& p : curve_curvature(circle, u.data(), 41, Vec3::Zero()))
    EXPECT_NEAR(p.curvature, 0.125, 1e-13);
  for (const CurvePoint& p : curve_curvature(circle, u.data(), 41, Vec3(0, 0, 2)))
    EXPECT_NEAR(p.curvature, 0.125, 1e-13);
  for (const CurvePoint& p : curve_curvature(circle, u.data(), 41, Vec3(0, 0, -1)))
    EXPECT_NEAR(p.curvature, -0.125, 1e-13);
  const double a = 6, c = 2, t = 0.8;
  const CurvePoint helix =
      curve_point(Vec3(-a * std::sin(t), a * std::cos(t), c), Vec3(-a * std::cos(t), -a * std::sin(t), 0),
                  Vec3(a * std::sin(t), -a * std::cos(t), 0), Vec3::Zero());
  EXPECT_NEAR(helix.curvature, a / (a * a + c * c), 1e-14);
  EXPECT_NEAR(helix.torsion, c / (a * a + c * c), 1e-14);
  const CurvePoint line = curve_point(Vec3(1, 2, 3), Vec3(2, 4, 6), Vec3(1, 0, 0), Vec3::Zero());
  EXPECT_EQ(line.curvature, 0);
  EXPECT_TRUE(std::isnan(line.torsion));
}

Points helix_samples(int n, double step) {
  Points p(n, 3);
  for (int i = 0; i < n; ++i) p.row(i) << 6 * std::cos(i * step), 6 * std::sin(i * step), 2 * i * step;
  return p;
}

TEST(ShapeCurve, SampledConverges) {
  double before = 0;
  for (const int n : {40, 80, 160}) {
    const Points p = helix_samples(n, 6.0 / n);
    const CurvePoint m = sampled_curvature(p, 3, 4, false, Vec3::Zero(), 0, nullptr)[n / 2];
    const double error = std::abs(m.curvature - 0.15);
    EXPECT_NEAR(m.torsion, 0.05, 0.3 / n);
    if (before > 0) {
      EXPECT_LT(error, before / 6);  // at least h^3
    }
    before = error;
  }
  EXPECT_LT(before, 1e-5);
}

TEST(ShapeCurve, SampledNoiseIsAsPredicted) {
  Draw draw(9);
  const Points p = helix_samples(60, 0.05);
  std::vector<double> sigma(60);
  const double exact = sampled_curvature(p, 10, 3, false, Vec3::Zero(), 0, nullptr)[30].curvature;
  double sum = 0, predicted = 0;
  for (int trial = 0; trial < 400; ++trial) {
    Points q = p;
    for (int i = 0; i < 60; ++i) {
      for (int k = 0; k < 3; ++k) {
        double s = 0;  // near enough to normal
        for (int j = 0; j < 12; ++j) s += draw.uniform(-0.5, 0.5);
        q(i, k) += 0.01 * s;
      }
    }
    const double c = sampled_curvature(q, 10, 3, false, Vec3::Zero(), 0.01, sigma.data())[30].curvature;
    sum += (c - exact) * (c - exact);
    predicted += sigma[30] * sigma[30];
  }
  EXPECT_NEAR(std::sqrt(sum / predicted), 1, 0.2);
}

TEST(ShapeCurve, BadSamples) {
  Points p = helix_samples(20, 0.1);
  const auto call = [&](int half, int degree) {
    return sampled_curvature(p, half, degree, false, Vec3::Zero(), 0, nullptr);
  };
  expect_error(Status::kInvalidArgument, "degree", [&] { call(4, 2); });
  expect_error(Status::kInvalidArgument, "fewer samples than unknowns", [&] { call(1, 4); });
  p.row(7) = p.row(6);
  EXPECT_TRUE(std::isnan(call(3, 4)[6].curvature));
  EXPECT_FALSE(std::isnan(call(3, 4)[15].curvature));
  p.row(12).setConstant(std::nan(""));
  EXPECT_TRUE(std::isnan(call(3, 4)[12].curvature));
  p.conservativeResize(3, 3);
  expect_error(Status::kInsufficientData, "3 points", [&] { call(4, 4); });
}

}  // namespace
}  // namespace sgrt
