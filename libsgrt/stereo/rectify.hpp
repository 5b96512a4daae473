// Epipolar rectification of a pair from the rig: two virtual pinhole cameras with one rotation and one focal length, x
// along the baseline, so that a point lies on the same row of both. Fusiello, Trucco, Verri (2000).
// docs/theory/stereo.md eq. 1-3.
#pragma once

#include <cstdint>
#include <vector>

#include "core/image.hpp"
#include "core/run.hpp"
#include "rig/rig.hpp"

namespace sgrt {

// One virtual camera. Its images lie on the rows [0, height) that both share, and on columns of its own.
struct RectifiedView {
  const Camera* camera = nullptr;
  int width = 0, height = 0;
  double cx = 0, cy = 0;
  // For each rectified pixel the pixel of the image as taken: x, y pairs, also beside it; NaN where no ray has one.
  std::vector<float> source;
  int crop_x = 0, crop_y = 0, crop_width = 0, crop_height = 0;  // the part of the image as taken that it needs
  double noise_gain = 1;  // of white noise of variance 1 that is resampled so, on average
};

struct Rectification {
  double f = 0;         // px
  double baseline = 0;  // mm
  Mat3 room_from_rectified;
  Vec3 centre;  // of the left camera, room
  RectifiedView left, right;

  // Disparity x_left - x_right at infinity.
  double disparity_at_infinity() const { return left.cx - right.cx; }
  // Where a rectified pixel lies in the image as taken.
  Vec2 source_pixel(const RectifiedView& view, double x, double y) const;
};

// volume: box in the room; only what it can show is kept. Throws kDegenerate when a camera looks along the baseline,
// kInvalidArgument when the cameras have no view in common.
Rectification make_rectification(const Run& run, const Camera& left, const Camera& right, const Vec3& volume_min,
                                 const Vec3& volume_max);

// The part of a rectification that shows rows [y, y + height), the left columns [x_left, x_left + width_left) and the
// right columns alike; all inside it.
struct RectifiedCrop {
  int x_left, width_left, x_right, width_right, y, height;
};
Rectification cropped(const Rectification& whole, const RectifiedCrop& crop);

// Buffers kept from frame to frame.
struct RectifyWork {
  Image coefficients;
  std::vector<std::uint8_t> clipped;  // one a pixel of the image as taken; empty: none is clipped
};

// An image as taken, resampled by cubic B-spline into the virtual camera. mask: 0 where good, else a Reason
// (kOutOfView, kSaturated).
void rectify(const Run& run, const ImageView& image, const RectifiedView& view, RectifyWork& work, Image& out,
             std::vector<std::uint8_t>& mask);

}  // namespace sgrt
