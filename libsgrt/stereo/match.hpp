// From the coarse map to a sub-pixel match at every grid point. A sparse grid of nodes is solved first (dense steps,
// then growth along the surface); the nodes warp the right image once for all windows of the grid; what the warp cannot
// serve, near edges and holes, is refined window by window. docs/theory/stereo.md.
#pragma once

#include "core/run.hpp"
#include "stereo/bend.hpp"
#include "stereo/coarse.hpp"
#include "stereo/dense.hpp"
#include "stereo/epipolar.hpp"
#include "stereo/field.hpp"
#include "stereo/rectified_image.hpp"

namespace sgrt {

// What lies within the reach of a node's window: a hole, perhaps the object's outline; two surfaces.
constexpr std::uint8_t kOutline = 1, kTornEdge = 2;

struct MatchWork {
  Grid nodes;
  MatchField field;  // of the nodes
  std::vector<kernels::RowMatch> fresh;
  std::vector<Cell> cells;
  std::vector<std::uint8_t> near_edge;  // of each node: 0, kOutline or kTornEdge
  WarpWork warp;
  std::vector<std::int64_t> seen;  // left-right: the grid point that each cell of the right image belongs to
  std::vector<float> noise;
  EpipolarWork epipolar_work;
  EpipolarCheck epipolar;
  std::vector<kernels::RowMatch> small;  // of the grid: a smaller window where the surface bends
  std::vector<std::uint8_t> bent;        // of the grid: that it is wanted
  std::vector<float> share;              // of the grid: of the smaller window in the answer
  std::vector<std::uint8_t> sharp;       // of the nodes: those that want a smaller window
  BendingNoise noise_of_small;
  BendingNoise noise_of_bend;  // once `window` is known
  int window = 0;
};

void match_grid(const Run& run, const RectifiedImage& left, const RectifiedImage& right, const CoarseMap& coarse,
                const Grid& grid, const StereoOptions& options, MatchWork& work, MatchField& field);

// The nodes of a rectified left image.
Grid make_nodes(int width, int height, int window);

}  // namespace sgrt
