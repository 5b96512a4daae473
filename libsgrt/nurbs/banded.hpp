// Banded linear systems without pivoting: the collocation matrices of splines are totally positive and normal matrices
// are positive definite, so none is needed (de Boor and Pinkus 1977).
#pragma once

#include "core/eigen.hpp"

namespace sgrt {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Banded {
 public:
  Banded(Eigen::Index n, Eigen::Index lower, Eigen::Index upper);
  double& at(Eigen::Index i, Eigen::Index j) { return band_(i, j - i + lower_); }  // |j - i| within the band
  // Gauss. false: a pivot is below 1e-14 of its row's largest entry, the system has no unique solution.
  bool factor();
  void solve(Rows& x) const;  // the right sides in, the solutions out

 private:
  Eigen::Index n_, lower_, upper_;
  Rows band_;
};

}  // namespace sgrt
