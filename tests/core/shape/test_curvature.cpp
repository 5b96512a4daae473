// Curvature of clouds, grids and meshes: convergence, noise against the predicted sigma, the scale, and bad input.

#include <cmath>

#include "core/parallel.hpp"
#include "expect.hpp"
#include "shape/curvature.hpp"
#include "shape/extrema.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

double normal_draw(Draw& draw) {
  double s = 0;
  for (int j = 0; j < 12; ++j) s += draw.uniform(-0.5, 0.5);
  return s;
}

// A sphere's points, evenly spread (Fibonacci), with outward normals.
Surface sphere(double radius, double spacing) {
  const int n = static_cast<int>(4 * 3.14159265358979 * radius * radius / (spacing * spacing));
  Surface s;
  s.points.resize(n, 3);
  s.normals.resize(n, 3);
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2 * i + 1.0) / n, turn = 2.399963229728653 * i, rho = std::sqrt(1 - z * z);
    s.normals.row(i) << rho * std::cos(turn), rho * std::sin(turn), z;
    s.points.row(i) = radius * s.normals.row(i);
  }
  return s;
}

// z = 8 cos(x / 15) cos(y / 20) on a grid, as mesh, grid or cloud.
struct Wave {
  Surface surface;
  Eigen::VectorXd mean, gauss;
};

Wave wave(int side, double spacing, bool mesh, bool grid) {
  Wave w;
  Surface& s = w.surface;
  const int n = side * side;
  s.points.resize(n, 3);
  s.normals.resize(n, 3);
  w.mean.resize(n);
  w.gauss.resize(n);
  for (int i = 0; i < n; ++i) {
    const double x = spacing * (i % side - side / 2), y = spacing * (i / side - side / 2);
    const double cx = std::cos(x / 15), sx = std::sin(x / 15), cy = std::cos(y / 20), sy = std::sin(y / 20);
    const double fx = -8 * sx * cy / 15, fy = -8 * cx * sy / 20, fxx = -8 * cx * cy / 225, fyy = -8 * cx * cy / 400,
                 fxy = 8 * sx * sy / 300, g = 1 + fx * fx + fy * fy;
    s.points.row(i) << x, y, 8 * cx * cy;
    s.normals.row(i) << -fx / std::sqrt(g), -fy / std::sqrt(g), 1 / std::sqrt(g);
    w.mean[i] = -((1 + fy * fy) * fxx - 2 * fx * fy * fxy + (1 + fx * fx) * fyy) / (2 * std::pow(g, 1.5));
    w.gauss[i] = (fxx * fyy - fxy * fxy) / (g * g);
  }
  if (grid) s.height = s.width = side;
  if (mesh) {
    s.faces.resize(2 * (side - 1) * (side - 1), 3);
    for (int i = 0, f = 0; i + 1 < side; ++i) {
      for (int j = 0; j + 1 < side; ++j) {
        const int a = i * side + j;
        s.faces.row(f++) << a, a + 1, a + side + 1;
        s.faces.row(f++) << a, a + side + 1, a + side;
      }
    }
  }
  return w;
}

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
  const Surface s = sphere(10, 0.7);
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
      Surface s = sphere(radius, 1);
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
  Surface s = sphere(15, 1.2);
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

TEST(ShapeExtrema, PersistenceFindsTheBumpsAndNoiseMakesNone) {
  const int side = 61;
  Draw draw(14);
  Wave w = wave(side, 1, false, true);
  CurvatureOptions o;
  o.radius = 6;
  for (std::int64_t i = 0; i < w.surface.size(); ++i) {
    const double x = w.surface.points(i, 0), y = w.surface.points(i, 1);
    w.surface.points(i, 2) = 4 * std::exp(-((x - 12) * (x - 12) + y * y) / 50) -
                             4 * std::exp(-((x + 12) * (x + 12) + y * y) / 50) + 0.05 * normal_draw(draw);
  }
  w.surface.normals.rowwise() = Eigen::RowVector3d(0, 0, 1);
  const CurvatureField f = surface_curvature(sgrt::Run{}, w.surface, o);
  const auto found = extrema(sgrt::Run{}, w.surface, f, 4);
  ASSERT_GE(found.size(), 2u);
  EXPECT_NE(found[0].sign, found[1].sign);
  for (int k = 0; k < 2; ++k) {
    const Vec3 at = w.surface.point(found[static_cast<std::size_t>(k)].row);
    EXPECT_NEAR(at[0], 12 * found[static_cast<std::size_t>(k)].sign, 1.5);
    EXPECT_NEAR(at[1], 0, 1.5);
  }
  // A plane with noise has none that stand out.
  for (std::int64_t i = 0; i < w.surface.size(); ++i) w.surface.points(i, 2) = 0.05 * normal_draw(draw);
  const CurvatureField flat = surface_curvature(sgrt::Run{}, w.surface, o);
  EXPECT_LE(extrema(sgrt::Run{}, w.surface, flat, 4).size(), 1u);
}

TEST(ShapeExtrema, CrestsOfAWave) {
  const int side = 61;
  Wave w = wave(side, 1, false, true);
  for (std::int64_t i = 0; i < w.surface.size(); ++i) {
    const double x = w.surface.points(i, 0);
    w.surface.points(i, 2) = 3 * std::cos(x / 5);
    w.surface.normals.row(i) = Vec3(0.6 * std::sin(x / 5), 0, 1).normalized().transpose();
  }
  CurvatureOptions o;
  o.radius = 2.5;
  o.noise = 1e-3;
  const CurvatureField f = surface_curvature(sgrt::Run{}, w.surface, o);
  const std::vector<std::uint8_t> lines = crests(sgrt::Run{}, w.surface, f, 3);
  int ridge = 0, valley = 0;
  for (std::int64_t i = 0; i < w.surface.size(); ++i) {
    const double phase = std::cos(w.surface.points(i, 0) / 5);
    const int line = lines[static_cast<std::size_t>(i)];
    ridge += line == 1;
    valley += line == 2;
    if (line == 1) {
      EXPECT_GT(phase, 0.95);
    } else if (line == 2) {
      EXPECT_LT(phase, -0.95);
    }
  }
  EXPECT_GT(ridge, 40);
  EXPECT_GT(valley, 40);
}

}  // namespace
}  // namespace sgrt
