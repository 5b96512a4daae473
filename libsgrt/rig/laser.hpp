// A laser unit: a fan of light that a motor mirror turns, and the light plane of each mirror angle (reflected-plane
// model). docs/theory/laser.md eq. 10-12.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "rig/uncertainty.hpp"

namespace sgrt {

struct LaserUnit {
  std::string id;
  int camera = 0;
  Vec3 fan_point = Vec3::Zero(), fan_normal = Vec3::UnitX();  // room, mm
  bool mirror = true;                                         // without one the fan itself is the light plane
  Vec3 axis_point = Vec3::Zero(), axis_direction = Vec3::UnitY(), normal_at_zero = Vec3::UnitZ();
  double offset = 0;  // mm
  double angle_scale = 1, angle_zero = 0;
};

// n . x = d, n unit.
struct LightPlane {
  Vec3 n;
  double d;
};
LightPlane light_plane(const LaserUnit& unit, double reading);
// By the reading, per rad.
LightPlane light_plane_slope(const LaserUnit& unit, double reading);

// The parameters of a unit whose errors a calibration states, "ID." before each: small turns (rad, room axes) of
// the fan's normal, the axis and the mirror's normal; mm of the fan along its normal, of the axis and of the mirror.
constexpr int kLaserParameters = 16;
using LaserVector = Eigen::Matrix<double, kLaserParameters, 1>;
std::vector<std::string> parameter_names(const LaserUnit& unit);
LaserUnit moved(LaserUnit unit, const LaserVector& by);
// The light plane's derivatives, central differences: 4 x parameters, (n, d).
using PlaneJacobian = Eigen::Matrix<double, 4, kLaserParameters>;
PlaneJacobian light_plane_jacobian(const LaserUnit& unit, double reading);

// The unit in the gauge of formats.md: unit vectors, angle_zero 0, axis_point nearest to `camera` (mm).
LaserUnit normalised(LaserUnit unit, const Vec3& camera);

// The rig's modes as far as they are of a unit's camera and of the unit: a row a parameter, a column a mode. No columns
// where the rig states no uncertainty of them.
struct LaserModes {
  Eigen::MatrixXd camera, laser;
  Eigen::Index count() const { return camera.cols(); }
};
LaserModes laser_modes(const Rig& rig, const LaserUnit& unit);
// d point by each mode, 3 x modes, mm: its image and its reading stay, camera and laser move (eq. 14).
Mat3X point_modes(const Camera& camera, const LaserModes& modes, const LightPlane& plane,
                  const PlaneJacobian& by_parameters, const Vec3& x_in_room);

// laser_json.cpp: "lasers" of the rig's document.
std::vector<std::string> laser_ids(const Rig& rig);
LaserUnit laser_of(const Rig& rig, const std::string& id);  // throws kInvalidArgument (unknown id), kFormat
// The rig's text with this unit written into it, in place of one of its id; `uncertainty` replaces the rig's.
std::string rig_with_laser(const Rig& rig, const LaserUnit& unit, const RigUncertainty& uncertainty);
// The unit where the room is moved: x_new = pose x_old.
LaserUnit moved(LaserUnit unit, const Pose& pose);

}  // namespace sgrt
