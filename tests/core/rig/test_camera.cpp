// Projection: values by hand and by OpenCV's documented formula, Jacobians by complex step, round trips over whole
// images of real lenses, and the fold.
#include <cmath>
#include <complex>
#include <limits>

#include "expect.hpp"
#include "rig/lenses.hpp"
#include "rig/rig.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;
using test::lens;
using test::real_lenses;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// OpenCV, "Camera Calibration and 3D Reconstruction", detailed description, written down from there.
template <class T>
std::array<T, 2> opencv(const Camera& c, T x, T y) {
  const auto& k = c.distortion;  // k1 k2 p1 p2 k3 k4 k5 k6
  const T r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
  const T radial = (1.0 + k[0] * r2 + k[1] * r4 + k[4] * r6) / (1.0 + k[5] * r2 + k[6] * r4 + k[7] * r6);
  const T xd = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x);
  const T yd = y * radial + k[2] * (r2 + 2.0 * y * y) + 2 * k[3] * x * y;
  return {c.fx * xd + c.cx, c.fy * yd + c.cy};
}

TEST(Camera, ByHand) {
  const Camera c = make_camera(lens("c", 640, 480, 1000, 320, 240, 5, {0.1, 0, 0.01, -0.02, 0}));
  // x = 0.1, y = 0.2: r2 = 0.05, radial 1.005. x' = 0.1005 + 2*0.01*0.02 - 0.02*(0.05 + 0.02) = 0.0995,
  // y' = 0.201 + 0.01*(0.05 + 0.08) - 2*0.02*0.02 = 0.2015.
  const Vec2 pixel = project_camera(c, Vec3(0.2, 0.4, 2));
  EXPECT_NEAR(pixel.x(), 320 + 99.5, 1e-10);
  EXPECT_NEAR(pixel.y(), 240 + 201.5, 1e-10);
  const Camera pinhole = make_camera(lens("c", 640, 480, 500, 319.5, 239.5, 0, {}));
  EXPECT_EQ(project_camera(pinhole, Vec3(0, 0, 7)), Vec2(319.5, 239.5));
  EXPECT_EQ(project_camera(pinhole, Vec3(1, -2, 10)), Vec2(369.5, 139.5));  // x right, y down
  EXPECT_EQ(undistort(pinhole, Vec2(369.5, 139.5)), Vec2(0.1, -0.2));
}

TEST(Camera, DistortIsOpenCvsFormula) {
  Draw draw(1);
  for (const Camera& camera : real_lenses()) {
    const Camera c = make_camera(camera);
    for (int i = 0; i < 500; ++i) {
      const double x = draw.uniform(-0.4, 0.4), y = draw.uniform(-0.3, 0.3), h = 1e-30;
      using Complex = std::complex<double>;
      Eigen::Matrix2d J;
      const Vec2 pixel = distort(c, Vec2(x, y), &J);
      const auto value = opencv(c, x, y);
      const auto dx = opencv(c, Complex(x, h), Complex(y)), dy = opencv(c, Complex(x), Complex(y, h));
      for (int k = 0; k < 2; ++k) {
        EXPECT_NEAR(pixel(k), value[static_cast<std::size_t>(k)], 1e-11) << c.id;
        EXPECT_NEAR(J(k, 0), dx[static_cast<std::size_t>(k)].imag() / h, 1e-10) << c.id;
        EXPECT_NEAR(J(k, 1), dy[static_cast<std::size_t>(k)].imag() / h, 1e-10) << c.id;
      }
    }
  }
}

// REQ-RIG-007
TEST(Camera, RoundTripOverTheWholeImage) {
  for (const Camera& camera : real_lenses()) {
    const Camera c = make_camera(camera);
    double worst = 0;
    for (int v = 0; v < c.height; v += 7) {
      for (int u = 0; u < c.width; u += 7) {
        const Vec2 p = undistort(c, Vec2(u, v));
        ASSERT_TRUE(p.allFinite()) << c.id << " " << u << " " << v;
        worst = std::max(worst, (distort(c, p) - Vec2(u, v)).norm());
        const Vec3 x_in_room = c.centre_in_room() + 1800 * unproject(c, Vec2(u, v));
        worst = std::max(worst, (project(c, x_in_room) - Vec2(u, v)).norm());
      }
    }
    EXPECT_LT(worst, 1e-9) << c.id;
  }
}

