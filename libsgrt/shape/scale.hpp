// The radius at which the predicted error of curvature is least, found at one point a cell, and the bias that is then
// foreseen. docs/theory/curvature.md eq. 14-17.
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
  Vec3 foot, normal;                        // foot: on the fitted surface
  Mat3 tensor;                              // 3 x 3, tangential
  double radius = 0;                        // mm
  double variance = 0;                      // of the tensor's squared norm by noise, 1/mm2
  Mat3 rate = Mat3::Zero();                 // bias of the tensor to be taken off, over radius^order
  double inflate = 1;                       // variance of what is left over that of the fit
  double bias2_mean = 0, bias2_tensor = 0;  // squared bias left of H and of the tensor (Frobenius), 1/mm2
};

struct Scales {
  std::vector<std::int32_t> node;  // of a cell; -1 where it is empty
  std::vector<Node> nodes;
  int order = 2;  // of the bias's growth with the radius
};

// At a radius of the caller's own nothing is foreseen.
Scales choose_scales(const Run& run, const Grain& grain, const CurvatureOptions& options);

}  // namespace sgrt
