// Curvature of clouds, grids and meshes: convergence, noise against the predicted sigma, and the scale.

#include <cmath>

#include "core/parallel.hpp"
#include "shape/curvature.hpp"
#include "shape/jet.hpp"
#include "shape/surfaces.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::normal_draw;
using test::sphere_cloud;
using test::Wave;
using test::wave;

double worst(const Wave& w, const CurvatureField& f, int side, int margin) {
  double most = 0;
  for (int i = margin; i < side - margin; ++i) {
    for (int j = margin; j < side - margin; ++j)
      most = std::max(most, std::abs(f.mean[i * side + j] - w.mean[i * side + j]));
  }
  return most;
}

TEST(ShapeCurvature, ConvergesWithTheSpacing) {
  for (const int degree : {2, 3, 4}) {
    double before = 0;
    for (const double spacing : {2.0, 1.0, 0.5}) {
      const int side = 41;
      const Wave w = wave(side, spacing, degree == 2, degree == 3);
      CurvatureOptions o;
      o.degree = degree;
      o.radius = (degree == 4 ? 4.6 : 3.6) * spacing;
      const double error = worst(w, surface_curvature(sgrt::Run{}, w.surface, o), side, 12);
      // On a regular grid odd terms cancel: order 2 for degrees 2 and 3; degree 4 has 3.
      const double order = degree == 4 ? 3.0 : 1.8;
      if (before > 0) {
        EXPECT_LT(error, before / std::pow(2, order)) << "degree " << degree << ", spacing " << spacing;
      }
      before = error;
    }
    EXPECT_LT(before, degree == 4 ? 2e-7 : 2e-4);
  }
}

// A quadric with parabolas for sections would be off by r^2 / (4 R^2): 4 % at 4 mm, 16 % at 8.
TEST(ShapeCurvature, SphereHasNoBiasAtAnyRadius) {
  const Surface s = sphere_cloud(10, 0.7);
  for (const double radius : {2.5, 5.0, 8.0}) {
    CurvatureOptions o;
    o.radius = radius;
    const CurvatureField f = surface_curvature(sgrt::Run{}, s, o);
    EXPECT_EQ(f.known, s.size());
    EXPECT_LT((f.mean.array() - 0.1).abs().maxCoeff(), radius < 3 ? 1e-4 : 1e-3);
    EXPECT_LT((f.gauss.array() - 0.01).abs().maxCoeff(), 2e-4);
    EXPECT_EQ(*std::min_element(f.hk.begin(), f.hk.end()), static_cast<std::uint8_t>(HkClass::kPeak));
  }
}

// R = 10 mm, s = 0.3 mm, h = 1 mm: at most 8 % (the best fixed radius of a quadric has 10 %); R = 20: 4.5 %.
TEST(ShapeCurvature, NoiseAndItsPrediction) {
  Draw draw(11);
  for (const auto& [radius, limit] : {std::pair(10.0, 0.08), std::pair(20.0, 0.045)}) {
    double sum = 0, predicted = 0;
    std::int64_t count = 0;
    for (int trial = 0; trial < 3; ++trial) {
      Surface s = sphere_cloud(radius, 1);
      for (std::int64_t i = 0; i < s.size(); ++i) s.points.row(i) += 0.3 * normal_draw(draw) * s.normals.row(i);
      const CurvatureField f = surface_curvature(sgrt::Run{}, s, {});
      EXPECT_NEAR(f.noise, 0.3, 0.03);
      EXPECT_GT(f.known, 0.99 * static_cast<double>(s.size()));
      for (std::int64_t i = 0; i < s.size(); ++i) {
        if (f.reason[i] != 0) continue;
        sum += std::pow(f.mean[i] - 1 / radius, 2);
        predicted += std::pow(f.sigma_mean[i], 2);
        ++count;
      }
    }
    EXPECT_LT(std::sqrt(sum / static_cast<double>(count)) * radius, limit);
    EXPECT_NEAR(std::sqrt(sum / predicted), 1, 0.25);
  }
}

