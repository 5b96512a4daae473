// From the coarse map to a sub-pixel match at every grid point: seeds, growth from solved neighbours, a second pass
// over the curvature, left-right check. docs/theory/stereo.md.
#pragma once

#include "core/run.hpp"
#include "stereo/coarse.hpp"
#include "stereo/field.hpp"
#include "stereo/rectified_image.hpp"

namespace sgrt {

void match_grid(const Run& run, const RectifiedImage& left, const RectifiedImage& right, const CoarseMap& coarse,
                const Grid& grid, const StereoOptions& options, MatchField& field);

}  // namespace sgrt
