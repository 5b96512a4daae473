// Projection of one camera, see rig/rig.hpp; symbols and equations of docs/theory/rig.md. Brown's distortion is a
// gradient field: its Jacobian is symmetric. Where that is positive definite on a disc the map is one to one there, so
// the disc's radius bounds what can be inverted.
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "rig/rig.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Vec2 no_pixel() {
  return {kNaN, kNaN};
}

// The radial factor L(u) = (1 + k1 u + k2 u2 + k3 u3) / (1 + k4 u + k5 u2 + k6 u3), u = r^2, and its derivative.
struct Radial {
  double value, derivative, denominator;
};
Radial radial(const std::array<double, 8>& k, double u) {
  const double n = 1 + u * (k[0] + u * (k[1] + u * k[4])), dn = k[0] + u * (2 * k[1] + u * 3 * k[4]);
  const double d = 1 + u * (k[5] + u * (k[6] + u * k[7])), dd = k[5] + u * (2 * k[6] + u * 3 * k[7]);
  return {n / d, (dn - n / d * dd) / d, d};
}

// eq. 2 and 4: distorted normalised coordinates and their Jacobian.
Vec2 distorted(const Camera& camera, const Vec2& p, Eigen::Matrix2d* jacobian) {
  const double x = p.x(), y = p.y(), p1 = camera.distortion[2], p2 = camera.distortion[3];
  const double u = p.squaredNorm();
  const Radial L = radial(camera.distortion, u);
  if (jacobian) {
    const double xy = 2 * L.derivative * x * y + 2 * (p1 * x + p2 * y);
    *jacobian << L.value + 2 * L.derivative * x * x + 2 * p1 * y + 6 * p2 * x, xy,  //
        xy, L.value + 2 * L.derivative * y * y + 6 * p1 * y + 2 * p2 * x;
  }
  return {x * L.value + 2 * p1 * x * y + p2 * (u + 2 * x * x), y * L.value + p1 * (u + 2 * y * y) + 2 * p2 * x * y};
}

// eq. 5: the smallest determinant of the Jacobian on the circle r^2 = u, or -1 where the radial factor has passed a
// pole.
double smallest_determinant(const Camera& camera, double u) {
  const Radial L = radial(camera.distortion, u);
  if (!(L.denominator > 0)) return -1;
  const double a = L.value + 2 * u * L.derivative, b = L.value;
  const double h = 2 * std::hypot(camera.distortion[2], camera.distortion[3]) * std::sqrt(u);
  // det(c) = ab - h^2 + h (a + 3b) c + 4 h^2 c^2, c the cosine between the point and (p2, p1).
  const double slope = a + 3 * b;
  if (std::abs(slope) < 8 * h) return a * b - h * h - slope * slope / 16;
  return slope > 0 ? (a - 3 * h) * (b - h) : (a + 3 * h) * (b + h);
}

// The first u at which the distortion folds, up to kLargest: 89.4 degrees off the axis.
double find_max_radius2(const Camera& camera) {
  constexpr double kSmallest = 1e-8, kLargest = 1e4, kStep = 1.005;
  bool any = false;
  for (double k : camera.distortion) any = any || k != 0;
  if (!any) return std::numeric_limits<double>::infinity();
  double good = 0;
  for (double u = kSmallest; u <= kLargest; u *= kStep) {
    if (smallest_determinant(camera, u) > 0) {
      good = u;
      continue;
    }
    double bad = u;
    for (int i = 0; i < 60; ++i) {
      const double middle = (good + bad) / 2;
      (smallest_determinant(camera, middle) > 0 ? good : bad) = middle;
    }
    break;
  }
  return good;
}

// Newton's iteration for distorted(p) = q inside the disc where the map is one to one; a step that leaves the disc or
// does not lessen the residual is halved.
bool solve(const Camera& camera, const Vec2& q, Vec2& p, Eigen::Matrix2d& jacobian) {
  constexpr int kIterations = 50, kHalvings = 30;
  const double tolerance = 1e-14 * (1 + q.norm());
  const double limit = camera.max_radius2;
  p = q;
  if (p.squaredNorm() > 0.25 * limit) p *= 0.5 * std::sqrt(limit) / p.norm();
  Vec2 residual = distorted(camera, p, &jacobian) - q;
  for (int i = 0; i < kIterations && residual.norm() > tolerance; ++i) {
    const Vec2 step = jacobian.inverse() * residual;
    Vec2 next;
    Eigen::Matrix2d next_jacobian;
    Vec2 next_residual;
    double scale = 1;
    int halving = 0;
    for (; halving < kHalvings; ++halving, scale /= 2) {
      next = p - scale * step;
      if (!(next.squaredNorm() <= limit)) continue;
      next_residual = distorted(camera, next, &next_jacobian) - q;
      if (next_residual.norm() < residual.norm()) break;
    }
    if (halving == kHalvings) break;
    p = next;
    residual = next_residual;
    jacobian = next_jacobian;
  }
  return residual.norm() <= 10 * tolerance;
}

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kFormat, message);
}

void check_numbers(const Camera& c) {
  constexpr int kLargestSide = 32768;
  for (int side : {c.width, c.height}) {
    if (side < 1) refuse("image_size: expected 2 positive integers, got " + std::to_string(side));
    if (side > kLargestSide) fail(Status::kLimit, "image_size: expected at most 32768, got " + std::to_string(side));
  }
  for (double v : {c.fx, c.fy}) {
    if (!(v >= 1 && v <= 1e7)) refuse("intrinsics: expected fx and fy from 1 to 1e7 px, got " + text_of(v));
  }
  for (double v : {c.cx, c.cy}) {
    if (!(std::abs(v) <= 1e7)) refuse("intrinsics: expected |cx| and |cy| up to 1e7 px, got " + text_of(v));
  }
  if (c.distortion_count != 0 && c.distortion_count != 5 && c.distortion_count != 8) {
    refuse("distortion: expected 0, 5 or 8 numbers, got " + std::to_string(c.distortion_count));
  }
  for (std::size_t i = 0; i < c.distortion.size(); ++i) {
    const bool used = static_cast<int>(i) < c.distortion_count;
    if (used ? std::isfinite(c.distortion[i]) : c.distortion[i] == 0) continue;
    refuse("distortion[" + std::to_string(i) + "]: expected " +
           (used ? "a finite number" : "0, beyond distortion_count") + ", got " + text_of(c.distortion[i]));
  }
}

