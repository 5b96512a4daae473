// The mirror's light plane, its derivatives, the laser of rig.json, the pose track, and covariance against noise.
#include "laser/sweep.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "expect.hpp"

namespace sgrt {
namespace {

using test::expect_error;

const char* const kRig = R"({"schema": "sgrt-rig/1", "id": "r", "room": "IEC 61217 fixed, mm", "cameras": [
  {"id": "cam", "image_size": [200, 60], "model": "brown5", "intrinsics": [1200, 1200, 99.5, 29.5],
   "distortion": [-0.1, 0.02, 0.0005, -0.0003, 0],
   "camera_from_room": [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1500], [0, 0, 0, 1]]}],
  "lasers": [{"id": "s", "camera": "cam", "note": "kept", "fan": {"point": [500, 1, 1501], "normal": [0.01, 0.02, 0.99975]},
   "mirror": {"axis_point": [500, 0, 1500], "axis_direction": [0, 1, 0], "normal_at_zero": [0.58, 0.02, -0.8143685],
              "offset_mm": 1.5, "angle_scale": 1.01, "angle_zero_rad": 0.003}}],
  "uncertainty": {"parameters": ["s.offset_mm", "cam.cx"], "modes": [[0.02, 0], [0, 0.05]]}})";

Rig rig() {
  return rig_from_json(kRig, std::string(kRig).size());
}

// docs/formats.md word by word: a point of the fan and its mirror image.
TEST(LaserUnit, PlaneIsTheReflectedFan) {
  const LaserUnit u = laser_of(rig(), "s");
  for (const double reading : {-0.1, 0.0, 0.2}) {
    const double a = u.angle_scale * (reading - u.angle_zero);
    const Vec3 n = Eigen::AngleAxisd(a, u.axis_direction) * u.normal_at_zero;
    const LightPlane plane = light_plane(u, reading);
    test::Draw draw(3);
    for (int i = 0; i < 5; ++i) {
      Vec3 p = u.fan_point + draw.vec3(300);
      p -= u.fan_normal.dot(p - u.fan_point) * u.fan_normal;
      const Vec3 image = p - 2 * (n.dot(p - u.axis_point) - u.offset) * n;
      EXPECT_NEAR(plane.n.dot(image), plane.d, 1e-9);
    }
    EXPECT_NEAR(plane.n.norm(), 1, 1e-12);
  }
}

TEST(LaserUnit, SlopeIsTheDifference) {
  const LaserUnit u = laser_of(rig(), "s");
  const LightPlane a = light_plane(u, 0.1 - 1e-6), b = light_plane(u, 0.1 + 1e-6), s = light_plane_slope(u, 0.1);
  EXPECT_LT(((b.n - a.n) / 2e-6 - s.n).norm(), 1e-8);
  EXPECT_NEAR((b.d - a.d) / 2e-6, s.d, 1e-4);
}

TEST(LaserUnit, NormalisedIsTheSameLight) {
  LaserUnit u = laser_of(rig(), "s");
  u.axis_point += 77 * u.axis_direction;
  const Vec3 camera(0, 0, 1500);
  const LaserUnit v = normalised(u, camera);
  EXPECT_EQ(v.angle_zero, 0);
  EXPECT_NEAR((v.axis_point - camera).dot(v.axis_direction), 0, 1e-9);
  for (const double reading : {-0.1, 0.2}) {
    const LightPlane a = light_plane(u, reading), b = light_plane(v, reading);
    EXPECT_LT((a.n - b.n).norm(), 1e-12);
    EXPECT_NEAR(a.d, b.d, 1e-9);
  }
  const Pose pose = se3_exp((Vec6() << 0.1, -0.2, 0.3, 10, 20, -30).finished());
  const LightPlane a = light_plane(u, 0.1), b = light_plane(moved(u, pose), 0.1);
  EXPECT_LT((pose.R * a.n - b.n).norm(), 1e-12);
  EXPECT_NEAR(a.d + b.n.dot(pose.t), b.d, 1e-9);
}

