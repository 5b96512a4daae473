// The dense step: warp the right image once by the disparities of a grid of nodes, then one Gauss-Newton step of every
// window from sums over the warped image. docs/theory/stereo.md eq. 12-13.
#pragma once

#include "stereo/field.hpp"
#include "stereo/rectified_image.hpp"

namespace sgrt {

// How the nodes round each cell of their grid hang together; cell (i, j) has node (i, j) at its top left.
enum class Cell : std::uint8_t { kSmooth, kOpen, kTorn };  // four nodes of one surface; some missing; an edge within
void tear(const Grid& nodes, const MatchField& field, std::vector<Cell>& cells);

struct WarpWork {
  std::vector<float> g, d, keep;  // of the left image's shape, rows padded to `stride`
  int stride = 0;
  float origin = 0;
};

// The disparity at every left pixel (bilinear inside a smooth cell, the nearest node's plane elsewhere, none where that
// node has none) and the right image there.
void warp(const Run& run, const RectifiedImage& left, const RectifiedImage& right, const Grid& nodes,
          const MatchField& field, const std::vector<Cell>& cells, WarpWork& work);

// One step of every window of the grid that is wanted (one flag a grid point; nullptr: all); `matches` gets planes, or
// an outcome that says why not.
struct DenseStep {
  int window;
  float min_variance;
  float damping;  // noise_damping
  const std::uint8_t* wanted;
};
void dense_step(const Run& run, const RectifiedImage& left, const WarpWork& warped, const Grid& grid,
                const DenseStep& step, std::vector<kernels::RowMatch>& matches);

}  // namespace sgrt
