// What a rig's stored calibration covariance does to a pixel and to a triangulated point: each of its modes moves them
// by so much at one sigma, and all points of a scene together. Stereo, laser and registration carry these as shared
// error modes. docs/theory/calibration.md eq. 20-22.
#pragma once

#include "rig/parameters.hpp"

namespace sgrt {

using Mat2X = Eigen::Matrix<double, 2, Eigen::Dynamic>;
using Mat3X = Eigen::Matrix<double, 3, Eigen::Dynamic>;

// d pixel by the camera's parameters, lens then pose, as parameter_names has them, at a point in camera axes; false
// where the lens has no pixel for it.
bool pixel_by_parameters(const Camera& camera, const Vec3& x_in_camera, Mat2X& J);

// The rows of the stored modes that are of these parameters; one that the rig does not name is exact.
Eigen::MatrixXd modes_of(const Rig& rig, const std::vector<std::string>& names);
// Of this camera's.
Eigen::MatrixXd camera_modes(const Rig& rig, const Camera& camera);

// d pixel of a room point by each mode, 2 x modes, px; NaN where the point has no pixel. No columns where the rig
// states no uncertainty.
Mat2X pixel_modes(const Rig& rig, int camera, const Vec3& x_in_room);

// d triangulated point by each mode, 3 x modes, mm: the point's image stays, the cameras move (eq. 21).
Mat3X point_modes(const Rig& rig, const StereoPair& pair, const Vec3& x_in_room);

// The same for a point on the ray of its left pixel, at the depth where the right one fits best, as stereo has it: it
// follows the left camera where the two disagree across the epipolar lines.
Mat3X left_ray_modes(const Rig& rig, const StereoPair& pair, const Vec3& x_in_room);

// Covariance of a triangulated point from the noise of its two images, px a coordinate; NaN where a camera does not see
// it.
Mat3 triangulation_covariance(const Rig& rig, const StereoPair& pair, const Vec3& x_in_room, double noise_px);

// The leading modes of a covariance of all parameters of the cameras: those that matter to the pixels of the whole
// image at `distances` (mm), strongest first, until what is left is 1e-7 of the variance (eq. 20).
RigUncertainty compact(const std::vector<Camera>& cameras, const Eigen::MatrixXd& covariance,
                       const std::vector<double>& distances, double residual_px);

// The few combinations of a rig's modes that its surfaces carry as shared error modes, and the directions that these
// leave out: V = [kept rest] is a rotation of the modes, so that M V has the covariance of M. They follow from the rig
// alone, for all its pairs at once: what two pods, or a reference and a live surface, say of one name is one cause. The
// name holds a fingerprint of cameras, pairs and modes: a new calibration under the old id is another cause.
struct SharedModes {
  std::vector<std::string> names;  // "<rig id> <fingerprint> k"; none where the rig states no uncertainty
  Eigen::MatrixXd kept, rest;      // modes x names, modes x what is left
};
SharedModes shared_modes(const Rig& rig);

}  // namespace sgrt
