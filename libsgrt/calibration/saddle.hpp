// Corners of a chessboard in an image: candidates with their two edges, and the sub-pixel fit of one.
#pragma once

#include <optional>
#include <vector>

#include "core/geometry.hpp"
#include "core/image.hpp"

namespace sgrt {

// A place where two dark and two bright sectors meet.
struct Saddle {
  Vec2 at;  // px
  double
      angle[2];  // of its two edges, rad, 0 to pi; the sector that follows angle[0] counter-clockwise (x to y) is dark
  double strength;  // grey levels between the sectors
};

// Strongest first, at most `most`. radius: of the ring that is looked at, px.
std::vector<Saddle> find_saddles(const Image& image, double radius, std::size_t most);

// The value between pixels, bilinear; NaN outside.
double sample(const Image& image, const Vec2& at);

// The blurred corner m + g.x + c erf(n1.x / s) erf(n2.x / s), least squares in a disc round the start (eq. 18).
// sigma_px: one sigma of each coordinate from the residuals. Nothing where it does not converge within the disc or does
// not look like a corner.
struct FittedCorner {
  Vec2 at;
  double sigma_px, blur_px, contrast;
};
std::optional<FittedCorner> fit_corner(const Image& image, const Vec2& start, double angle1, double angle2,
                                       double radius);

}  // namespace sgrt