// OpenCV's own way back: a fixed-point iteration.
TEST(Camera, UndistortAgreesWithFixedPointIteration) {
  const Camera c = make_camera(real_lenses()[1]);
  Draw draw(2);
  for (int i = 0; i < 200; ++i) {
    const Vec2 pixel(draw.uniform(0, 1279), draw.uniform(0, 1023));
    const Vec2 q((pixel.x() - c.cx) / c.fx, (pixel.y() - c.cy) / c.fy);
    Vec2 p = q;
    for (int k = 0; k < 200; ++k) {
      const auto image = opencv(c, p.x(), p.y());
      p -= Vec2((image[0] - pixel.x()) / c.fx, (image[1] - pixel.y()) / c.fy);
    }
    EXPECT_LT((undistort(c, pixel) - p).norm(), 1e-13);
  }
}

template <class F>
void expect_jacobian(const F& f, const Eigen::VectorXd& x, const Eigen::MatrixXd& J, double step, double tolerance) {
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(x.size());
    d(k) = step;
    const Eigen::VectorXd slope = (8 * (f(x + d) - f(x - d)) - (f(x + 2 * d) - f(x - 2 * d))) / (12 * step);
    EXPECT_LT((slope - J.col(k)).norm(), tolerance * (1 + J.norm()))
        << slope.transpose() << " against " << J.col(k).transpose();
  }
}

// REQ-RIG-008
TEST(Camera, Jacobians) {
  Draw draw(3);
  for (const Camera& camera : real_lenses()) {
    const Camera c = make_camera(camera);
    for (int i = 0; i < 50; ++i) {
      const Vec2 pixel(draw.uniform(20, c.width - 20), draw.uniform(20, c.height - 20));
      Eigen::Matrix2d U;
      undistort(c, pixel, &U);
      expect_jacobian([&](const Eigen::VectorXd& x) { return Eigen::VectorXd(undistort(c, x)); }, pixel, U, 0.01, 1e-9);
      Mat32 R;
      const Vec3 ray = unproject(c, pixel, &R);
      EXPECT_NEAR(ray.norm(), 1, 1e-15);
      expect_jacobian([&](const Eigen::VectorXd& x) { return Eigen::VectorXd(unproject(c, x)); }, pixel, R, 0.01, 1e-9);
      const Vec3 x_in_room = c.centre_in_room() + draw.uniform(500, 3000) * ray;
      Mat23 P, room;
      project_camera(c, c.camera_from_room * x_in_room, &P);
      expect_jacobian([&](const Eigen::VectorXd& x) { return Eigen::VectorXd(project_camera(c, Vec3(x))); },
                      c.camera_from_room * x_in_room, P, 0.01, 1e-9);
      project(c, x_in_room, &room);
      expect_jacobian([&](const Eigen::VectorXd& x) { return Eigen::VectorXd(project(c, Vec3(x))); }, x_in_room, room,
                      0.01, 1e-9);
      EXPECT_LT((room * ray).norm(), 1e-12);  // along the ray the pixel stays
    }
  }
}

// REQ-RIG-006
TEST(Camera, NoPixelIsNaN) {
  for (const Camera& camera : real_lenses()) {
    const Camera c = make_camera(camera);
    Mat23 J;
    for (const Vec3& x :
         {Vec3(0, 0, -1), Vec3(10, 20, 0), Vec3(0, 0, 0), Vec3(1, 2, -1000), Vec3(kNaN, 0, 1), Vec3(0, 0, kNaN)}) {
      EXPECT_TRUE(project_camera(c, x, &J).array().isNaN().all());
      EXPECT_TRUE(J.array().isNaN().all());
    }
    EXPECT_TRUE(project(c, c.camera_from_room.inverse() * Vec3(0, 0, -100), &J).array().isNaN().all());
    EXPECT_TRUE(J.array().isNaN().all());
    Mat32 K;
    Eigen::Matrix2d U;
    for (const Vec2& pixel : {Vec2(kNaN, 0), Vec2(0, kInf)}) {
      EXPECT_TRUE(unproject(c, pixel, &K).array().isNaN().all());
      EXPECT_TRUE(K.array().isNaN().all());
      EXPECT_TRUE(undistort(c, pixel, &U).array().isNaN().all());
      EXPECT_TRUE(U.array().isNaN().all());
    }
  }
}

