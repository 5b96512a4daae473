// The caller's correspondences, checked and sorted into views, and what a turned or mirrored target would be.
#pragma once

#include "calibration/calibrate.hpp"

namespace sgrt {

// Throws kInvalidArgument naming the entry. Cameras, placements, points and sights are all looked at.
void check_data(const CalibrationData& data);
// Of it, that every sight is of a camera, placement and point that there are, at a pixel of the image.
void check_sights(const CalibrationData& data);

// One view a camera and placement, by placement name, then camera; points in the target's order. Views of fewer than 6
// points and repeated images go to `discarded`.
std::vector<View> views_of(const CalibrationData& data, std::vector<Discarded>& discarded);

// For each point of the target the one that lies where the point comes to lie by x -> sx x, y -> sy y about the middle;
// empty where the target has no such symmetry.
std::vector<int> symmetry_of(const Target& target, double sx, double sy);

// The view with each point renamed.
View renamed(const View& view, const std::vector<int>& names);

}  // namespace sgrt
