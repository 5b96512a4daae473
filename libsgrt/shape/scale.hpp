// The radius at which the predicted error of curvature is least, found at one point a cell. docs/theory/curvature.md
// eq. 14-16.
#pragma once

#include <vector>

#include "core/run.hpp"
#include "shape/curvature.hpp"
#include "shape/grain.hpp"

namespace sgrt {

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

Scales choose_scales(const Run& run, const Grain& grain, const CurvatureOptions& options);

}  // namespace sgrt
