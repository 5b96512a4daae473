// Blossoms of splines and least squares with their matrices.
#include "nurbs/blossom.hpp"

#include <algorithm>

#include "core/error.hpp"

namespace sgrt {
namespace {

using Eigen::Index;

// A2.2 with an argument of its own at each level: the coefficients of control points k-p ... k in the blossom of the
// piece over [u_k, u_k+1] at x[0] ... x[p-1].
void blossom(const SplineBasis& basis, int k, const double* x, double* N) {
  const double* U = basis.knots.data();
  N[0] = 1;
  for (int j = 1; j <= basis.degree; ++j) {
    double saved = 0;
    for (int r = 0; r < j; ++r) {
      const double high = U[k + r + 1], low = U[k + 1 - j + r], t = N[r] / (high - low);
      N[r] = saved + (high - x[j - 1]) * t;
      saved = (x[j - 1] - low) * t;
    }
    N[j] = saved;
  }
}

// The piece of `old` that function i of `to` is read from: under the first piece of its support.
int piece_of(const SplineBasis& old, const SplineBasis& to, int i) {
  const double u = to.knots[static_cast<std::size_t>(std::clamp(i, to.degree, to.size() - 1))];
  return find_span(old, std::clamp(u, old.begin(), old.end()));
}

}  // namespace

Rows ChangeOfBasis::operator*(const Rows& x) const {
  Rows y(entries.rows(), x.cols());
  for (Index i = 0; i < entries.rows(); ++i) {
    y.row(i).noalias() = entries.row(i) * x.middleRows(first[static_cast<std::size_t>(i)], entries.cols());
  }
  return y;
}

Rows ChangeOfBasis::transposed_times(const Rows& y) const {
  Rows x = Rows::Zero(columns, y.cols());
  for (Index i = 0; i < entries.rows(); ++i) {
    x.middleRows(first[static_cast<std::size_t>(i)], entries.cols()).noalias() += entries.row(i).transpose() * y.row(i);
  }
  return x;
}

ChangeOfBasis change_knots(const SplineBasis& old, const SplineBasis& to) {
  ChangeOfBasis M{{}, Rows(to.size(), old.degree + 1), old.size()};
  for (int i = 0; i < to.size(); ++i) {
    const int k = piece_of(old, to, i);
    M.first.push_back(k - old.degree);
    blossom(old, k, to.knots.data() + i + 1, M.entries.row(i).data());
  }
  return M;
}

ChangeOfBasis raise_degree(const SplineBasis& old, SplineBasis* to) {
  const int p = old.degree;
  *to = SplineBasis{p + 1, {}};
  for (std::size_t i = 0; i < old.knots.size(); ++i) {
    to->knots.push_back(old.knots[i]);
    if (i + 1 == old.knots.size() || old.knots[i + 1] != old.knots[i]) to->knots.push_back(old.knots[i]);
  }
  ChangeOfBasis M{{}, Rows::Zero(to->size(), p + 1), old.size()};
  double x[kMaxDegree + 1], N[kMaxDegree + 1];
  for (int i = 0; i < to->size(); ++i) {
    const int k = piece_of(old, *to, i);
    M.first.push_back(k - p);
    for (int omit = 1; omit <= p + 1; ++omit) {  // the blossom of degree p + 1 is the mean of those of degree p
      int count = 0;
      for (int j = 1; j <= p + 1; ++j) {
        if (j != omit) x[count++] = to->knots[static_cast<std::size_t>(i + j)];
      }
      blossom(old, k, x, N);
      for (int a = 0; a <= p; ++a) M.entries(i, a) += N[a] / (p + 1);
    }
  }
  return M;
}

Rows least_squares(const ChangeOfBasis& M, const Rows& y) {
  const Index n = M.columns, width = M.entries.cols();
  Rows x = Rows::Zero(n, y.cols());
  x.row(0) = y.row(0);
  x.row(n - 1) = y.row(y.rows() - 1);
  Banded normal(n, width - 1, width - 1);
  for (Index i = 0; i < M.entries.rows(); ++i) {
    const int f = M.first[static_cast<std::size_t>(i)];
    for (Index a = 0; a < width; ++a) {
      for (Index b = 0; b < width; ++b) {
        const Index r = f + a, c = f + b;
        if (r > 0 && r < n - 1 && c > 0 && c < n - 1) normal.at(r, c) += M.entries(i, a) * M.entries(i, b);
      }
    }
  }
  normal.at(0, 0) = normal.at(n - 1, n - 1) = 1;
  if (!normal.factor()) fail(Status::kDegenerate, "control points: least squares without a unique solution");
  for (int round = 0; round < 3; ++round) {  // the second and third take the normal equations' rounding away
    Rows step = M.transposed_times(y - M * x);
    step.row(0).setZero();
    step.row(n - 1).setZero();
    normal.solve(step);
    x += step;
  }
  return x;
}

}  // namespace sgrt
