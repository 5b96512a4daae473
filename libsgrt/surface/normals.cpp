// Normals from local fits, turned towards the viewpoint. docs/theory/surface.md eq. 1-3.
#include "surface/normals.hpp"

#include <limits>
#include <vector>

#include "core/error.hpp"
#include "core/nearest.hpp"
#include "core/parallel.hpp"
#include "surface/local_fit.hpp"

namespace sgrt {

Surface estimate_normals(const Run& run, Surface surface, const NormalsOptions& options) {
  if (options.neighbours < 6 || options.neighbours > 200) {
    fail(Status::kInvalidArgument, "neighbours is " + std::to_string(options.neighbours) + ", expected 6 to 200");
  }
  if (!(options.radius > 0)) {
    fail(Status::kInvalidArgument, "radius_mm is " + text_of(options.radius) + ", expected a positive number");
  }
  require(options.viewpoint.allFinite(), "viewpoint_mm is not finite");
  const Nearest nearest(run, surface.points);
  if (nearest.size() < kMinNeighbours) {
    fail(Status::kInsufficientData,
         "the surface has " + std::to_string(nearest.size()) + " points, normals need at least 6");
  }
  surface.normals = Points::Constant(surface.size(), 3, std::numeric_limits<double>::quiet_NaN());
  parallel_for(
      run, surface.size(), 512,
      [&](std::int64_t begin, std::int64_t end) {
        std::vector<Nearest::Hit> hits(static_cast<std::size_t>(options.neighbours));
        for (std::int64_t i = begin; i < end; ++i) {
          if (!surface.present(i)) continue;
          const Vec3 x = surface.point(i);
          const int count = nearest.neighbours(x, options.neighbours, options.radius, hits.data());
          const Vec3 n = fit_local(surface.points, x, hits.data(), count).normal;
          surface.normals.row(i) = (n.dot(options.viewpoint - x) < 0 ? Vec3(-n) : n).transpose();
        }
      },
      "normals");
  return surface;
}

}  // namespace sgrt
