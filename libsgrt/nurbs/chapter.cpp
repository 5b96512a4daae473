// The chapter's reconstruction (section 10.3.2, steps 1 to 3; steps 4 to 8 are evaluation).
#include "core/error.hpp"
#include "nurbs/interpolate.hpp"

namespace sgrt {

NurbsSurface chapter_surface(const Surface& surface, int c, int d) {
  if (!surface.organised()) {
    fail(Status::kInvalidArgument,
         "surface: " + std::to_string(surface.size()) + " points without order, expected a grid");
  }
  const Eigen::Index rows = surface.height, columns = surface.width;
  for (Eigen::Index i = 0; i < surface.size(); ++i) {
    if (surface.present(i)) continue;
    fail(Status::kInvalidArgument, "surface: no point at row " + std::to_string(i / columns) + ", column " +
                                       std::to_string(i % columns) + ", expected a grid without holes");
  }
  // Which way v must run for S_u x S_v to be outward: summed over all cells, so that no single normal decides.
  double side = 0;
  for (Eigen::Index i = 0; surface.has_normals() && i + 1 < rows; ++i) {
    for (Eigen::Index j = 0; j + 1 < columns; ++j) {
      const Eigen::Index k = i * columns + j;
      const Vec3 along = surface.point(k + 1) - surface.point(k), down = surface.point(k + columns) - surface.point(k);
      const double s = along.cross(down).dot(surface.normal(k));
      if (s == s) side += s;
    }
  }
  NurbsSurface out{{uniform_basis(c, static_cast<int>(columns)), uniform_basis(d, static_cast<int>(rows))}, {}, {}};
  out.points.resize(rows * columns, 3);
  for (Eigen::Index j = 0; j < columns; ++j) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      out.points.row(j * rows + i) = surface.points.row((side < 0 ? rows - 1 - i : i) * columns + j);
    }
  }
  return make_nurbs_surface(std::move(out));
}

}  // namespace sgrt
