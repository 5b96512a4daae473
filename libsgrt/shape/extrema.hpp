// Extrema of the mean curvature with their persistence, and the crest lines where the skin is bent most: what can be
// found again on a surface. Edelsbrunner, Letscher, Zomorodian (2002); Belyaev and Ohtake (2005).
// docs/theory/landmarks.md eq. 1-3.
#pragma once

#include <vector>

#include "core/run.hpp"
#include "shape/curvature.hpp"

namespace sgrt {

// Of each known point up to kBeside known ones next to it in its sheet, itself among them; -1 where there are fewer.
constexpr std::size_t kBeside = 9;
std::vector<std::int32_t> beside_in_sheet(const Run& run, const Surface& surface, const CurvatureField& field);

struct Extremum {
  std::int64_t row;    // of the surface
  int sign;            // +1: a maximum of H (convex), -1: a minimum (concave)
  double persistence;  // 1/mm: how far H falls before a higher one is reached
};

// Maxima of H above 0 and minima below it that stand out by more than `sigmas` of their own sigma, the most persistent
// first.
std::vector<Extremum> extrema(const CurvatureField& field, const std::vector<std::int32_t>& beside, double sigmas);

// The numbers are those of SGRT_CREST_... in sgrt.h.
enum class Crest : std::uint8_t { kNone = 0, kRidge = 1, kValley = 2 };

// Points at which k1 (k2) is the largest (least) along its own direction, and bent by more than `sigmas`.
// Surface: the one that the field is of.
std::vector<std::uint8_t> crests(const Run& run, const Surface& surface, const CurvatureField& field,
                                 const std::vector<std::int32_t>& beside, double sigmas);

}  // namespace sgrt