// k1 alone: d(r + k1 r^3)/dr = 1 + 3 k1 r^2.
TEST(Camera, FoldOfABarrel) {
  const Camera c = make_camera(lens("c", 640, 480, 1000, 320, 240, 5, {-0.3, 0, 0, 0, 0}));
  EXPECT_NEAR(c.max_radius2, 1 / 0.9, 1e-10);
  const double fold = std::sqrt(c.max_radius2), height = fold * (1 - 0.3 * c.max_radius2);
  EXPECT_TRUE(project_camera(c, Vec3(0.999 * fold, 0, 1)).allFinite());
  EXPECT_TRUE(project_camera(c, Vec3(1.001 * fold, 0, 1)).hasNaN());
  EXPECT_TRUE(unproject(c, Vec2(320 + 999 * height, 240)).allFinite());
  EXPECT_TRUE(unproject(c, Vec2(320 + 1001 * height, 240)).hasNaN());  // no ray has this pixel
  EXPECT_TRUE(unproject(c, Vec2(1e6, -1e6)).hasNaN());
}

// (1 - 3h)(1 - h) = 0 with h = 2 |p| r.
TEST(Camera, FoldOfATangentialLens) {
  const Camera c = make_camera(lens("c", 640, 480, 1000, 320, 240, 5, {0, 0, 0.03, 0.04, 0}));
  EXPECT_NEAR(std::sqrt(c.max_radius2), 1 / (6 * 0.05), 1e-9);
}

TEST(Camera, PinholeNeverFolds) {
  EXPECT_EQ(make_camera(lens("c", 640, 480, 100, 320, 240, 0, {})).max_radius2, kInf);
  EXPECT_EQ(make_camera(lens("c", 640, 480, 100, 320, 240, 5, {})).max_radius2, kInf);
}

// Inside the radius found every Jacobian is positive, on it one is singular: by sampling, for lenses of every kind.
TEST(Camera, FoldBySampling) {
  Draw draw(4);
  int folding = 0;
  for (int i = 0; i < 150; ++i) {
    Camera c = lens("c", 64, 48, 1000, 32, 24, i % 2 ? 5 : 8, {});
    for (int k = 0; k < c.distortion_count; ++k)
      c.distortion[static_cast<std::size_t>(k)] = draw.uniform(-0.5, 0.5) * (k == 2 || k == 3 ? 0.1 : 1);
    c = make_camera(c);
    const auto least = [&](double r) {
      double worst = kInf;
      for (int a = 0; a < 360; ++a) {
        const double x = r * std::cos(a * 0.01745329252), y = r * std::sin(a * 0.01745329252), h = 1e-30;
        using Complex = std::complex<double>;
        const auto dx = opencv(c, Complex(x, h), Complex(y)), dy = opencv(c, Complex(x), Complex(y, h));
        worst = std::min(worst, (dx[0].imag() * dy[1].imag() - dx[1].imag() * dy[0].imag()) / (h * h) / (c.fx * c.fy));
      }
      return worst;
    };
    const double fold = std::sqrt(c.max_radius2);
    for (int s = 1; s < 50; ++s) EXPECT_GT(least(fold * s / 50), 0);
    if (fold > 50) continue;
    ++folding;
    const double u = c.max_radius2, pole = 1 + u * (c.distortion[5] + u * (c.distortion[6] + u * c.distortion[7]));
    if (std::abs(pole) > 1e-6) EXPECT_LT(least(fold * 1.0001), 1e-4 * std::abs(least(fold * 0.9)) + 1e-3);
  }
  EXPECT_GT(folding, 75);
}

