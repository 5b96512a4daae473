// Motions in a clinic's words: the basis of free motions nearest to the room's axes, and a short English text of each.
// docs/theory/icp.md section 5.
#pragma once

#include <string>
#include <vector>

#include "registration/icp.hpp"

namespace sgrt {

constexpr double kTurnLever = 100;  // mm, at which turns are compared with shifts
using Motions = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// Rotations times kTurnLever, so that all six are mm.
Vec6 scaled(const Vec6& motion);

// Spans the same space as the columns of `basis` (scaled, at the isocentre, independent): pure slides first, then
// turns, each along a room axis as far as the space allows.
std::vector<FreeMotion> name_motions(const Motions& basis, const Vec3& isocentre);

// "slides along LNG", "turns about VRT (RTN)", "turns about LAT (PITCH) through (0, 0, -120) mm".
std::string words_of(const Vec6& motion, const Vec3& isocentre);

}  // namespace sgrt
