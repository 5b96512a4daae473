// Points, derivatives and normals of NURBS: against de Boor in long double, fixtures of other libraries, and the
// chapter's own figure.

#include "core/parallel.hpp"
#include "nurbs/draw.hpp"
#include "nurbs/evaluate.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

TEST(NurbsBasis, SumsToOneAndIsLocal) {
  Draw draw(1);
  for (int degree = 1; degree <= 9; ++degree) {
    const SplineBasis basis = test::draw_basis(draw, degree, degree + 8, degree % 2 == 0);
    check_basis(basis, degree + 8, "knots");
    double N[3 * (kMaxDegree + 1)];
    for (int trial = 0; trial < 50; ++trial) {
      const double u = test::draw_parameter(draw, basis);
      const int k = find_span(basis, u);
      EXPECT_LE(basis.knots[k], u);
      EXPECT_GT(basis.knots[k + 1], basis.knots[k]);
      basis_derivatives(basis, k, u, 2, N);
      double sum[3] = {0, 0, 0};
      for (int d = 0; d < 3; ++d) {
        for (int a = 0; a <= degree; ++a) sum[d] += N[d * (degree + 1) + a];
      }
      EXPECT_NEAR(sum[0], 1, 1e-14);
      EXPECT_NEAR(sum[1], 0, 1e-11);
      EXPECT_NEAR(sum[2], 0, 1e-8);
    }
  }
}

// Fig. 10.4: five control points, degrees 1 to 3. The values are worked by hand from eq. 10.5 and 10.6.
TEST(NurbsBasis, FigureOfTheChapter) {
  const auto all = [](const SplineBasis& basis, double u) {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(basis.size());
    const int k = find_span(basis, u);
    basis_functions(basis, k, u, out.data() + k - basis.degree);
    return out;
  };
  const auto expect = [&](const SplineBasis& basis, double u, std::vector<double> values) {
    const Eigen::VectorXd N = all(basis, u);
    ASSERT_EQ(N.size(), 5);
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(N[i], values[i], 1e-15) << "degree " << basis.degree << " u " << u;
  };
  const SplineBasis linear{1, {0, 0, .25, .5, .75, 1, 1}};
  expect(linear, 0.125, {.5, .5, 0, 0, 0});
  expect(linear, 0.5, {0, 0, 1, 0, 0});
  expect(linear, 1, {0, 0, 0, 0, 1});
  const SplineBasis quadratic{2, {0, 0, 0, .33, .67, 1, 1, 1}};
  expect(quadratic, 0, {1, 0, 0, 0, 0});
  // N_1 = (.67 - .5)^2 / (.67 .34), N_3 = (.5 - .33)^2 / (.34 .67), N_2 the rest
  expect(quadratic, 0.5, {0, .0289 / .2278, 1 - 2 * .0289 / .2278, .0289 / .2278, 0});
  expect(quadratic, 1, {0, 0, 0, 0, 1});
  const SplineBasis cubic{3, {0, 0, 0, 0, .5, 1, 1, 1, 1}};
  expect(cubic, 0.25, {1. / 8, 19. / 32, 1. / 4, 1. / 32, 0});
  expect(cubic, 0.5, {0, .25, .5, .25, 0});
  expect(cubic, 1, {0, 0, 0, 0, 1});
}

// REQ-NURBS-006
TEST(NurbsBasis, BadKnots) {
  const auto refuse = [](SplineBasis basis, int count, const std::string& words,
                         Status status = Status::kInvalidArgument) {
    expect_error(status, words, [&] { check_basis(basis, count, "knots"); });
  };
  refuse({2, {0, 0, 0, 1, 1}}, 3, "5 knots, expected 6 for degree 2 and 3 control points");
  refuse({2, {0, 0, 0, 1, 1, 1, 1}}, 3, "7 knots, expected 6");
  refuse({2, {0, 0, 0, 1, 0.5, 1}}, 3, "knots[4]: 0.5 after 1, expected no decrease");
  refuse({2, {0, 0, 0, 1, 1, std::nan("")}}, 3, "knots[5]: nan");
  refuse({1, {0, 0, 1e-310, 1e-310}}, 2, "knots[2]: 1e-310, expected the same knot");
  refuse({1, {0, 0, 1e200, 1e200}}, 2, "knots[2]: 1e+200");
  refuse({2, {0, 0, 0, 0, 0, 0}}, 3, "stands 4 times");
  refuse({1, {0, 0, 0.5, 0.5, 1, 1}}, 4, "knots[3]: 0.5 stands 2 times, expected at most 1");
  refuse({2, {0, 0, 0, 1, 1, 1}}, 2, "2 control points, expected at least 3");
  refuse({0, {0, 1}}, 1, "degree 0");
  refuse({25, {0, 1}}, 1, "degree 25", Status::kLimit);
}

