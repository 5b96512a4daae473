// The calibrated cameras of a room and their projection. Pinhole with Brown-Conrady distortion, OpenCV's order
// k1 k2 p1 p2 k3 [k4 k5 k6]. docs/theory/rig.md.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/geometry.hpp"

namespace sgrt {

struct Camera {
  std::string id;
  int width = 0, height = 0;  // px
  double fx = 0, fy = 0, cx = 0, cy = 0;
  int distortion_count = 0;            // 0 pinhole, 5 brown5, 8 rational8
  std::array<double, 8> distortion{};  // k1 k2 p1 p2 k3 k4 k5 k6
  Pose camera_from_room;
  double max_radius2 = 0;  // r^2 up to which the distortion is invertible (its Jacobian positive); set by make_camera

  Vec3 centre_in_room() const { return camera_from_room.inverse().t; }
};

// Checks the numbers, finds max_radius2. Throws kFormat naming the field when the distortion folds inside the image.
Camera make_camera(Camera camera);

// Normalised image coordinates to pixel and back, without a pose. Jacobians may be null.
Vec2 distort(const Camera& camera, const Vec2& normalised, Eigen::Matrix2d* jacobian = nullptr);
Vec2 undistort(const Camera& camera, const Vec2& pixel,
               Eigen::Matrix2d* jacobian = nullptr);  // Newton; NaN where it has no root

// Pixel of a point in camera axes, or of the room; NaN behind the camera or beyond the fold.
Vec2 project_camera(const Camera& camera, const Vec3& x_in_camera, Mat23* jacobian = nullptr);
Vec2 project(const Camera& camera, const Vec3& x_in_room, Mat23* jacobian = nullptr);
// Unit ray in room axes from the camera's centre; NaN where no ray has this pixel.
Vec3 unproject(const Camera& camera, const Vec2& pixel, Mat32* jacobian = nullptr);

struct StereoPair {
  std::string id;
  int left = 0, right = 0;  // camera indices
};

// A time-of-flight camera: how its taps sample the light, and what its calibration found. docs/theory/tof.md.
struct TofUnit {
  std::string id;
  int camera = 0;                     // index
  std::vector<double> modulation_hz;  // one or more
  std::vector<double> tap_phase_rad;  // tap = B + A cos(phi - tap_phase)
  bool differential = false;          // signed taps, offset near 0: they tell nothing of their shot noise
  double electrons_per_count = 1, read_noise_e = 0, refractive_index = 1.00027;
  std::vector<double> range_mm, range_error_mm;       // of the measured range, linear between knots; empty: none
  std::vector<double> amplitude, amplitude_error_mm;  // likewise over the amplitude, counts
  std::string pixel_offset_file;                      // its name beside the rig; empty: none
};

// What the calibration leaves uncertain: the parameters' covariance is modes modes^T. rig/uncertainty.hpp.
struct RigUncertainty {
  std::vector<std::string> parameters;  // as parameter_names has them; empty: not known
  Eigen::MatrixXd modes;                // a row a parameter, a column a mode of one sigma
  double residual_px = 0;               // one sigma of a corner's coordinate in the calibration; 0: not known
};

struct Rig {
  std::string id, room;
  std::vector<Camera> cameras;
  std::vector<StereoPair> pairs;
  std::vector<TofUnit> tofs;
  RigUncertainty uncertainty;
  std::string document;  // the JSON as read, unknown keys included; empty for a rig made in memory
};

int camera_index(const Rig& rig, const std::string& id);           // throws kInvalidArgument, lists the known ids
const StereoPair& pair_of(const Rig& rig, const std::string& id);  // likewise
int tof_index(const Rig& rig, const std::string& id);              // likewise

// rig_json.cpp, schema sgrt-rig/1
Rig rig_from_json(const char* text, std::size_t size);
std::string rig_to_json(const Rig& rig);  // numbers to the last bit, unknown keys kept

}  // namespace sgrt
