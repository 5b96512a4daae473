// Bodies in closed form for the fit: a head and a torso as r(direction), sampled with noise, outliers and holes.
#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "core/surface.hpp"

namespace sgrt::test {

// The skin is where field(x) = 0; positive outside.
struct Body {
  std::function<double(const Vec3&)> field;

  Vec3 gradient(const Vec3& x) const {
    Vec3 g;
    for (int k = 0; k < 3; ++k) {
      Vec3 a = x, b = x;
      a(k) += 1e-4, b(k) -= 1e-4;
      g(k) = (field(a) - field(b)) / 2e-4;
    }
    return g;
  }
  Vec3 normal(const Vec3& x) const { return gradient(x).normalized(); }
  // Signed distance of a point near the skin, to second order.
  double distance(const Vec3& x) const {
    const Vec3 g = gradient(x);
    const Vec3 foot = x - g * (field(x) / g.squaredNorm());
    return (x - foot).dot(normal(foot)) + field(foot) / g.norm();
  }
  Vec3 on_ray(const Vec3& origin, const Vec3& direction) const {
    double low = 10, high = 400;
    for (int i = 0; i < 60; ++i) (field(origin + 0.5 * (low + high) * direction) < 0 ? low : high) = 0.5 * (low + high);
    return origin + low * direction;
  }
};

inline double bump(const Vec3& x, const Vec3& at, double width) {
  return std::exp(-(x - at).squaredNorm() / (2 * width * width));
}

// A face that looks to +z: a nose whose tip has a radius of about 8 mm, sockets, a chin, cheeks.
inline Body head() {
  return {[](const Vec3& x) {
    const double body = (std::sqrt(x.cwiseQuotient(Vec3(76, 105, 95)).squaredNorm()) - 1) * 90;
    return body - 16 * bump(x, Vec3(0, -8, 104), 11) - 8 * bump(x, Vec3(0, 10, 98), 9) +
           6 * bump(x, Vec3(26, 22, 88), 11) + 6 * bump(x, Vec3(-26, 22, 88), 11) - 7 * bump(x, Vec3(0, -62, 78), 13) -
           3 * bump(x, Vec3(34, -20, 80), 18) - 3 * bump(x, Vec3(-34, -20, 80), 18) -
           2.5 * bump(x, Vec3(0, -38, 92), 7);
  }};
}

// A trunk along y, front to +z, 320 x 220 mm across, with breasts, a navel and a waist.
inline Body torso() {
  return {[](const Vec3& x) {
    const double waist = 1 - 0.08 * std::exp(-std::pow((x.y() + 60) / 90, 2));
    const double body = (std::hypot(x.x() / 160, x.z() / 110) - waist) * 130;
    return body - 20 * bump(x, Vec3(75, 90, 95), 42) - 18 * bump(x, Vec3(-75, 90, 95), 42) -
           3 * bump(x, Vec3(78, 88, 118), 9) + 7 * bump(x, Vec3(0, -70, 102), 10);
  }};
}

struct Scan {
  Surface surface;
  std::vector<char> outlier;
};

// noise: mm, isotropic; outliers: share, 5 to 50 mm along the normal, either way; holes: round, until this share is
// gone.
inline Scan scan(const Body& body, const std::vector<Vec3>& skin, double noise, double outliers, double holes,
                 double hole_radius, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform;
  std::vector<char> gone(skin.size(), 0);
  std::size_t lost = 0;
  while (static_cast<double>(lost) < holes * static_cast<double>(skin.size())) {
    const Vec3 centre = skin[engine() % skin.size()];
    for (std::size_t i = 0; i < skin.size(); ++i)
      if (!gone[i] && (skin[i] - centre).norm() < hole_radius) gone[i] = 1, ++lost;
  }
  Scan s;
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < skin.size(); ++i) {
    if (gone[i]) continue;
    Vec3 x = skin[i] + noise * Vec3(gauss(engine), gauss(engine), gauss(engine));
    const bool bad = uniform(engine) < outliers;
    if (bad) x += (uniform(engine) < 0.5 ? -1 : 1) * (5 + 45 * uniform(engine)) * body.normal(skin[i]);
    points.push_back(x);
    s.outlier.push_back(bad);
  }
  s.surface.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) s.surface.points.row(static_cast<Eigen::Index>(i)) = points[i];
  return s;
}

// The head's skin within `angle` of +z, about one point a pitch^2, on a spiral.
inline std::vector<Vec3> head_skin(const Body& body, double pitch, double angle, double phase) {
  const double top = std::cos(angle), r = 92;
  const auto count = static_cast<int>(2 * M_PI * r * r * (1 - top) / (pitch * pitch));
  std::vector<Vec3> skin;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (i + 0.5) / count * (1 - top), a = phase + i * M_PI * (3 - std::sqrt(5.0));
    const double s = std::sqrt(1 - z * z);
    skin.push_back(body.on_ray(Vec3::Zero(), Vec3(s * std::cos(a), s * std::sin(a), z)));
  }
  return skin;
}

// The torso's skin within `angle` of the front, |y| < 200.
inline std::vector<Vec3> torso_skin(const Body& body, double pitch, double angle, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::vector<Vec3> skin;
  const double step = pitch / 135;
  for (double y = -200; y < 200; y += pitch)
    for (double a = -angle; a < angle; a += step) {
      const double b = a + step * uniform(engine);
      skin.push_back(body.on_ray(Vec3(0, y + pitch * uniform(engine), 0), Vec3(std::sin(b), 0, std::cos(b))));
    }
  return skin;
}

}  // namespace sgrt::test