// REQ-NURBS-001
TEST(NurbsCurve, AgainstDeBoor) {
  Draw draw(2);
  double worst = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const int degree = 1 + trial % 7;
    const NurbsCurve curve =
        test::draw_curve(draw, degree, degree + 1 + static_cast<int>(draw.bits() % 12), trial % 3 > 0, trial % 2 > 0);
    for (int i = 0; i < 20; ++i) {
      const double u = i == 0   ? curve.basis.begin()
                       : i == 1 ? curve.basis.end()
                                : test::draw_parameter(draw, curve.basis);
      worst = std::max(worst, (evaluate(curve, u) - test::vec3_of(test::truth(curve, u))).norm() / 100);
    }
  }
  EXPECT_LT(worst, 1e-13);
  RecordProperty("worst", std::to_string(worst));
}

TEST(NurbsSurface, AgainstDeBoor) {
  Draw draw(3);
  double worst = 0, worst_grid = 0;
  for (int trial = 0; trial < 120; ++trial) {
    const int p = 1 + trial % 7, q = trial % 5 == 0 ? p : 1 + static_cast<int>(draw.bits() % 7);
    const NurbsSurface s = test::draw_surface(draw, p, q, p + 1 + static_cast<int>(draw.bits() % 7),
                                              q + 1 + static_cast<int>(draw.bits() % 7), trial % 3 > 0, trial % 2 > 0);
    const SurfaceEvaluator evaluator(s);
    sgrt::Run run;
    for (int i = 0; i < 12; ++i) {
      const double u = i == 0 ? s.basis[0].end() : test::draw_parameter(draw, s.basis[0]);
      const double v = i == 1 ? s.basis[1].end() : i == 2 ? s.basis[1].begin() : test::draw_parameter(draw, s.basis[1]);
      const Vec3 expected = test::vec3_of(test::truth(s, u, v));
      Vec3 fast;
      const double uv[2] = {u, v};
      run.isa = i % 2 == 0 ? Isa::kBaseline : detect_isa();
      evaluate_points(run, evaluator, uv, 1, 0, fast.data());
      worst = std::max(worst, (evaluate(s, u, v) - expected).norm() / 100);
      worst_grid = std::max(worst_grid, (fast - expected).norm() / 100);
    }
  }
  EXPECT_LT(worst, 1e-13);
  EXPECT_LT(worst_grid, 1e-13);
}

// Richardson's central differences of the long double truth, within a span: good to about 1e-12.
template <class Function>
std::array<long double, 3> difference(Function&& f, long double x, long double h) {
  const auto a = f(x + h), b = f(x - h), c = f(x + 2 * h), d = f(x - 2 * h), e = f(x + 3 * h), g = f(x - 3 * h);
  std::array<long double, 3> out;
  for (int i = 0; i < 3; ++i) out[i] = (45 * (a[i] - b[i]) - 9 * (c[i] - d[i]) + (e[i] - g[i])) / (60 * h);
  return out;
}

