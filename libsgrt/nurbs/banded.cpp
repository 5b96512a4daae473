// Gaussian elimination within a band.
#include "nurbs/banded.hpp"

#include <algorithm>
#include <cmath>

namespace sgrt {

using Eigen::Index;

Banded::Banded(Index n, Index lower, Index upper)
    : n_(n),
      lower_(std::min(lower, n - 1)),
      upper_(std::min(upper, n - 1)),
      band_(Rows::Zero(n, lower_ + upper_ + 1)) {}

bool Banded::factor() {
  const Eigen::VectorXd largest = band_.cwiseAbs().rowwise().maxCoeff();
  for (Index k = 0; k < n_; ++k) {
    if (!(std::abs(at(k, k)) > 1e-14 * largest[k])) return false;
    for (Index i = k + 1; i <= std::min(n_ - 1, k + lower_); ++i) {
      const double f = at(i, k) /= at(k, k);
      if (f == 0) continue;
      for (Index j = k + 1; j <= std::min(n_ - 1, k + upper_); ++j) at(i, j) -= f * at(k, j);
    }
  }
  return true;
}

void Banded::solve(Rows& x) const {
  const auto entry = [&](Index i, Index j) { return band_(i, j - i + lower_); };
  for (Index i = 0; i < n_; ++i) {
    for (Index k = std::max<Index>(0, i - lower_); k < i; ++k) x.row(i) -= entry(i, k) * x.row(k);
  }
  for (Index i = n_ - 1; i >= 0; --i) {
    for (Index k = i + 1; k <= std::min(n_ - 1, i + upper_); ++k) x.row(i) -= entry(i, k) * x.row(k);
    x.row(i) /= entry(i, i);
  }
}

}  // namespace sgrt
