// The parameters of a camera that a calibration estimates, their names, and the projection's derivatives by them: what
// calibration solves with and what carries the stored uncertainty of a rig to a pixel. docs/theory/calibration.md
// eq. 1-3.
#pragma once

#include <string>
#include <vector>

#include "rig/rig.hpp"

namespace sgrt {

// fx fy cx cy, then k1 k2 p1 p2 k3 k4 k5 k6 as far as the model has them.
constexpr int kMaxLens = 12;
using LensVector = Eigen::Matrix<double, kMaxLens, 1>;
using LensJacobian = Eigen::Matrix<double, 2, kMaxLens>;

inline int lens_count(const Camera& camera) {
  return 4 + camera.distortion_count;
}
LensVector lens_of(const Camera& camera);
void set_lens(const LensVector& lens, Camera& camera);

// "ID.fx" ... of the lens, then "ID.rx" to "ID.tz" of the pose: camera_from_room_true = exp(r, t) camera_from_room.
std::vector<std::string> parameter_names(const Camera& camera);

// Pixel of a point in camera axes with its derivatives by the point and by the lens. False, and nothing written, where
// the point is not in front of the camera or the distortion has passed its fold there; unlike project_camera it asks no
// more of the camera, so that a solver may try any numbers.
bool project_with_lens(const Camera& camera, const Vec3& x_in_camera, Vec2& pixel, Mat23& by_point,
                       LensJacobian& by_lens);
// The same without derivatives.
bool project_with_lens(const Camera& camera, const Vec3& x_in_camera, Vec2& pixel);

}  // namespace sgrt