TEST(LaserJson, WritesBackAndKeepsOtherKeys) {
  const Rig r = rig();
  LaserUnit u = laser_of(r, "s");
  u.offset = 2.25;
  const std::string text = rig_with_laser(r, u, r.uncertainty);
  EXPECT_NE(text.find("\"note\""), std::string::npos);
  const Rig again = rig_from_json(text.data(), text.size());
  EXPECT_EQ(laser_of(again, "s").offset, 2.25);
  EXPECT_EQ(laser_of(again, "s").fan_normal, u.fan_normal);
  u.id = "new";
  const std::string two = rig_with_laser(again, u, r.uncertainty);
  EXPECT_EQ(laser_ids(rig_from_json(two.data(), two.size())), (std::vector<std::string>{"s", "new"}));
  expect_error(Status::kInvalidArgument, "'s'", [&] { laser_of(r, "t"); });
}

// REQ-LASER-005
TEST(LaserJson, NamesWhatIsWrong) {
  const auto broken = [](const std::string& from, const std::string& to) {
    std::string text = kRig;
    text.replace(text.find(from), from.size(), to);
    return rig_from_json(text.data(), text.size());
  };
  expect_error(Status::kFormat, "lasers[0].mirror.axis_direction",
               [&] { laser_of(broken("[0, 1, 0]", "[0, 2, 0]"), "s"); });
  expect_error(Status::kFormat, "lasers[0].camera",
               [&] { laser_of(broken("\"camera\": \"cam\"", "\"camera\": \"x\""), "s"); });
  expect_error(Status::kFormat, "lasers[0].fan.point", [&] { laser_of(broken("[500, 1, 1501]", "[500, 1]"), "s"); });
  expect_error(Status::kFormat, "angle_scale", [&] { laser_of(broken("1.01", "0"), "s"); });
  expect_error(Status::kFormat, "lasers[0].fan: missing", [&] { laser_of(broken("\"fan\"", "\"fans\""), "s"); });
  expect_error(Status::kFormat, "lasers[0].id: expected a text",
               [&] { laser_of(broken("\"id\": \"s\"", "\"id\": 3"), "s"); });
  expect_error(Status::kFormat, "lasers: expected an array",
               [&] { laser_of(broken("\"lasers\": [", "\"lasers\": 1, \"x\": ["), "s"); });
}

// An image of the stripe on the plane z = 0, f32, with noise.
std::vector<float> image_of_stripe(const Camera& camera, const LightPlane& plane, unsigned seed, double noise) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0, static_cast<float>(noise));
  std::vector<float> image(static_cast<std::size_t>(camera.width) * camera.height);
  for (int y = 0; y < camera.height; ++y) {
    double low = 0, high = camera.width - 1;
    const auto error = [&](double x) {
      const Vec3 ray = unproject(camera, Vec2(x, y)), from = camera.centre_in_room();
      return plane.n.dot(from - from.z() / ray.z() * ray) - plane.d;
    };
    const double sign = error(high) > 0 ? 1 : -1;
    for (int i = 0; i < 50; ++i) (sign * error((low + high) / 2) > 0 ? high : low) = (low + high) / 2;
    for (int x = 0; x < camera.width; ++x)
      image[static_cast<std::size_t>(y) * camera.width + x] =
          static_cast<float>(100 * std::exp(-std::pow((x - low) / 1.5, 2) / 2)) + (noise > 0 ? normal(random) : 0);
  }
  return image;
}