// REQ-RIG-006
TEST(Camera, AFoldInsideTheImageIsRefused) {
  expect_error(Status::kFormat, "distortion: folds inside the image", [] {
    make_camera(lens("c", 1280, 1024, 600, 640, 512, 5, {-0.4, 0, 0, 0, 0}));
  });
  // OpenCV's sample stereo calibration (intrinsics.yml, M1 D1): two rays share each pixel of its corners.
  expect_error(Status::kFormat, "folds", [] {
    make_camera(lens("M1", 640, 480, 534.80326845051309, 335.68643204394891, 240.66183054066337, 5,
                     {0.29589439552724328, -1.0354662043042675, 0, 0, 0}));
  });
}

TEST(Camera, BadNumbers) {
  const Camera good = lens("c", 640, 480, 1000, 320, 240, 5, {-0.1, 0, 0, 0, 0});
  const auto refused = [&](const char* words, auto&& change, Status status = Status::kFormat) {
    Camera c = good;
    change(c);
    expect_error(status, words, [&] { make_camera(c); });
  };
  refused("image_size", [](Camera& c) { c.width = 0; });
  refused("image_size", [](Camera& c) { c.height = -3; });
  refused(
      "image_size", [](Camera& c) { c.height = 32769; }, Status::kLimit);
  for (double bad : {0.0, -5.0, 0.008, 1e8, kNaN, kInf}) refused("intrinsics", [&](Camera& c) { c.fy = bad; });
  for (double bad : {kNaN, -kInf}) refused("intrinsics", [&](Camera& c) { c.cx = bad; });
  for (double bad : {kNaN, -kInf}) refused("distortion[3]", [&](Camera& c) { c.distortion[3] = bad; });
  refused("distortion[6]", [](Camera& c) { c.distortion[6] = 0.1; });
  refused("distortion: expected 0, 5 or 8", [](Camera& c) { c.distortion_count = 4; });
  refused("camera_from_room: not a rigid motion", [](Camera& c) { c.camera_from_room.R *= 1.001; });
  refused("camera_from_room", [](Camera& c) { c.camera_from_room.t.x() = kNaN; });
}

TEST(Camera, AbsurdLensesEndInNaNOrAnError) {
  Draw draw(5);
  for (int i = 0; i < 2000; ++i) {
    Camera c = lens("c", 640, 480, std::pow(10, draw.uniform(-1, 8)), draw.uniform(-1e4, 1e4), 240, 8, {});
    for (double& k : c.distortion) k = std::pow(10, draw.uniform(-300, 300)) * (draw.bits() % 2 ? 1 : -1);
    try {
      c = make_camera(c);
    } catch (const Error& error) {
      EXPECT_EQ(static_cast<int>(error.status()), static_cast<int>(Status::kFormat));
      continue;
    }
    const Vec2 pixel(draw.uniform(0, 640), draw.uniform(0, 480));
    const Vec2 p = undistort(c, pixel);
    if (p.allFinite()) EXPECT_LT((distort(c, p) - pixel).norm(), 1e-6);
  }
}

TEST(Rig, NamesWhatIsThere) {
  Rig rig;
  rig.cameras = {lens("left", 64, 48, 100, 32, 24, 0, {}), lens("right", 64, 48, 100, 32, 24, 0, {})};
  rig.pairs = {{"pod1", 0, 1}};
  EXPECT_EQ(camera_index(rig, "right"), 1);
  EXPECT_EQ(&pair_of(rig, "pod1"), &rig.pairs[0]);
  expect_error(Status::kInvalidArgument, "camera 'middle' is not in the rig, which has 'left', 'right'",
               [&] { camera_index(rig, "middle"); });
  expect_error(Status::kInvalidArgument, "pair 'pod2' is not in the rig, which has 'pod1'",
               [&] { pair_of(rig, "pod2"); });
  expect_error(Status::kInvalidArgument, "which has none", [] { pair_of({}, "pod2"); });
}

}  // namespace
}  // namespace sgrt