// The same where curvature changes from place to place: what the disc's bias is has to be found from the points.
// RMS of the error of H over the RMS of H.
TEST(ShapeCurvature, NoiseOffTheSphere) {
  struct Case {
    const char* name;
    test::Known shape;
    double limit;
  };
  const Case cases[] = {{"ellipsoid 20, 10, 10", test::ellipsoid_cloud(20, 10, 1), 0.08},
                        {"ellipsoid 40, 20, 20", test::ellipsoid_cloud(40, 20, 1), 0.045},
                        {"torus 20, 10", test::torus_cloud(20, 10, 1), 0.08},
                        {"torus 40, 20", test::torus_cloud(40, 20, 1), 0.045}};
  Draw draw(14);
  for (const Case& c : cases) {
    Surface s = c.shape.surface;
    for (std::int64_t i = 0; i < s.size(); ++i) s.points.row(i) += 0.3 * normal_draw(draw) * s.normals.row(i);
    const CurvatureField f = surface_curvature(sgrt::Run{}, s, {});
    double sum = 0, size = 0, predicted = 0;
    for (std::int64_t i = 0; i < s.size(); ++i) {
      if (f.reason[static_cast<std::size_t>(i)] != 0) continue;
      sum += std::pow(f.mean[i] - c.shape.mean[i], 2);
      size += std::pow(c.shape.mean[i], 2);
      predicted += std::pow(f.sigma_mean[i], 2);
    }
    EXPECT_GT(f.known, 0.99 * static_cast<double>(s.size())) << c.name;
    EXPECT_LT(std::sqrt(sum / size), c.limit) << c.name;
    EXPECT_NEAR(std::sqrt(sum / predicted), 1, 0.25) << c.name;
  }
}

// At a fixed radius nothing but noise: every sigma within 20 %.
// REQ-CURV-002
TEST(ShapeCurvature, SigmasAsSampled) {
  Draw draw(12);
  const int side = 41;
  const Wave w = wave(side, 1, false, true);
  CurvatureOptions o;
  o.radius = 6;
  o.noise = 0.1;
  const CurvatureField exact = surface_curvature(sgrt::Run{}, w.surface, o);
  const Eigen::VectorXd* truth[] = {&exact.k1, &exact.k2, &exact.mean, &exact.gauss, &exact.shape_index};
  double sum[5] = {}, predicted[5] = {};
  for (int trial = 0; trial < 8; ++trial) {
    Surface s = w.surface;
    for (std::int64_t i = 0; i < s.size(); ++i) s.points.row(i) += 0.1 * normal_draw(draw) * s.normals.row(i);
    const CurvatureField f = surface_curvature(sgrt::Run{}, s, o);
    const Eigen::VectorXd* seen[] = {&f.k1, &f.k2, &f.mean, &f.gauss, &f.shape_index};
    const Eigen::VectorXd* sigma[] = {&f.sigma_k1, &f.sigma_k2, &f.sigma_mean, &f.sigma_gauss, &f.sigma_shape_index};
    for (int i = 8; i < side - 8; ++i) {
      for (int j = 8; j < side - 8; ++j) {
        const int at = i * side + j;
        for (int k = 0; k < 5; ++k) {
          sum[k] += std::pow((*seen[k])[at] - (*truth[k])[at], 2);
          predicted[k] += std::pow((*sigma[k])[at], 2);
        }
      }
    }
  }
  for (int k = 0; k < 5; ++k) EXPECT_NEAR(std::sqrt(sum[k] / predicted[k]), 1, 0.2) << k;
}

// REQ-DET-006
TEST(ShapeCurvature, SameBitsAtAnyThreadsAndIsa) {
  Draw draw(13);
  Surface s = sphere_cloud(15, 1.2);
  for (std::int64_t i = 0; i < s.size(); ++i) s.points.row(i) += 0.2 * normal_draw(draw) * s.normals.row(i);
  const CurvatureField one = surface_curvature(sgrt::Run{}, s, {});
  ThreadPool pool(3);
  sgrt::Run run;
  run.pool = &pool;
  run.isa = detect_isa();
  const CurvatureField other = surface_curvature(run, s, {});
  EXPECT_TRUE((one.mean.array() == other.mean.array() || one.mean.array().isNaN()).all());
  EXPECT_TRUE((one.sigma_k1.array() == other.sigma_k1.array() || one.sigma_k1.array().isNaN()).all());
}

TEST(Jet, ADiscOfTooManyPointsIsThinned) {
  const int side = 201;
  const Wave w = wave(side, 0.05, false, true);
  const Pyramid pyramid = make_pyramid(w.surface, 0.05);
  const std::int64_t middle = side * side / 2;
  JetFitter fitter(sgrt::Run{}, pyramid, 4);
  const Jet whole = fitter.fit(w.surface.point(middle), w.surface.normal(middle), 3);    // 11,300 points
  const Jet thinned = fitter.fit(w.surface.point(middle), w.surface.normal(middle), 4);  // 20,100
  ASSERT_TRUE(whole.found() && thinned.found());
  EXPECT_NEAR(0.5 * (whole.a + whole.c) / w.mean[middle], 1, 1e-3);
  EXPECT_NEAR(0.5 * (thinned.a + thinned.c) / w.mean[middle], 1, 1e-3);
  EXPECT_LT((thinned.foot - w.surface.point(middle)).norm(), 1e-3);
  EXPECT_LT(thinned.covariance(0, 0), whole.covariance(0, 0));  // wider, if not of all its points
}

}  // namespace
}  // namespace sgrt
