// The region of interest, see core/roi.hpp.
#include "core/roi.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace sgrt {
namespace {

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kInvalidArgument, message);
}

// Length of the line y inside the polygon by the even-odd rule.
double length_inside(const std::vector<Vec2>& v, double y) {
  std::vector<double> x;
  for (std::size_t i = 0, j = v.size() - 1; i < v.size(); j = i++) {
    if ((v[i].y() > y) != (v[j].y() > y)) {
      x.push_back(v[i].x() + (v[j].x() - v[i].x()) * (y - v[i].y()) / (v[j].y() - v[i].y()));
    }
  }
  std::sort(x.begin(), x.end());
  double length = 0;
  for (std::size_t i = 0; i + 1 < x.size(); i += 2) length += x[i + 1] - x[i];
  return length;
}

// By lines between the heights of the vertices, two to each gap because one may run through a crossing of the edges.
// The shoelace formula will not do: a figure of eight has the sum 0, a triangle gone round twice is even everywhere.
bool has_area(const std::vector<Vec2>& v) {
  std::vector<double> y;
  Vec2 low = v[0], high = v[0];
  for (const Vec2& x : v) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
    y.push_back(x.y());
  }
  std::sort(y.begin(), y.end());
  const double tiny = 1e-12 * (high - low).maxCoeff();
  for (std::size_t i = 0; i + 1 < y.size(); ++i) {
    const double gap = y[i + 1] - y[i];
    if (gap <= tiny) continue;
    if (length_inside(v, y[i] + 0.31 * gap) > tiny || length_inside(v, y[i] + 0.62 * gap) > tiny) return true;
  }
  return false;
}

bool inside(const std::vector<Vec2>& v, double x, double y) {
  bool in = false;
  for (std::size_t i = 0, j = v.size() - 1; i < v.size(); j = i++) {
    if ((v[i].y() > y) != (v[j].y() > y) &&
        x < v[i].x() + (v[j].x() - v[i].x()) * (y - v[i].y()) / (v[j].y() - v[i].y())) {
      in = !in;
    }
  }
  return in;
}

}  // namespace

Roi roi_from_polygon(std::vector<Vec2> vertices) {
  if (vertices.size() < 3) refuse("vertices_xy_mm: expected at least 3, got " + std::to_string(vertices.size()));
  if (vertices.size() > kMaxVertices) {
    fail(Status::kLimit, "vertices_xy_mm: expected at most " + std::to_string(kMaxVertices) + ", got " +
                             std::to_string(vertices.size()));
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (vertices[i].cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxCoordinate) continue;
    refuse("vertices_xy_mm[" + std::to_string(i) + "]: expected |coordinate| <= 1e5 mm, got " +
           text_of(vertices[i].x()) + " " + text_of(vertices[i].y()));
  }
  if (!has_area(vertices)) refuse("vertices_xy_mm: the polygon has no area");
  Roi roi;
  roi.polygon = std::move(vertices);
  return roi;
}

Roi roi_from_box(const Vec3& min, const Vec3& max) {
  for (int k = 0; k < 3; ++k) {
    const std::string index = "[" + std::to_string(k) + "]";
    if (!std::isfinite(min(k))) refuse("min_mm" + index + ": expected a finite number, got " + text_of(min(k)));
    if (!std::isfinite(max(k))) refuse("max_mm" + index + ": expected a finite number, got " + text_of(max(k)));
    if (min(k) < max(k)) continue;
    refuse("min_mm" + index + ": expected less than max_mm" + index + " = " + text_of(max(k)) + ", got " +
           text_of(min(k)));
  }
  Roi roi;
  roi.box_min = min;
  roi.box_max = max;
  return roi;
}

Roi moved(const Roi& roi, const Pose& pose) {
  constexpr double kTurn = 1e-9;  // a sine: 0.1 micron at 100 mm
  if (roi.polygon.empty()) {
    if ((pose.R - Mat3::Identity()).cwiseAbs().maxCoeff() > kTurn) {
      refuse("pose: a box cannot turn, expected no rotation; give a polygon");
    }
    return roi_from_box(roi.box_min + pose.t, roi.box_max + pose.t);
  }
  if (std::abs(pose.R(2, 2) - 1) > kTurn) {
    refuse("pose: a polygon seen from above turns about the vertical alone, expected a rotation about Z");
  }
  std::vector<Vec2> vertices;
  vertices.reserve(roi.polygon.size());
  for (const Vec2& v : roi.polygon) vertices.push_back((pose.R.topLeftCorner<2, 2>() * v + pose.t.head<2>()).eval());
  return roi_from_polygon(std::move(vertices));
}

bool contains(const Roi& roi, const Surface& surface, std::int64_t i) {
  if (!surface.present(i)) return false;
  if (roi.polygon.empty()) {
    const Vec3 x = surface.point(i);
    return (x.array() >= roi.box_min.array()).all() && (x.array() <= roi.box_max.array()).all();
  }
  if (surface.has_normals() && !(surface.normals(i, 2) > 0)) return false;
  return inside(roi.polygon, surface.points(i, 0), surface.points(i, 1));
}

}  // namespace sgrt
