// A scene whose every image value is known in closed form: a textured sphere or plane seen by two verged, distorted
// cameras.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/image.hpp"
#include "rig/rig.hpp"

namespace sgrt::testing {

// A smooth random texture in space: a sum of plane waves, so that it has no grid of its own. Values in about 0.1 ..
// 0.9.
struct Texture {
  std::vector<Vec3> k;
  std::vector<double> phase;

  explicit Texture(double wavelength_mm, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> spread(0.7, 1.6);
    for (int i = 0; i < 40; ++i) {
      const Vec3 direction = Vec3(normal(random), normal(random), normal(random)).normalized();
      k.push_back(direction * (2 * M_PI / (wavelength_mm * spread(random))));
      phase.push_back(2 * M_PI * std::generate_canonical<double, 53>(random));
    }
  }
  double operator()(const Vec3& x) const {
    double sum = 0;
    for (std::size_t i = 0; i < k.size(); ++i) sum += std::cos(k[i].dot(x) + phase[i]);
    return 0.5 + 0.05 * sum;
  }
};

// radius 0: the plane z = 0 tilted by `tilt` rad about y.
struct Scene {
  double radius = 0, tilt = 0;
  Vec3 normal_at(const Vec3& x) const {
    return radius > 0 ? Vec3((x - Vec3(0, 0, -radius)).normalized()) : Vec3(std::sin(tilt), 0, std::cos(tilt));
  }
  // Signed distance, positive outside.
  double distance(const Vec3& x) const {
    return radius > 0 ? (x - Vec3(0, 0, -radius)).norm() - radius : x.dot(normal_at(x));
  }
  // Where the ray from c along r meets it; NaN when it does not.
  Vec3 hit(const Vec3& c, const Vec3& r) const {
    const Vec3 nowhere = Vec3::Constant(std::nan(""));
    if (radius == 0) {
      const Vec3 n = normal_at(c);
      return n.dot(r) < 0 ? Vec3(c - r * (n.dot(c) / n.dot(r))) : nowhere;
    }
    const Vec3 m = c - Vec3(0, 0, -radius);
    const double b = m.dot(r), disc = b * b - m.squaredNorm() + radius * radius;
    return disc > 0 ? Vec3(c + r * (-b - std::sqrt(disc))) : nowhere;
  }
};

inline Camera camera_at(const std::string& id, const Vec3& centre, int width, int height, double f, double k1) {
  Camera c;
  c.id = id;
  c.width = width, c.height = height;
  c.fx = f * 1.002, c.fy = f * 0.999, c.cx = width * 0.49, c.cy = height * 0.52;
  c.distortion_count = 5;
  c.distortion = {k1, 0.02, 1e-4, -2e-4, 0, 0, 0, 0};
  const Vec3 z = -centre.normalized(), x = Vec3::UnitY().cross(z).normalized() * -1;
  c.camera_from_room.R.row(0) = x, c.camera_from_room.R.row(1) = z.cross(x), c.camera_from_room.R.row(2) = z;
  c.camera_from_room.t = -(c.camera_from_room.R * centre);
  return make_camera(c);
}

// Two cameras 600 mm above the origin, 80 mm apart, verged on it: f 700 px, a pixel is 0.86 mm.
inline Rig small_rig() {
  Rig rig;
  rig.id = "test", rig.room = "IEC 61217 fixed, mm";
  rig.cameras = {camera_at("l", Vec3(-40, 10, 600), 320, 240, 700, -0.12),
                 camera_at("r", Vec3(40, -5, 605), 320, 240, 700, -0.1)};
  rig.pairs = {{"pod", 0, 1}};
  return rig;
}

// Grey values gain * texture + offset with Gaussian noise, not rounded; `background` where nothing is hit.
inline std::vector<float> render(const Camera& camera, const Scene& scene, const Texture& texture, double gain,
                                 double offset, double noise, unsigned seed, double background = 5) {
  std::vector<float> pixels(static_cast<std::size_t>(camera.width) * camera.height);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
  const Vec3 c = camera.centre_in_room();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 p = scene.hit(c, unproject(camera, Vec2(x, y)));
      double g = p.x() == p.x() ? gain * texture(p) + offset : background;
      if (noise > 0) g += normal(random);
      pixels[static_cast<std::size_t>(y) * camera.width + x] = static_cast<float>(g);
    }
  return pixels;
}

inline ImageView view_of(const std::vector<float>& pixels, const Camera& camera) {
  ImageView v;
  v.data = pixels.data(), v.type = ImageView::Type::kF32;
  v.height = camera.height, v.width = camera.width;
  v.column_stride = sizeof(float), v.row_stride = static_cast<std::int64_t>(sizeof(float)) * camera.width;
  return v;
}

}  // namespace sgrt::testing
