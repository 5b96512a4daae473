// Changes of basis as sparse matrices, from blossoms: the control point of function i over knots t is the blossom of
// the old spline at t_i+1 ... t_i+p. Ramshaw (1989); Cohen, Lyche, Riesenfeld (1980) for insertion (the Oslo
// algorithm), which is stable: its terms are not negative. docs/theory/nurbs.md, "Tools".
#pragma once

#include <vector>

#include "nurbs/banded.hpp"
#include "nurbs/basis.hpp"

namespace sgrt {

// Each row of the matrix has `width` entries from column first[row] on.
struct ChangeOfBasis {
  std::vector<int> first;
  Rows entries;
  int columns;

  Rows operator*(const Rows& x) const;
  Rows transposed_times(const Rows& y) const;
};

// From `old` to `to` of the same degree: exact where `to` has every inner knot of `old` inside its own domain.
ChangeOfBasis change_knots(const SplineBasis& old, const SplineBasis& to);

// From clamped `old` to degree + 1 with every knot once more, which is written to *to.
ChangeOfBasis raise_degree(const SplineBasis& old, SplineBasis* to);

// argmin |M x - y| by normal equations, refined once; the first and the last control point are kept from y.
Rows least_squares(const ChangeOfBasis& M, const Rows& y);

}  // namespace sgrt
