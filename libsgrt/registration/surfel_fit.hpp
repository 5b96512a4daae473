// One surfel: a quadric fitted to the samples in and round a cell. docs/theory/icp.md section 2.
#pragma once

#include <cstdint>
#include <vector>

#include "core/surface.hpp"
#include "registration/kernels.hpp"
#include "registration/voxels.hpp"

namespace sgrt {

// What one level is fitted to.
struct Cloud {
  Points x;                  // about the centre
  Points normals;            // where known, else zero
  Eigen::VectorXd variance;  // mm2 along the normal; NaN: unknown
  std::vector<float> counts, samples, slope, noise;
  const Surface* surface = nullptr;  // with its rows: where the points have covariances
  std::vector<std::int64_t> rows;
};

// One cell's surfel from the samples in the 5 x 5 x 5 cells about it; reach2 < 0 where there is none.
struct Made {
  kernels::Surfel surfel;
  float samples, slope, noise;
  double residual;
};

// rows: scratch.
Made make_surfel(const Cloud& cloud, const Cells& cells, std::size_t c, double cell, std::vector<std::int32_t>& rows);

}  // namespace sgrt
