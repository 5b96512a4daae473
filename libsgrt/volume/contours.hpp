// A closed surface from planar contours on a stack of slices (RTSTRUCT): between two slices the signed distance to the
// contours is interpolated, so that legs and arms branch by themselves (Raya and Udupa 1990; Herman, Zheng, Bucholtz
// 1992). docs/theory/volume.md, "Contours".
#pragma once

#include <vector>

#include "volume/skin.hpp"

namespace sgrt {

struct ContoursOptions {
  double pixel = 0.75;   // mm, of the distance maps
  double smoothing = 0;  // mm, as in SkinOptions; 0: the surface goes through the contours
};

struct ClosedContours {
  Skin skin;
  int slices = 0;
  double spacing = 0, largest_gap = 0;  // mm between slices: median and largest
};

// Each contour is closed by itself; parallel planes in any direction. Several on one slice follow the even-odd rule: a
// contour within another is a hole. Throws kInvalidArgument naming a contour that is not planar or not parallel to the
// first.
ClosedContours close_contours(const Run& run, const std::vector<Points>& contours, const ContoursOptions& options);

}  // namespace sgrt
