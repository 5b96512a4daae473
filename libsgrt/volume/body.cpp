// The patient's voxels. docs/theory/volume.md section 1.
#include "volume/body.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "core/error.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

template <class T>
void above(const Voxels& v, int y, int z, T, double threshold, RowSpans& out) {
  const char* row = v.row(y, z);
  for (int x = 0; x < v.nx; ++x, row += v.x_stride) {
    T stored;
    std::memcpy(&stored, row, sizeof stored);
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(stored))
        fail(Status::kInvalidArgument, "voxels[" + std::to_string(z) + ", " + std::to_string(y) + ", " +
                                           std::to_string(x) + "]: " + text_of(stored) + ", expected a finite number");
    }
    if (!(v.slope * static_cast<double>(stored) + v.intercept > threshold)) continue;
    if (!out.empty() && out.back().end == x) {
      ++out.back().end;
    } else {
      out.push_back({x, x + 1});
    }
  }
}

Runs tissue_of(const Run& run, const Voxels& v, double threshold) {
  Runs tissue(v.nx, v.ny, v.nz);
  parallel_for(
      run, v.nz, 2,
      [&](std::int64_t begin, std::int64_t end) {
        for (int z = static_cast<int>(begin); z < end; ++z) {
          for (int y = 0; y < v.ny; ++y) v.visit([&](auto zero) { above(v, y, z, zero, threshold, tissue.row(y, z)); });
        }
      },
      "reading the volume");
  return tissue;
}

// The largest part, with bridges of one or two voxels cut: the part is grown back by what the cut took, within the
// tissue.
Runs largest_part(const Run& run, const Runs& tissue, const Vec3& spacing) {
  const double bridge = 1.01 * spacing.minCoeff();
  Runs core = largest_component(erode(run, tissue, bridge, spacing, true));
  if (core.count() == 0) core = largest_component(tissue);  // no part is three voxels thick
  return intersect(run, dilate(run, core, 2 * bridge, spacing), tissue);
}

// Air from the border of the volume that a ball of this radius reaches, and what lies just beyond it: the rest
// (airways, lungs, bowel, the gap of closed lips) is the inside. The two ends of the scan are no way in.
Runs outside_of(const Run& run, const Runs& body, double radius, const Vec3& spacing) {
  const Runs air = complement(run, body);
  const Runs wide = erode(run, air, radius, spacing, true);
  const Runs reached = components_with(
      wide, [&](const Span& s, int y, int) { return s.begin == 0 || s.end == body.nx || y == 0 || y == body.ny - 1; });
  const Runs close = intersect(run, dilate(run, reached, radius + 2 * spacing.maxCoeff(), spacing), air);
  return components_with(close, [&](const Span& s, int y, int z) {
    const RowSpans& row = reached.row(y, z);
    return std::any_of(row.begin(), row.end(), [&](const Span& r) { return r.begin < s.end && s.begin < r.end; });
  });
}

}  // namespace

Body find_body(const Run& run, const Voxels& voxels, const BodyOptions& options) {
  const Vec3 spacing = voxels.spacing();
  Body body;
  body.tissue = tissue_of(run, voxels, options.threshold);
  body.support = find_support(body.tissue, options.down, spacing);
  body.mask = largest_part(run, without_support(run, body.tissue, body.support), spacing);
  if (body.mask.count() == 0)
    fail(Status::kNotFound, "no body: no voxel is above threshold_hu = " + text_of(options.threshold));
  if (options.closing > 0) body.mask = complement(run, outside_of(run, body.mask, options.closing, spacing));
  body.mask = largest_component(body.mask);
  return body;
}

}  // namespace sgrt
