// The skin of volumes whose bodies are known: place, sigma, bias, couch, cuts, airways; and contours.
#include "volume/skin.hpp"

#include <cmath>
#include <random>

#include "core/parallel.hpp"
#include "expect.hpp"
#include "scenes.hpp"
#include "volume/contours.hpp"

namespace sgrt {
namespace {

using test::kSilent;

// A CT made from a signed distance (mm, positive outside): a voxel is filled as the edge of its own blur, of this
// sigma, leaves it, in HU, with noise.
struct Ct {
  int nx = 100, ny = 90, nz = 70;
  Vec3 spacing = Vec3(1, 1, 1);
  Mat3 turn = Mat3::Identity();
  double noise = 20, blur = 0.7;
  std::vector<std::int16_t> values;

  Vec3 place(int x, int y, int z) const {
    return turn * (Vec3(x, y, z) - 0.5 * Vec3(nx - 1, ny - 1, nz - 1)).cwiseProduct(spacing);
  }
  template <class Distance>
  Ct& fill(Distance&& distance) {
    std::mt19937 generator(7);
    std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
    values.resize(static_cast<std::size_t>(nx) * ny * nz);
    std::size_t i = 0;
    for (int z = 0; z < nz; ++z) {
      for (int y = 0; y < ny; ++y) {
        for (int x = 0; x < nx; ++x) {
          const double tissue = 0.5 * std::erfc(distance(place(x, y, z)) / (blur * std::sqrt(2.0)));
          values[i++] =
              static_cast<std::int16_t>(std::lround(-1000 + 1000 * tissue + (noise > 0 ? normal(generator) : 0)));
        }
      }
    }
    return *this;
  }
  Voxels view() const {
    Voxels v;
    v.data = values.data();
    v.nx = nx, v.ny = ny, v.nz = nz;
    v.x_stride = 2, v.y_stride = 2 * nx, v.z_stride = 2 * std::int64_t{nx} * ny;
    v.axes = turn * spacing.asDiagonal();
    v.origin = place(0, 0, 0);
    return v;
  }
};

struct Errors {
  double mean = 0, rms = 0, chi = 0, expected = 0;
  int count = 0;
};
template <class Distance>
Errors errors_of(const Skin& skin, Distance&& distance) {
  Errors e;
  for (std::size_t i = 0; i < skin.flags.size(); ++i) {
    if (skin.flags[i]) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double d = distance(skin.mesh.point(row)), sigma = skin.mesh.sigma.size() > 0 ? skin.mesh.sigma[row] : 1;
    e.mean += d;
    e.rms += d * d;
    e.chi += d * d / (sigma * sigma);
    e.expected += skin.bias[row];
    ++e.count;
  }
  e.mean /= e.count, e.expected /= e.count;
  e.rms = std::sqrt(e.rms / e.count), e.chi = std::sqrt(e.chi / e.count);
  return e;
}

const auto ball = [](const Vec3& x) { return (x - Vec3(1.3, -2.1, 0.7)).norm() - 28; };

// REQ-VOL-001
TEST(Skin, OfABallToAFractionOfAVoxel) {
  const Ct ct = Ct().fill(ball);
  const Skin skin = skin_of_volume(kSilent, ct.view(), {});
  const Errors e = errors_of(skin, ball);
  EXPECT_EQ(e.count, skin.mesh.size());
  EXPECT_LT(e.rms, 0.05);
  EXPECT_LT(std::abs(e.mean - e.expected), 0.02);
  EXPECT_GT(e.chi, 0.6);
  EXPECT_LT(e.chi, 1.3);
  EXPECT_NEAR(skin.volume / (4.0 / 3 * M_PI * 28 * 28 * 28), 1, 0.002);
  EXPECT_NEAR(skin.contrast, 1000, 20);
  for (std::int64_t i = 0; i < skin.mesh.size(); i += 97) {
    EXPECT_GT(skin.mesh.normal(i).dot((skin.mesh.point(i) - Vec3(1.3, -2.1, 0.7)).normalized()), 0.99);
  }
}

// REQ-VOL-001
TEST(Skin, ObliqueAndMirroredVolumesGiveTheSameSkin) {
  Ct ct;
  ct.spacing = Vec3(1.2, 1.0, 2.5);
  ct.nz = 40;
  ct.turn = so3_exp(Vec3(0.3, -0.5, 0.2)) * Vec3(1, -1, 1).asDiagonal();
  ct.fill(ball);
  const Skin skin = skin_of_volume(kSilent, ct.view(), {});
  const Errors e = errors_of(skin, ball);
  EXPECT_LT(e.rms, 0.1);
  EXPECT_GT(skin.volume, 0);  // faces turn outward in a mirrored lattice too
}

TEST(Skin, ThresholdInsideTheSkinIsPredicted) {
  const Ct ct = Ct().fill(ball);
  SkinOptions options;
  options.threshold = -200;  // 0.8 of the way: 0.84 sigma of the blur inside
  const Errors e = errors_of(skin_of_volume(kSilent, ct.view(), options), ball);
  EXPECT_LT(e.mean, -0.4);
  EXPECT_NEAR(e.mean, e.expected, 0.05);
}

// REQ-DET-008
TEST(Skin, SameBitsAtAnyThreadCount) {
  const Ct ct = Ct().fill(ball);
  const Skin one = skin_of_volume(kSilent, ct.view(), {});
  for (const int threads : {2, 3, 8}) {
    ThreadPool pool(threads);
    sgrt::Run run;
    run.pool = &pool;
    const Skin other = skin_of_volume(run, ct.view(), {});
    EXPECT_TRUE(one.mesh.points == other.mesh.points && one.mesh.faces == other.mesh.faces);
    EXPECT_TRUE(one.flags == other.flags);
  }
}

// A thigh along z on a couch of 24 mm, touching it; voxels of 2 mm.
const auto limb = [](const Vec3& x) { return std::hypot(x.x(), x.y() + 16) - 48; };
double couch_below(const Vec3& x) {
  return std::max(std::abs(x.y() - 44) - 12, std::abs(x.x()) - 92);
}
Ct coarse() {
  Ct ct;
  ct.spacing = Vec3(2, 2, 2);
  ct.blur = 1.4;
  return ct;
}

// REQ-VOL-002
TEST(Skin, CouchIsRemovedAndItsContactFlagged) {
  const Ct ct = coarse().fill([](const Vec3& x) { return std::min(limb(x), couch_below(x)); });
  SkinOptions options;
  options.down = Vec3(0, 1, 0);
  const Skin skin = skin_of_volume(kSilent, ct.view(), options);
  EXPECT_TRUE(skin.couch_found);
  const Errors e = errors_of(skin, limb);
  EXPECT_LT(e.rms, 0.12);
  EXPECT_GT(e.count, 5000);
  for (std::size_t i = 0; i < skin.flags.size(); ++i) {
    const Vec3 p = skin.mesh.point(static_cast<std::int64_t>(i));
    EXPECT_LT(p.y(), 36);
    const bool end = std::abs(p.z()) > 68.8;
    if (!end && p.y() < 20) {
      EXPECT_EQ(skin.flags[i], 0) << p.transpose();
    }
    if (!end && p.y() > 31) {
      EXPECT_TRUE(skin.flags[i] & kSkinContact);
    }
  }
}

// REQ-VOL-002
TEST(Skin, WithoutACouchNothingIsCutAway) {
  const Ct ct = coarse().fill(limb);
  SkinOptions options;
  options.down = Vec3(0, 1, 0);
  const Skin skin = skin_of_volume(kSilent, ct.view(), options);
  EXPECT_FALSE(skin.couch_found);
  EXPECT_LT(errors_of(skin, limb).rms, 0.12);
}

TEST(Skin, EndsOfTheScanAreCuts) {
  const Skin skin = skin_of_volume(kSilent, coarse().fill(limb).view(), {});
  int cuts = 0;
  for (std::size_t i = 0; i < skin.flags.size(); ++i) {
    const bool end = std::abs(skin.mesh.points(static_cast<Eigen::Index>(i), 2)) > 68.8;
    if (skin.flags[i] & kSkinCut) {
      EXPECT_TRUE(end);
      ++cuts;
    }
  }
  EXPECT_GT(cuts, 3000);
  const Surface open = part_without(skin, 15);
  EXPECT_LT(open.points.col(2).maxCoeff(), 69.5);
  EXPECT_GT(open.faces.rows(), 10000);
}

TEST(Skin, AirwaysAndCavitiesAreClosed) {
  // A cavity, and a channel of 3 mm radius from it to the outside.
  const auto hollow = [](const Vec3& x) {
    const double cavity = 10 - (x - Vec3(1.3, -2.1, 0.7)).norm();
    const double channel = x.x() > 0 ? 3 - std::hypot(x.y() + 2.1, x.z() - 0.7) : -1;
    return std::max({ball(x), cavity, channel});
  };
  const Skin skin = skin_of_volume(kSilent, Ct().fill(hollow).view(), {});
  for (std::int64_t i = 0; i < skin.mesh.size(); ++i) EXPECT_GT(ball(skin.mesh.point(i)), -9);
  EXPECT_GT(std::count(skin.flags.begin(), skin.flags.end(), kSkinClosed), 10);
}

TEST(Skin, NoBodyIsAnAnswer) {
  const Ct air = Ct().fill([](const Vec3&) { return 100.0; });
  test::expect_error(Status::kNotFound, "no voxel is above threshold_hu",
                     [&] { skin_of_volume(kSilent, air.view(), {}); });
  const Ct full = Ct().fill([](const Vec3&) { return -100.0; });
  test::expect_error(Status::kNotFound, "meets air nowhere", [&] { skin_of_volume(kSilent, full.view(), {}); });
}

// --------------------------------------------------------------------------------------------------------- contours

Points circle(double cx, double cy, double r, double z, int n = 180) {
  Points c(n, 3);
  for (int i = 0; i < n; ++i) c.row(i) << cx + r * std::cos(2 * M_PI * i / n), cy + r * std::sin(2 * M_PI * i / n), z;
  return c;
}

TEST(Contours, SurfaceGoesThroughThem) {
  std::vector<Points> contours;
  for (int k = 0; k <= 20; ++k) contours.push_back(circle(0.3 * k, 0, 40 + 10 * std::sin(0.2 * k), 3.0 * k));
  const ClosedContours body = close_contours(kSilent, contours, {});
  EXPECT_EQ(body.slices, 21);
  EXPECT_NEAR(body.spacing, 3, 1e-12);
  for (Eigen::Index i = 0; i < body.skin.mesh.size(); ++i) {
    const Vec3 p = body.skin.mesh.point(i);
    const double k = p.z() / 3;
    if (body.skin.flags[static_cast<std::size_t>(i)]) continue;
    EXPECT_NEAR(std::hypot(p.x() - 0.3 * k, p.y()), 40 + 10 * std::sin(0.2 * k), 0.1);
  }
}

// REQ-VOL-004
TEST(Contours, LegsBranchAndHolesStay) {
  std::vector<Points> contours;
  for (int k = 0; k < 10; ++k) {
    contours.push_back(circle(-25, 0, 20, 5.0 * k));
    contours.push_back(circle(25, 0, 20, 5.0 * k));
  }
  for (int k = 10; k < 20; ++k) {
    contours.push_back(circle(0, 0, 46, 5.0 * k));
    contours.push_back(circle(0, 0, 10, 5.0 * k));  // even-odd: a hole
  }
  const ClosedContours body = close_contours(kSilent, contours, {});
  const double legs = 2 * M_PI * 400 * 45, trunk = M_PI * (46 * 46 - 100) * 45;
  EXPECT_GT(body.skin.volume, legs + trunk);
  EXPECT_LT(body.skin.volume, legs + trunk + M_PI * 46 * 46 * 5);
}

// REQ-VOL-004
TEST(Contours, AnyPlaneAndAnyOrder) {
  std::vector<Points> flat, turned;
  const Mat3 R = so3_exp(Vec3(1.1, -0.4, 0.8));
  for (int k : {4, 0, 3, 1, 5, 2}) {
    flat.push_back(circle(0, 0, 30, 4.0 * k));
    turned.push_back(flat.back() * R.transpose());
  }
  EXPECT_NEAR(close_contours(kSilent, flat, {}).skin.volume / (M_PI * 900 * 20), 1, 2e-3);
  EXPECT_NEAR(close_contours(kSilent, turned, {}).skin.volume / (M_PI * 900 * 20), 1, 2e-3);
}

TEST(Contours, NonsenseIsNamed) {
  std::vector<Points> c{circle(0, 0, 30, 0), circle(0, 0, 30, 3), circle(0, 0, 30, 6)};
  test::expect_error(Status::kInsufficientData, "all on one slice", [&] { close_contours(kSilent, {c[0]}, {}); });
  c[1](7, 2) += 0.3;
  test::expect_error(Status::kInvalidArgument, "contours[1]: leaves the plane",
                     [&] { close_contours(kSilent, c, {}); });
  c[1] = c[0].topRows(2);
  test::expect_error(Status::kInvalidArgument, "contours[1]: 2 points", [&] { close_contours(kSilent, c, {}); });
  c.assign(3, circle(0, 0, 0, 0));
  test::expect_error(Status::kInsufficientData, "area", [&] { close_contours(kSilent, c, {}); });
}

}  // namespace
}  // namespace sgrt