// The whole image can be undistorted if its border can: the image of the disc has no hole.
void check_fold(const Camera& camera) {
  if (std::isinf(camera.max_radius2)) return;
  constexpr int kSteps = 64;
  const double w = camera.width - 1, h = camera.height - 1;
  for (int i = 0; i <= kSteps; ++i) {
    const double s = static_cast<double>(i) / kSteps;
    for (const Vec2& pixel : {Vec2(s * w, 0), Vec2(s * w, h), Vec2(0, s * h), Vec2(w, s * h)}) {
      if (undistort(camera, pixel).allFinite()) continue;
      refuse("distortion: folds inside the image, pixel " + text_of(pixel.x()) + " " + text_of(pixel.y()) +
             " has no ray; it is invertible up to r = " + text_of(std::sqrt(camera.max_radius2)) +
             " of the normalised image");
    }
  }
}

}  // namespace

Camera make_camera(Camera camera) {
  check_numbers(camera);
  double rows[16];
  pose_to_rows(camera.camera_from_room, rows);
  try {
    camera.camera_from_room = pose_from_rows(rows, "camera_from_room");
  } catch (const Error& error) {
    refuse(error.what());
  }
  camera.max_radius2 = find_max_radius2(camera);
  check_fold(camera);
  return camera;
}

Vec2 distort(const Camera& camera, const Vec2& normalised, Eigen::Matrix2d* jacobian) {
  const Vec2 focal(camera.fx, camera.fy);
  if (!(normalised.squaredNorm() <= camera.max_radius2)) {
    if (jacobian) jacobian->setConstant(kNaN);
    return no_pixel();
  }
  const Vec2 q = distorted(camera, normalised, jacobian);
  if (jacobian) *jacobian = focal.asDiagonal() * *jacobian;
  return focal.cwiseProduct(q) + Vec2(camera.cx, camera.cy);
}

Vec2 undistort(const Camera& camera, const Vec2& pixel, Eigen::Matrix2d* jacobian) {
  const Vec2 q((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  Vec2 p = q;
  Eigen::Matrix2d J = Eigen::Matrix2d::Identity();
  const bool pinhole = std::isinf(camera.max_radius2);
  if (!q.allFinite() || (!pinhole && !solve(camera, q, p, J))) {
    if (jacobian) jacobian->setConstant(kNaN);
    return no_pixel();
  }
  if (jacobian) *jacobian = J.inverse() * Vec2(1 / camera.fx, 1 / camera.fy).asDiagonal();
  return p;
}

Vec2 project_camera(const Camera& camera, const Vec3& x, Mat23* jacobian) {
  Eigen::Matrix2d J;
  const Vec2 normalised = x.head<2>() / x.z();
  const Vec2 pixel = x.z() > 0 ? distort(camera, normalised, jacobian ? &J : nullptr) : no_pixel();
  if (!pixel.allFinite()) {
    if (jacobian) jacobian->setConstant(kNaN);
    return no_pixel();
  }
  if (jacobian) {
    Mat23 N;
    N << 1, 0, -normalised.x(), 0, 1, -normalised.y();
    *jacobian = J * N / x.z();
  }
  return pixel;
}

Vec2 project(const Camera& camera, const Vec3& x_in_room, Mat23* jacobian) {
  const Vec2 pixel = project_camera(camera, camera.camera_from_room * x_in_room, jacobian);
  if (jacobian) *jacobian = (*jacobian * camera.camera_from_room.R).eval();
  return pixel;
}

Vec3 unproject(const Camera& camera, const Vec2& pixel, Mat32* jacobian) {
  Eigen::Matrix2d J;
  const Vec2 p = undistort(camera, pixel, jacobian ? &J : nullptr);
  const double length = std::sqrt(p.squaredNorm() + 1);
  const Vec3 ray = Vec3(p.x(), p.y(), 1) / length;
  const Mat3 room_from_camera = camera.camera_from_room.R.transpose();
  if (jacobian) {
    const Mat3 along = (Mat3::Identity() - ray * ray.transpose()) / length;
    *jacobian = room_from_camera * along.leftCols<2>() * J;
  }
  return room_from_camera * ray;
}

namespace {

template <class Unit>
int index_of(const std::vector<Unit>& units, const char* kind, const std::string& id) {
  std::string known;
  for (std::size_t i = 0; i < units.size(); ++i) {
    if (units[i].id == id) return static_cast<int>(i);
    known += (i ? ", " : "") + in_quotes(units[i].id);
  }
  fail(Status::kInvalidArgument,
       kind + (" " + in_quotes(id)) + " is not in the rig, which has " + (known.empty() ? "none" : known));
}

}  // namespace

int camera_index(const Rig& rig, const std::string& id) {
  return index_of(rig.cameras, "camera", id);
}

const StereoPair& pair_of(const Rig& rig, const std::string& id) {
  return rig.pairs[static_cast<std::size_t>(index_of(rig.pairs, "pair", id))];
}

int tof_index(const Rig& rig, const std::string& id) {
  return index_of(rig.tofs, "tof", id);
}

}  // namespace sgrt