// REQ-NURBS-002
TEST(NurbsSurface, DerivativesAgainstDifferences) {
  Draw draw(4);
  double worst[6] = {};
  for (int trial = 0; trial < 60; ++trial) {
    const int p = 2 + trial % 4, q = trial % 2 ? p : 2 + trial % 3;
    const NurbsSurface s = test::draw_surface(draw, p, q, p + 5, q + 4, trial % 3 > 0, trial % 2 > 0);
    const std::vector<double> us = breaks(s.basis[0]), vs = breaks(s.basis[1]);
    const std::size_t a = draw.bits() % (us.size() - 1), b = draw.bits() % (vs.size() - 1);
    const double hu = us[a + 1] - us[a], hv = vs[b + 1] - vs[b];
    const double u = us[a] + hu * draw.uniform(0.3, 0.7), v = vs[b] + hv * draw.uniform(0.3, 0.7);
    const auto S = [&](long double x, long double y) { return test::truth(s, x, y); };
    const long double du = 0.001L * hu, dv = 0.001L * hv;
    const auto Su = [&](long double x, long double y) {
      return difference([&](long double t) { return S(t, y); }, x, du);
    };
    const auto Sv = [&](long double x, long double y) {
      return difference([&](long double t) { return S(x, t); }, y, dv);
    };
    const Vec3 expected[6] = {test::vec3_of(S(u, v)),
                              test::vec3_of(Su(u, v)),
                              test::vec3_of(Sv(u, v)),
                              test::vec3_of(difference([&](long double t) { return Su(t, v); }, u, du)),
                              test::vec3_of(difference([&](long double t) { return Su(u, t); }, v, dv)),
                              test::vec3_of(difference([&](long double t) { return Sv(u, t); }, v, dv))};
    const double unit[6] = {1, hu, hv, hu * hu, hu * hv, hv * hv};
    Vec3 d[6], fast[6];
    derivatives(s, u, v, 2, d);
    const double uv[2] = {u, v};
    evaluate_points(sgrt::Run{}, SurfaceEvaluator(s), uv, 1, 2, fast[0].data());
    for (int i = 0; i < 6; ++i) {
      const double scale = 100 + expected[i].norm() * unit[i];
      worst[i] = std::max(
          {worst[i], (d[i] - expected[i]).norm() * unit[i] / scale, (fast[i] - expected[i]).norm() * unit[i] / scale});
    }
  }
  for (double w : worst) EXPECT_LT(w, 1e-10);
}

TEST(NurbsSurface, HigherDerivativesAreDerivativesOfLowerOnes) {
  Draw draw(5);
  const NurbsSurface s = test::draw_surface(draw, 4, 3, 7, 6, true, true);
  const double u = 0.5 * (breaks(s.basis[0])[0] + breaks(s.basis[0])[1]),
               v = 0.5 * (breaks(s.basis[1])[0] + breaks(s.basis[1])[1]);
  Vec3 d[derivative_count(5)], plus[derivative_count(5)], minus[derivative_count(5)];
  derivatives(s, u, v, 5, d);
  const double h = 1e-5;
  for (int direction = 0; direction < 2; ++direction) {
    derivatives(s, u + (direction == 0 ? h : 0), v + (direction == 1 ? h : 0), 5, plus);
    derivatives(s, u - (direction == 0 ? h : 0), v - (direction == 1 ? h : 0), 5, minus);
    for (int k = 0; k <= 4; ++k) {
      for (int l = 0; k + l <= 4; ++l) {
        const int i = derivative_index(k, l), next = derivative_index(k + (direction == 0), l + (direction == 1));
        EXPECT_LT(((plus[i] - minus[i]) / (2 * h) - d[next]).norm(), 1e-5 * (1 + d[next].norm())) << k << l;
      }
    }
  }
}

// Beyond the second derivative, where no kernel is: scattered and on a grid the same as one by one.
TEST(NurbsEvaluator, ThirdDerivatives) {
  Draw draw(15);
  const NurbsSurface s = test::draw_surface(draw, 4, 3, 7, 6, true, true);
  const SurfaceEvaluator evaluator(s);
  const double us[] = {0.21, 0.5, 0.77}, vs[] = {0.1, 0.9};
  const int count = derivative_count(3);
  std::vector<Vec3> scattered(6 * count), grid(6 * count), one(count);
  std::vector<double> uv;
  for (const double u : us)
    for (const double v : vs) uv.insert(uv.end(), {u, v});
  evaluate_points(sgrt::Run{}, evaluator, uv.data(), 6, 3, scattered[0].data());
  evaluate_grid(sgrt::Run{}, evaluator, us, 3, vs, 2, 3, grid[0].data());
  for (int i = 0; i < 6; ++i) {
    derivatives(s, uv[2 * i], uv[2 * i + 1], 3, one.data());
    for (int k = 0; k < count; ++k) {
      EXPECT_EQ(scattered[i * count + k], one[k]);
      EXPECT_EQ(grid[i * count + k], one[k]);
    }
  }
}