// The covariance of a point against the scatter of noisy images and readings; its modes against moved parameters.
// REQ-LASER-003
TEST(Column, CovarianceAndModesAreWhatNoiseDoes) {
  const Rig r = rig();
  const LaserUnit u = laser_of(r, "s");
  const Camera& camera = r.cameras[0];
  LaserOptions o;
  o.angle_sigma = 2e-5;
  o.stripe.method = StripeMethod::kGaussian;
  const double reading = 0.012;
  const LightPlane plane = light_plane(u, reading);
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0, 1);
  double chi2 = 0;
  int count = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const std::vector<float> image = image_of_stripe(camera, plane, 100 + trial, 3);
    const ImageView view{image.data(),
                         ImageView::Type::kF32,
                         camera.height,
                         camera.width,
                         static_cast<std::int64_t>(camera.width * sizeof(float)),
                         sizeof(float)};
    const Column c = make_column({}, camera, u, o, false, view, nullptr, reading + o.angle_sigma * normal(random), 0);
    for (Eigen::Index i = 0; i < c.points.rows(); ++i) {
      if (c.reason[static_cast<std::size_t>(i)] != 0) continue;
      chi2 += std::pow(c.points(i, 2), 2) / c.covariance(i, 5);
      ++count;
    }
  }
  EXPECT_GT(count, 600);
  EXPECT_NEAR(chi2 / count, 1, 0.25);

  const Vec3 x = unproject(camera, Vec2(100, 30)) * ((plane.d - plane.n.dot(camera.centre_in_room())) /
                                                     plane.n.dot(unproject(camera, Vec2(100, 30)))) +
                 camera.centre_in_room();
  const LaserModes modes = laser_modes(r, u);
  ASSERT_EQ(modes.count(), 2);
  const Mat3X m = point_modes(camera, modes, plane, light_plane_jacobian(u, reading), x);
  const auto cut = [&](const Camera& c, const LightPlane& p) {
    const Vec3 ray = unproject(c, Vec2(100, 30)), from = c.centre_in_room();
    return Vec3(from + (p.d - p.n.dot(from)) / p.n.dot(ray) * ray);
  };
  LaserUnit off = u;
  off.offset += 0.02;
  EXPECT_LT((cut(camera, light_plane(off, reading)) - x - m.col(0)).norm(), 1e-4 * m.col(0).norm());
  Camera shifted = camera;
  shifted.cx += 0.05;
  EXPECT_LT((cut(shifted, plane) - x - m.col(1)).norm(), 1e-3 * m.col(1).norm());
}

// What the calibration leaves uncertain reaches the surface as modes: the covariance that they add at a point is that
// of the point's own two parameters. REQ-LASER-003
TEST(Sweep, TheCalibrationsModesReachTheSurface) {
  const Rig r = rig();
  const LaserUnit u = laser_of(r, "s");
  Sweep sweep(r, u, {});
  const double readings[] = {0.008, 0.012, 0.016};
  for (int i = 0; i < 3; ++i) {
    const std::vector<float> image = image_of_stripe(r.cameras[0], light_plane(u, readings[i]), 7 + i, 2);
    const ImageView view{image.data(), ImageView::Type::kF32, 60, 200, 200 * sizeof(float), sizeof(float)};
    sweep.push({}, view, nullptr, readings[i], i);
  }
  const LaserResult result = sweep.finish({}, nullptr, std::nan(""));
  ASSERT_EQ(result.status, Status::kOk) << result.message;
  ASSERT_EQ(result.surface->modes.size(), 2U);
  const LaserModes modes = laser_modes(r, u);
  int seen = 0;
  for (int i = 0; i < result.height; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Eigen::Index k = i * result.width + j;
      const Vec3 x = result.surface->points.row(k);
      if (!x.allFinite()) continue;
      const Mat3X own =
          point_modes(r.cameras[0], modes, light_plane(u, readings[j]), light_plane_jacobian(u, readings[j]), x);
      Mat3 added = Mat3::Zero();
      for (const Points& mode : result.surface->modes) added += mode.row(k).transpose() * mode.row(k);
      EXPECT_LT((added - own * own.transpose()).norm(), 1e-6 * added.norm());
      ++seen;
    }
  }
  EXPECT_GT(seen, 100);
}

}  // namespace
}  // namespace sgrt
