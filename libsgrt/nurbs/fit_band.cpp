// Banded Cholesky by panels of four columns, and Takahashi's recursion for the inverse. One thread: the same bits
// always.
#include "nurbs/fit_band.hpp"

#include <algorithm>
#include <cmath>

namespace sgrt {
namespace {

constexpr int kPanel = 4;
constexpr int kPollEvery = 64;  // columns

double* column(Band& a, int j) {
  return a.values.data() + static_cast<std::size_t>(j) * a.stride;
}
const double* column(const Band& a, int j) {
  return a.values.data() + static_cast<std::size_t>(j) * a.stride;
}

// Column j of the factor once all columns before it are subtracted. The pivot must keep some of the diagonal's digits.
bool finish_column(Band& a, int j, double diagonal) {
  double* c = column(a, j);
  if (!(c[0] > 1e-14 * diagonal)) return false;
  const double root = std::sqrt(c[0]), scale = 1 / root;
  c[0] = root;
  for (int i = 1; i <= a.width; ++i) c[i] *= scale;
  return true;
}

// Subtracts from column k (k > j) what finished column j says.
void subtract(Band& a, int j, int k) {
  const double* l = column(a, j) + (k - j);
  double* c = column(a, k);
  const double f = l[0];
  const int n = a.width - (k - j) + 1;
  for (int i = 0; i < n; ++i) c[i] -= f * l[i];
}

// The same for the four columns j ... j + 3 at once. Below its band a column is 0, which the stride leaves room for.
void subtract_panel(Band& a, int j, int k) {
  const double* l0 = column(a, j) + (k - j);
  const double* l1 = column(a, j + 1) + (k - j - 1);
  const double* l2 = column(a, j + 2) + (k - j - 2);
  const double* l3 = column(a, j + 3) + (k - j - 3);
  double* __restrict c = column(a, k);
  const double f0 = l0[0], f1 = l1[0], f2 = l2[0], f3 = l3[0];
  const int n = a.width - (k - j - 3) + 1;
  for (int i = 0; i < n; ++i) c[i] -= (f0 * l0[i] + f1 * l1[i]) + (f2 * l2[i] + f3 * l3[i]);
}

}  // namespace

Band::Band(int n, int band_width)
    : size(n),
      width(std::min(band_width, n - 1)),
      stride(width + kPanel),
      values(static_cast<std::size_t>(n + kPanel) * stride, 0.0) {}

bool factorise(const Run& run, Band& a) {
  std::vector<double> diagonal(a.size);
  for (int j = 0; j < a.size; ++j) diagonal[j] = a(j, j);
  for (int j = 0; j < a.size; j += kPanel) {
    if (j % kPollEvery == 0) run.poll(static_cast<double>(j) / a.size, "factorising");
    const int columns = std::min(kPanel, a.size - j);
    for (int p = 0; p < columns; ++p) {
      if (!finish_column(a, j + p, diagonal[j + p])) return false;
      for (int q = p + 1; q < columns; ++q)
        if (q - p <= a.width) subtract(a, j + p, j + q);
    }
    if (columns < kPanel) break;
    const int last = std::min(a.size - 1, j + kPanel - 1 + a.width);
    for (int k = j + kPanel; k <= last; ++k) subtract_panel(a, j, k);
  }
  return true;
}

void solve_lower(const Band& L, double* x) {
  for (int j = 0; j < L.size; ++j) {
    const double* c = column(L, j);
    const int n = std::min(L.width, L.size - 1 - j);
    const double f = x[j] /= c[0];
    for (int i = 1; i <= n; ++i) x[j + i] -= f * c[i];
  }
}

void solve_upper(const Band& L, double* x) {
  for (int j = L.size - 1; j >= 0; --j) {
    const double* c = column(L, j);
    const int n = std::min(L.width, L.size - 1 - j);
    double sum = x[j];
    for (int i = 1; i <= n; ++i) sum -= c[i] * x[j + i];
    x[j] = sum / c[0];
  }
}

void solve(const Band& L, double* x) {
  solve_lower(L, x);
  solve_upper(L, x);
}

std::vector<double> multiply(const Band& a, const double* x) {
  std::vector<double> y(static_cast<std::size_t>(a.size), 0.0);
  for (int j = 0; j < a.size; ++j) {
    const double* c = column(a, j);
    const int n = std::min(a.width, a.size - 1 - j);
    double* __restrict to = y.data() + j;
    double sum = c[0] * x[j];
    for (int i = 1; i <= n; ++i) to[i] += c[i] * x[j], sum += c[i] * x[j + i];
    to[0] += sum;
  }
  return y;
}

double log_determinant(const Band& L) {
  double sum = 0;
  for (int j = 0; j < L.size; ++j) sum += std::log(L(j, j));
  return 2 * sum;
}

// With l_k = L_kj / L_jj: Z_ij = -sum_k Z_ik l_k for i > j, Z_jj = 1 / L_jj^2 - sum_k l_k Z_kj, k = j + 1 ... j +
// width.
Band inverse_band(const Run& run, const Band& L) {
  Band z(L.size, L.width);
  std::vector<double> l(L.width + kPanel), y(L.width + kPanel);
  for (int j = L.size - 1; j >= 0; --j) {
    if (j % kPollEvery == 0) run.poll(1 - static_cast<double>(j) / L.size, "posterior");
    const int n = std::min(L.width, L.size - 1 - j);
    const double* c = column(L, j);
    for (int k = 0; k < n; ++k) l[k] = c[k + 1] / c[0];
    std::fill(y.begin(), y.end(), 0.0);
    for (int k = 0; k < n; ++k) {  // the symmetric window Z(j+1 ..., j+1 ...) times l, by its lower triangle
      const double* zk = column(z, j + 1 + k);
      const double f = l[k];
      const double* __restrict lk = l.data() + k;
      double* __restrict yk = y.data() + k;
      double s0 = zk[0] * f, s1 = 0, s2 = 0, s3 = 0;
      const int m = n - k;
      int i = 1;
      for (; i + 3 < m; i += 4) {
        yk[i] += f * zk[i], yk[i + 1] += f * zk[i + 1], yk[i + 2] += f * zk[i + 2], yk[i + 3] += f * zk[i + 3];
        s0 += zk[i] * lk[i], s1 += zk[i + 1] * lk[i + 1], s2 += zk[i + 2] * lk[i + 2], s3 += zk[i + 3] * lk[i + 3];
      }
      for (; i < m; ++i) yk[i] += f * zk[i], s0 += zk[i] * lk[i];
      yk[0] += (s0 + s1) + (s2 + s3);
    }
    double* zj = column(z, j);
    double diagonal = 1 / (c[0] * c[0]);
    for (int k = 0; k < n; ++k) zj[k + 1] = -y[k], diagonal += l[k] * y[k];
    zj[0] = diagonal;
  }
  return z;
}

}  // namespace sgrt
