// A surface: points of a skin and what is known of each (eq. 10.1). An unordered cloud, an organised grid (a point a
// pixel, NaN where absent) or a triangle mesh.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/eigen.hpp"
#include "core/geometry.hpp"

namespace sgrt {

using Covariances = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;  // xx xy xz yy yz zz, mm2
using Faces = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

struct Surface {
  std::int64_t height = 0, width = 0;  // of the grid, row-major; 0 for a cloud or a mesh
  Points points;                       // mm
  Points normals;                      // unit, outward; empty: absent. NaN where unknown
  Eigen::VectorXd sigma;               // mm along the normal; empty: absent
  Covariances covariance;              // empty: absent
  Faces faces;
  std::vector<Points> modes;            // shared error modes, one sigma, mm
  std::vector<std::string> mode_names;  // one each, or none at all; equal names of two surfaces mean one cause
  double correlation_points = 1;        // neighbouring points that share one noise sample

  std::int64_t size() const { return points.rows(); }
  bool organised() const { return height > 0; }
  bool has_normals() const { return normals.rows() > 0; }
  bool present(std::int64_t i) const { return points(i, 0) == points(i, 0); }
  Vec3 point(std::int64_t i) const { return points.row(i).transpose(); }
  Vec3 normal(std::int64_t i) const { return normals.row(i).transpose(); }
  // Variance along the unit direction n: from the covariance, else sigma^2, else NaN.
  double variance_along(std::int64_t i, const Vec3& n) const;
};

constexpr std::int64_t kMaxPoints = 50'000'000;
constexpr double kMaxCoordinate = 1e5;  // mm
constexpr int kMaxModes = 8;

// Checks shapes and values (see sgrt_surface_create) and adds a mesh's vertex normals. Throws; returns the surface.
Surface make_surface(Surface surface);

// z(x, y) with column j at origin.x + j spacing.x, row i at origin.y + i spacing.y; normals by central differences,
// towards +z.
Surface surface_from_height_field(
    const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>& z,
    const Vec2& origin, const Vec2& spacing);

// The surface under a rigid motion: points, normals, covariance and modes; sigma, along the normal, stays.
Surface moved(Surface surface, const Pose& pose);

// A row of Surface::covariance as a matrix, and back.
Mat3 unpacked(const Eigen::Ref<const Eigen::Matrix<double, 1, 6>>& covariance);
Eigen::Matrix<double, 1, 6> packed(const Mat3& covariance);

// The component of point i's covariance along the unit direction n becomes `variance`; what lies across stays
// (docs/theory/surface.md eq. 9).
void set_variance_along(Surface& s, std::int64_t i, const Vec3& n, double variance);

// The surface without the points whose flag is false: absent in a grid, dropped from a cloud, and with their faces from
// a mesh. kInsufficientData where none is left.
Surface kept(Surface surface, const std::vector<bool>& keep);

// Area-weighted normals of the vertices; NaN for a vertex without a face.
Points vertex_normals(const Points& points, const Faces& faces);

}  // namespace sgrt
