// What one registration works on: both surfaces with normals, the reference ready for look-ups, who takes part, and the
// noise of each point. docs/theory/icp.md section 1.
#pragma once

#include <vector>

#include "core/roi.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "surface/field.hpp"

namespace sgrt {

struct Problem {
  // Throws kInsufficientData when fewer than 6 points of either side can take part. roi may be null.
  Problem(const Run& run, const Surface& reference, const Surface& live, const Roi* roi);
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  const Surface& reference() const { return *field.surface; }
  bool counts(std::int64_t reference_row) const {
    return in_roi.empty() || in_roi[static_cast<std::size_t>(reference_row)] != 0;
  }
  // mm2 along the unit direction n, in each surface's own axes.
  double reference_variance(std::int64_t row, const Vec3& n) const;
  double live_variance(std::int64_t row, const Vec3& n) const;

  Surface estimated_reference, estimated_live;  // copies, only where normals had to be estimated
  Field field;                                  // of the reference
  const Surface* live;
  std::vector<std::uint8_t> in_roi;              // a reference point; empty: all
  std::int64_t reference_count = 0;              // of the reference points that count
  std::vector<std::int64_t> rows;                // live points that have a normal, neighbours together
  bool signs_unsure;                             // of the normals, because some were estimated
  double reference_noise2 = 0, live_noise2 = 0;  // mm2, where the points carry none: the surface's roughness
  Vec3 centre;                                   // of the reference points that count: the pivot of all solves
  double spacing = 0;                            // mm, the median reach of the reference's samples
  double lever;                                  // mm, their rms distance from it: makes turns comparable with shifts
};

}  // namespace sgrt
