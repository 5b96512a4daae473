// Made rigs and what they see of a board, for the tests of calibration: truth that no calibration has touched.
#pragma once

#include "calibration/calibrate.hpp"
#include "core/error.hpp"
#include "expect.hpp"

namespace sgrt::test {

inline Points board_points(int columns, int rows, double square) {
  Points points(columns * rows, 3);
  for (int i = 0; i < columns * rows; ++i) points.row(i) << i % columns * square, i / columns * square, 0;
  return points;
}

inline Camera pod_camera(const std::string& id, const Vec3& centre, const Vec3& towards, double f = 2400) {
  Camera c;
  c.id = id;
  c.width = 1280;
  c.height = 1024;
  c.fx = f;
  c.fy = f * 1.002;
  c.cx = 645.3;
  c.cy = 504.8;
  c.distortion_count = 5;
  c.distortion = {-0.11, 0.13, 4e-4, -3e-4, -0.05};
  const Vec3 z = (towards - centre).normalized(), x = z.cross(Vec3::UnitZ()).normalized();
  Mat3 R;
  R << x.transpose(), z.cross(x).transpose(), z.transpose();
  c.camera_from_room = {R, -R * centre};
  return make_camera(c);
}

// Two pods above the couch, 2 m from the isocentre, base 250 mm.
inline std::vector<Camera> two_pods() {
  const Vec3 at = Vec3::Zero();
  return {pod_camera("pod1-left", {-1100, -125, 1650}, at), pod_camera("pod1-right", {-1100, 125, 1650}, at),
          pod_camera("pod2-left", {1100, 125, 1650}, at), pod_camera("pod2-right", {1100, -125, 1650}, at)};
}

struct Seen {
  CalibrationData data;
  std::vector<Camera> truth;
  std::vector<Pose> room_from_board;
};

struct SeenOptions {
  int columns = 11, rows = 8, boards = 40;
  double square = 30, noise = 0.05, spread = 200, tilt_deg = 40, turn_deg = 40;
  Vec3 warp = Vec3::Zero();
  double reach = 1;  // only pixels within this share of the half image from its middle
};

inline double normal_of(Draw& draw) {
  return std::sqrt(-2 * std::log(draw.uniform(1e-300, 1))) * std::cos(6.283185307179586 * draw.uniform(0, 1));
}

// Boards held face up about the isocentre, tilted about both axes; each camera sees those that lie wholly in its image.
inline Seen see(const std::vector<Camera>& cameras, const SeenOptions& o, unsigned seed) {
  Seen seen;
  seen.truth = cameras;
  seen.data.points = board_points(o.columns, o.rows, o.square);
  for (const Camera& c : cameras) seen.data.cameras.push_back({c.id, c.width, c.height});
  const Target target = make_target(seen.data.points);
  Draw draw(seed);
  const double degree = 3.14159265358979323846 / 180;
  for (int b = 0; b < o.boards; ++b) {
    char name[16];
    std::snprintf(name, sizeof name, "%03d.png", b);
    seen.data.placements.emplace_back(name);
    const Vec3 w(draw.uniform() * o.tilt_deg * degree, draw.uniform() * o.tilt_deg * degree,
                 draw.uniform() * o.turn_deg * degree);
    Pose pose{so3_exp(w) * Vec3(1, -1, -1).asDiagonal(), draw.vec3(o.spread)};  // z down: away from the cameras
    pose.t -= pose.R * Vec3(target.centre.x(), target.centre.y(), 0);
    seen.room_from_board.push_back(pose);
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      std::vector<Sight> view;
      bool inside = true;
      for (int i = 0; i < static_cast<int>(seen.data.points.rows()); ++i) {
        Vec2 pixel = project(cameras[c], pose * warped(target, o.warp, i));
        for (int k = 0; k < 2; ++k) pixel(k) += o.noise * normal_of(draw);
        const Vec2 middle((cameras[c].width - 1) / 2.0, (cameras[c].height - 1) / 2.0);
        const Vec2 off = (pixel - middle).cwiseQuotient(middle).cwiseAbs();
        inside = inside && off.maxCoeff() < o.reach;
        view.push_back({static_cast<int>(c), b, i, pixel, 1});
      }
      if (inside) seen.data.sights.insert(seen.data.sights.end(), view.begin(), view.end());
    }
  }
  return seen;
}

// The truth as the calibration's gauge has it: the room is the first camera.
inline Camera relative_to_first(const std::vector<Camera>& cameras, std::size_t c) {
  Camera out = cameras[c];
  out.camera_from_room = cameras[c].camera_from_room * cameras[0].camera_from_room.inverse();
  return out;
}

// The error of every parameter, in the order of the covariance.
inline Eigen::VectorXd errors_of(const CalibrationResult& r, const std::vector<Camera>& truth) {
  std::vector<double> errors;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    const Camera wanted = relative_to_first(truth, c);
    const LensVector lens = lens_of(wanted) - lens_of(r.rig.cameras[c]);
    for (int i = 0; i < lens_count(wanted); ++i) errors.push_back(lens(i));
    const Vec6 twist = se3_log(wanted.camera_from_room * r.rig.cameras[c].camera_from_room.inverse());
    for (int i = 0; i < 6; ++i) errors.push_back(twist(i));
  }
  return Eigen::Map<Eigen::VectorXd>(errors.data(), static_cast<Eigen::Index>(errors.size()));
}

// e^T C^-1 e over the parameters that are free, and their number.
inline std::pair<double, int> nees_of(const Eigen::VectorXd& e, const Eigen::MatrixXd& C) {
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < e.size(); ++i) {
    if (C(i, i) > 0) free.push_back(i);
  }
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd S(n, n);
  Eigen::VectorXd x(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double d = std::sqrt(C(free[i], free[i]));
    x(i) = e(free[i]) / d;
    for (Eigen::Index j = 0; j < n; ++j) S(i, j) = C(free[i], free[j]) / d / std::sqrt(C(free[j], free[j]));
  }
  return {x.dot(S.ldlt().solve(x)), static_cast<int>(n)};
}

}  // namespace sgrt::test
