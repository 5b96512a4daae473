// What is to be expected of the tensor of a disc: its bias, foretold by how the tensor drifts with the radius about the
// place, and how far that foretelling may err. docs/theory/curvature.md eq. 15-17.
#pragma once

#include <cstddef>

#include "core/eigen.hpp"

namespace sgrt {

constexpr std::size_t kMostDiscs = 16;  // about a place, whose drifts are looked at

// Of the tensor from one radius to the next, the mean of the nodes about a place.
struct Drift {
  Mat3 mean = Mat3::Zero();
  double variance = -1;      // of the mean's squared norm by noise; negative: none is known
  double spread = 0;         // squared, between the nodes beyond noise; may be negative by chance
  double chance = 0;         // sigma of that
  Mat3 own = Mat3::Zero();   // of the node at the place
  double own_variance = -1;  // as variance
};

struct Outlook {
  Mat3 bias = Mat3::Zero();  // of the tensor, to be taken off
  double inflate = 1;        // variance of the tensor less the bias over that of the tensor
  double left2 = 0;          // squared norm of the bias expected to be left
  double mean_part = 0.25;   // of left2: squared bias of H
};

// Of a disc of radius r whose tensor has the variance. drifts: from radii[j] to radii[j + 1], count - 1 of them. Bias
// grows as r^order.
Outlook outlook_of(const Drift* drifts, const double* radii, std::size_t count, int order, double r, double variance);

}  // namespace sgrt
