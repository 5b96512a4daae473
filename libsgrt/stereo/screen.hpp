// What is not trusted among the matches, and why the others are missing. docs/theory/stereo.md, "Folds and edges".
#pragma once

#include "core/run.hpp"
#include "stereo/coarse.hpp"
#include "stereo/field.hpp"

namespace sgrt {

// What the quadratic leaves unexplained of the neighbourhood, beyond twice the noise, is the bias that a window may
// have there: it joins the sigma. A window of which a quarter has no surface straddles an edge: both sides' speckle
// pulls at it.
void judge_neighbourhood(const Run& run, const Grid& grid, const StereoOptions& options, MatchField& field);

// Connected groups (neighbours whose planes agree) smaller than min_component are ambiguous, and so are those that lie
// for the most part where another place correlates nearly as well: they grew from a few chance seeds of a repeated
// pattern.
void remove_islands(const CoarseMap& coarse, const Grid& grid, const StereoOptions& options, MatchField& field);

// What kept an unmatched window from matching, as far as the left image tells.
void explain_unmatched(const Run& run, const kernels::Plane& left, const CoarseMap& coarse, const Grid& grid,
                       const StereoOptions& options, std::vector<float>& noise, MatchField& field);

// Unmatched windows whose place in the right image, carried on from the surface on their left, a nearer part of the
// surface covers: the right camera stands on the right, so that it is the background left of an outline that it misses.
void tell_occluded(const Grid& grid, int right_width, std::vector<float>& front, MatchField& field);

}  // namespace sgrt
