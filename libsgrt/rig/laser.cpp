// See rig/laser.hpp; symbols of docs/theory/laser.md.
#include "rig/laser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"

namespace sgrt {
namespace {

using Vec4 = Eigen::Vector4d;

Vec4 as_vector(const LightPlane& p) {
  return {p.n.x(), p.n.y(), p.n.z(), p.d};
}

}  // namespace

// eq. 11: N' = N - 2 (N.n) n, d' = N.p - 2 (N.n) (n.q + o).
LightPlane light_plane(const LaserUnit& u, double reading) {
  const double d = u.fan_normal.dot(u.fan_point);
  if (!u.mirror) return {u.fan_normal, d};
  const double a = u.angle_scale * (reading - u.angle_zero);
  const Vec3 n = so3_exp(a * u.axis_direction) * u.normal_at_zero;
  const double nu = u.fan_normal.dot(n);
  return {u.fan_normal - 2 * nu * n, d - 2 * nu * (n.dot(u.axis_point) + u.offset)};
}

LightPlane light_plane_slope(const LaserUnit& u, double reading) {
  if (!u.mirror) return {Vec3::Zero(), 0};
  const double a = u.angle_scale * (reading - u.angle_zero);
  const Vec3 n = so3_exp(a * u.axis_direction) * u.normal_at_zero, dn = u.angle_scale * u.axis_direction.cross(n);
  const double nu = u.fan_normal.dot(n), dnu = u.fan_normal.dot(dn);
  return {-2 * (dnu * n + nu * dn), -2 * (dnu * (n.dot(u.axis_point) + u.offset) + nu * dn.dot(u.axis_point))};
}

std::vector<std::string> parameter_names(const LaserUnit& unit) {
  static constexpr std::array<const char*, kLaserParameters> kNames = {
      "fan_rx", "fan_ry", "fan_rz",    "fan_mm",    "axis_rx",   "axis_ry",   "axis_rz",     "axis_x",
      "axis_y", "axis_z", "normal_rx", "normal_ry", "normal_rz", "offset_mm", "angle_scale", "angle_zero_rad"};
  std::vector<std::string> names;
  names.reserve(kNames.size());
  for (const char* name : kNames) names.push_back(unit.id + "." + name);
  return names;
}

LaserUnit moved(LaserUnit u, const LaserVector& by) {
  u.fan_point += by(3) * u.fan_normal;
  u.fan_normal = so3_exp(by.segment<3>(0)) * u.fan_normal;
  u.axis_direction = so3_exp(by.segment<3>(4)) * u.axis_direction;
  u.axis_point += by.segment<3>(7);
  u.normal_at_zero = so3_exp(by.segment<3>(10)) * u.normal_at_zero;
  u.offset += by(13);
  u.angle_scale += by(14);
  u.angle_zero += by(15);
  return u;
}

LaserUnit moved(LaserUnit u, const Pose& pose) {
  u.fan_point = pose * u.fan_point;
  u.axis_point = pose * u.axis_point;
  for (Vec3* v : {&u.fan_normal, &u.axis_direction, &u.normal_at_zero}) *v = pose.R * *v;
  return u;
}

PlaneJacobian light_plane_jacobian(const LaserUnit& unit, double reading) {
  PlaneJacobian J;
  for (int i = 0; i < kLaserParameters; ++i) {
    const double step = i == 3 || (i >= 7 && i < 10) || i == 13 ? 1e-3 : 1e-6;  // mm, rad
    const LaserVector e = step * LaserVector::Unit(i);
    J.col(i) = (as_vector(light_plane(moved(unit, e), reading)) -
                as_vector(light_plane(moved(unit, LaserVector(-e)), reading))) /
               (2 * step);
  }
  return J;
}

LaserUnit normalised(LaserUnit u, const Vec3& camera) {
  u.fan_normal.normalize();
  u.fan_point = camera - u.fan_normal.dot(camera - u.fan_point) * u.fan_normal;
  if (!u.mirror) return u;
  u.axis_direction.normalize();
  u.normal_at_zero.normalize();
  u.normal_at_zero = so3_exp(-u.angle_scale * u.angle_zero * u.axis_direction) * u.normal_at_zero;
  u.angle_zero = 0;
  const Vec3 along = u.axis_direction * u.axis_direction.dot(camera - u.axis_point);
  u.offset -= u.normal_at_zero.dot(along);  // n . axis_direction is the same at every angle
  u.axis_point += along;
  return u;
}

LaserModes laser_modes(const Rig& rig, const LaserUnit& unit) {
  const std::vector<std::string> of_camera = parameter_names(rig.cameras[static_cast<std::size_t>(unit.camera)]);
  const std::vector<std::string> of_unit = parameter_names(unit);
  const std::vector<std::string>& stated = rig.uncertainty.parameters;
  if (std::find_first_of(stated.begin(), stated.end(), of_camera.begin(), of_camera.end()) == stated.end() &&
      std::find_first_of(stated.begin(), stated.end(), of_unit.begin(), of_unit.end()) == stated.end())
    return {};
  return {modes_of(rig, of_camera), modes_of(rig, of_unit)};
}

// The point keeps its image and stays on the plane that has moved: project(x + dx; p + dp) = pixel, n'.(x + dx) = d'.
Mat3X point_modes(const Camera& camera, const LaserModes& modes, const LightPlane& plane,
                  const PlaneJacobian& by_parameters, const Vec3& x) {
  Mat2X by_camera;
  if (!pixel_by_parameters(camera, camera.camera_from_room * x, by_camera))
    return Mat3X::Constant(3, modes.count(), std::numeric_limits<double>::quiet_NaN());
  Mat3X moves(3, modes.count());
  moves.topRows<2>() = by_camera * modes.camera;
  moves.row(2) = (x.transpose() * by_parameters.topRows<3>() - by_parameters.row(3)) * modes.laser;
  Mat3 A;
  const Mat23 by_point = by_camera.rightCols<3>();  // a camera that moves by as much
  A << by_point * camera.camera_from_room.R, plane.n.transpose();
  return -A.inverse() * moves;
}

}  // namespace sgrt
