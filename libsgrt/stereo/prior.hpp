// Live mode: a surface near which the next frame is sought. The right image is warped by it, and the coarse search asks
// only how far the skin has moved since. docs/theory/stereo.md, "Live mode".
#pragma once

#include "core/roi.hpp"
#include "stereo/coarse.hpp"
#include "stereo/dense.hpp"
#include "stereo/rectify.hpp"

namespace sgrt {

struct PriorOptions {
  double band = 25;     // mm along the line of sight: what has moved further is reported, not given
  bool follow = false;  // each result is the prior of the next push
};

// The prior as planes of disparity at the nodes of the part of the view that shows it.
struct Prior {
  PriorOptions options;
  RectifiedCrop crop;                // of the whole rectification
  double search = 0;                 // px of disparity: how far from the prior is sought
  Grid nodes;                        // of the crop
  MatchField field;                  // a plane a node; reason kNone where there is one
  std::vector<std::uint8_t> inside;  // of each node: it shows a point of the region, not only its surroundings
  std::vector<Cell> cells;
  WarpWork warped;
  Image image;  // the right image as the prior says that the left one sees it
  std::vector<std::uint8_t> mask;
};

// The part of `surface` that lies in `roi` (all of it when NULL) as both cameras see it. Throws kInsufficientData when
// they do not.
Prior make_prior(const Run& run, const Rectification& whole, const Surface& surface, const Roi* roi, int window,
                 const PriorOptions& options);

// Makes prior.image, and masks what of the left image lies beside the region and its surroundings.
void warp_by_prior(const Run& run, const RectifiedImage& right, RectifiedImage& left, Prior& prior);
// From disparities of the left image against the warped one to those against the right one.
void add_prior(const Prior& prior, CoarseMap& coarse);

// What lies beside the region or further from the prior than the band gets its reason.
void hold_against(const Rectification& cropped, const Prior& prior, const Grid& grid, MatchField& field);
// The nodes just found, where they are within the band, are the prior of the next frame.
void follow(const Rectification& cropped, const MatchField& nodes, Prior& prior);

}  // namespace sgrt
