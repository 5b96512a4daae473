// The radius at which the predicted error of curvature is least, found at one point a cell. docs/theory/curvature.md
// eq. 14-16.
#pragma once

#include <vector>

#include "core/run.hpp"
#include "shape/curvature.hpp"
#include "shape/jet.hpp"

namespace sgrt {

// Heights of the points: variance along the normal, mm2, correlation included.
struct Heights {
  std::vector<double> variance;  // one a row of the surface; empty: `common` for all
  double common = 0;
  double of(std::int32_t row) const { return variance.empty() ? common : variance[static_cast<std::size_t>(row)]; }
};

// What holds in a cell.
struct Node {
  bool found = false;
  bool mixed = false;                       // normals of both signs in one sheet
  Vec3 x, foot, normal;                     // foot: on the fitted surface
  Mat3 tensor;                              // 3 x 3, tangential
  double radius = 0;                        // mm
  double bias2_mean = 0, bias2_tensor = 0;  // squared bias expected of H and of the tensor (Frobenius), 1/mm2
};

struct Scales {
  std::vector<std::int32_t> node;  // of a cell; -1 where it is empty
  std::vector<Node> nodes;
};

Scales choose_scales(const Run& run, const Pyramid& pyramid, double spacing, const CurvatureOptions& options,
                     const Heights& heights);

// Variance of heights as the residuals of small discs show it, mm2. NaN where no disc has points enough.
double measured_variance(const Run& run, const Pyramid& pyramid, double spacing, int degree);

}  // namespace sgrt
