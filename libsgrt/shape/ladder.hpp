// Fits of growing radius at one place a cell: a larger disc has less noise and more bias, and how the answer drifts
// from one to the next tells the bias. docs/theory/curvature.md eq. 14.
#pragma once

#include <vector>

#include "core/run.hpp"
#include "shape/curvature.hpp"
#include "shape/grain.hpp"

namespace sgrt {

struct Rung {
  bool found = false;
  Vec3 foot, normal;
  Mat3 tensor;      // 3 x 3, tangential
  double variance;  // of the tensor's squared (Frobenius) norm by noise, 1/mm2
};

struct Ladder {
  std::vector<double> radii;       // mm
  std::size_t chosen = 0;          // so many may be chosen; those beyond are there to tell the drift
  std::vector<std::int32_t> node;  // of a cell; -1 where it is empty
  std::vector<std::int64_t> cell;  // of a node
  std::vector<Vec3> x, normal;     // of a node
  std::vector<char> mixed;         // of a node: normals of both signs in one sheet
  std::vector<Rung> rungs;         // of a node, one a radius

  const Rung* rungs_of(std::size_t i) const { return rungs.data() + i * radii.size(); }
};

Ladder climb_ladders(const Run& run, const Grain& grain, const CurvatureOptions& options);

}  // namespace sgrt