// REQ-DET-005
TEST(NurbsEvaluator, SameBitsOnGridScatteredAndAnyThreads) {
  Draw draw(6);
  for (const bool rational : {false, true}) {
    for (const int degree : {2, 3}) {
      const NurbsSurface s = test::draw_surface(draw, degree, 3, 20, 24, true, rational);
      const SurfaceEvaluator evaluator(s);
      std::vector<double> u, v, uv;
      for (int i = 0; i < 33; ++i) u.push_back(test::draw_parameter(draw, s.basis[0]));
      for (int i = 0; i < 301; ++i) v.push_back(test::draw_parameter(draw, s.basis[1]));
      v[7] = s.basis[1].end();
      for (double a : u) {
        for (double b : v) uv.insert(uv.end(), {a, b});
      }
      for (int order = 0; order <= 2; ++order) {
        const std::size_t size = uv.size() / 2 * 3 * derivative_count(order);
        std::vector<double> first(size);
        evaluate_points(sgrt::Run{}, evaluator, uv.data(), uv.size() / 2, order, first.data());
        for (const Isa isa : {Isa::kBaseline, detect_isa()}) {
          for (const int threads : {1, 3}) {
            ThreadPool pool(threads);
            sgrt::Run run;
            run.pool = &pool;
            run.isa = isa;
            std::vector<double> grid(size), points(size);
            evaluate_grid(run, evaluator, u.data(), u.size(), v.data(), v.size(), order, grid.data());
            evaluate_points(run, evaluator, uv.data(), uv.size() / 2, order, points.data());
            EXPECT_EQ(grid, first);
            EXPECT_EQ(points, first);
          }
        }
      }
    }
  }
}

// REQ-NURBS-001
TEST(NurbsSurface, WorkedExampleOfTheBook) {  // S(5/2, 1) = (2, 98/27, 68/27)
  NurbsSurface s{
      {{2, {0, 0, 0, 1, 2, 3, 4, 4, 5, 5, 5}}, {2, {0, 0, 0, 1, 2, 3, 3, 3}}}, Points(40, 3), Eigen::VectorXd(40)};
  s.points.setZero();
  s.weights.setOnes();
  const double rows[3][5][4] = {{{0, 2, 4, 1}, {0, 2, 4, 1}, {0, 6, 4, 2}, {0, 2, 0, 1}, {1, 2, 0, 1}},
                                {{3, 6, 8, 2}, {4, 6, 8, 2}, {12, 24, 12, 6}, {4, 6, 0, 2}, {5, 6, 0, 2}},
                                {{3, 2, 4, 1}, {4, 2, 4, 1}, {8, 6, 4, 2}, {4, 2, 0, 1}, {5, 2, 0, 1}}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 5; ++j) {
      const double* h = rows[i][j];
      s.points.row((i + 2) * 5 + j) << h[0] / h[3], h[1] / h[3], h[2] / h[3];
      s.weights[(i + 2) * 5 + j] = h[3];
    }
  }
  EXPECT_LT((evaluate(make_nurbs_surface(s), 2.5, 1) - Vec3(2, 98. / 27, 68. / 27)).norm(), 1e-14);
}

// REQ-NURBS-006
TEST(NurbsSurface, BadControlPoints) {
  Draw draw(7);
  NurbsSurface s = test::draw_surface(draw, 2, 2, 4, 4, true, true);
  const auto refuse = [](NurbsSurface bad, const std::string& words) {
    expect_error(Status::kInvalidArgument, words, [&] { make_nurbs_surface(bad); });
  };
  NurbsSurface bad = s;
  bad.weights[3] = 0;
  refuse(bad, "weights[3]: 0, expected above 0");
  bad.weights[3] = -1;
  refuse(bad, "weights[3]: -1");
  bad = s;
  bad.points(5, 1) = std::nan("");
  refuse(bad, "control_points[5]: nan");
  bad = s;
  bad.weights.conservativeResize(3);
  refuse(bad, "weights: 3, expected one a control point, 16");
  bad = s;
  bad.points.conservativeResize(15, 3);
  refuse(bad, "control_points: 15 points, expected 16");
  bad = s;
  bad.weights.setConstant(7);
  EXPECT_FALSE(make_nurbs_surface(bad).rational());
}

}  // namespace
}  // namespace sgrt
