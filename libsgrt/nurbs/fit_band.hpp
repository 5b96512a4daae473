// A symmetric positive definite matrix of small bandwidth: Cholesky factor, solves, determinant, and the entries of its
// inverse that lie in the band. Golub and Van Loan, Matrix Computations, 4.3; Takahashi, Fagan, Chin (1973).
// docs/theory/nurbs_fit.md eq. 9, 10.
#pragma once

#include <vector>

#include "core/run.hpp"

namespace sgrt {

// The lower triangle by columns: entry (i, j), j <= i <= j + width, at j * stride + i - j. What lies below the last row
// is kept at 0, so that loops need no end.
struct Band {
  int size = 0, width = 0, stride = 0;
  std::vector<double> values;

  Band() = default;
  Band(int n, int band_width);
  double& operator()(int i, int j) { return values[static_cast<std::size_t>(j) * stride + (i - j)]; }
  double operator()(int i, int j) const { return values[static_cast<std::size_t>(j) * stride + (i - j)]; }
};

// A = L L^T in place. False, and the matrix spoilt, where it is not positive definite.
bool factorise(const Run& run, Band& A);

// x <- L^-1 x, x <- L^-T x, x <- A^-1 x.
void solve_lower(const Band& L, double* x);
void solve_upper(const Band& L, double* x);
void solve(const Band& L, double* x);

// A x, for the symmetric matrix whose lower triangle is kept.
std::vector<double> multiply(const Band& A, const double* x);

double log_determinant(const Band& L);

// The band of A^-1 from the factor.
Band inverse_band(const Run& run, const Band& L);

}  // namespace sgrt
