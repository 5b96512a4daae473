// A start for the bundle: homographies of a flat target, a focal length, poses. Zhang, "A flexible new technique for
// camera calibration" (2000). docs/theory/calibration.md eq. 10-11.
#pragma once

#include <optional>
#include <vector>

#include "calibration/bundle.hpp"

namespace sgrt {

// Pixel plane from target plane, scaled to H(2, 2) = 1 where that is not 0; nothing for fewer than 4 points or a
// degenerate set. Corners of weight 0 do not count.
std::optional<Mat3> homography_of(const Target& target, const View& view);

// The pose of a flat target: of both that a plane allows, the one with the smaller residuals. Nothing where there is
// none. It follows blunders: calibration/blunders.hpp takes them out first.
std::optional<Pose> plane_pose(const Target& target, const Camera& camera, const View& view);

// The focal length, px, that explains the views best with square pixels and the principal point in the middle.
double first_focal_length(const Target& target, const std::vector<View>& views, int width, int height);

}  // namespace sgrt
