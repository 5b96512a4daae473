// B-spline basis functions. The NURBS Book, section 2.5.
#include "nurbs/basis.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace sgrt {

namespace {

void check_degree(int p, int count, const std::string& name) {
  if (p < 1) fail(Status::kInvalidArgument, name + ": degree " + std::to_string(p) + ", expected at least 1");
  if (p > kMaxDegree)
    fail(Status::kLimit, name + ": degree " + std::to_string(p) + ", expected at most " + std::to_string(kMaxDegree));
  if (count > kMaxKnots - p - 1)
    fail(Status::kLimit, name + ": " + std::to_string(count) + " control points, too many");
  if (count < p + 1) {
    fail(Status::kInvalidArgument, name + ": " + std::to_string(count) + " control points, expected at least " +
                                       std::to_string(p + 1) + " for degree " + std::to_string(p));
  }
}

}  // namespace

void check_basis(const SplineBasis& basis, int count, const std::string& name) {
  const int p = basis.degree;
  check_degree(p, count, name);
  const std::vector<double>& U = basis.knots;
  const auto required = static_cast<std::size_t>(count + p + 1);
  if (U.size() != required) {
    fail(Status::kInvalidArgument, name + ": " + std::to_string(U.size()) + " knots, expected " +
                                       std::to_string(required) + " for degree " + std::to_string(p) + " and " +
                                       std::to_string(count) + " control points");
  }
  int run = 0;
  for (std::size_t i = 0; i < U.size(); ++i) {
    const std::string at = name + "[" + std::to_string(i) + "]: ";
    if (!(std::abs(U[i]) <= 1e100))
      fail(Status::kInvalidArgument, at + text_of(U[i]) + ", expected a finite number, at most 1e100");
    if (i > 0 && U[i] < U[i - 1])
      fail(Status::kInvalidArgument, at + text_of(U[i]) + " after " + text_of(U[i - 1]) + ", expected no decrease");
    if (i > 0 && U[i] != U[i - 1] && U[i] - U[i - 1] < 1e-100)
      fail(Status::kInvalidArgument, at + text_of(U[i]) + ", expected the same knot or one at least 1e-100 further on");
    run = i > 0 && U[i] == U[i - 1] ? run + 1 : 1;
    const bool inner = U[i] > basis.begin() && U[i] < basis.end();
    if (run > (inner ? p : p + 1))
      fail(Status::kInvalidArgument, at + text_of(U[i]) + " stands " + std::to_string(run) +
                                         " times, expected at most " + std::to_string(inner ? p : p + 1) +
                                         " for degree " + std::to_string(p));
  }
  if (!(basis.begin() < basis.end()))
    fail(Status::kInvalidArgument,
         name + ": an empty domain, from " + text_of(basis.begin()) + " to " + text_of(basis.end()));
}

SplineBasis uniform_basis(int degree, int count) {
  check_degree(degree, count, "knots");
  SplineBasis basis{degree, {}};
  const int spans = count - degree;
  for (int i = 0; i < count + degree + 1; ++i) {
    const int inner = std::clamp(i - degree, 0, spans);
    basis.knots.push_back(static_cast<double>(inner) / spans);
  }
  return basis;
}

int find_span(const SplineBasis& basis, double u) {
  const double* U = basis.knots.data();
  const int p = basis.degree, n = basis.size();
  // The last knot at or below u among those that begin a span of the domain; at the end the last non-empty span.
  int k = static_cast<int>(std::upper_bound(U + p + 1, U + n, u) - U) - 1;
  while (k > p && !(U[k] < U[n])) --k;
  return k;
}

void basis_functions(const SplineBasis& basis, int k, double u, double* N) {
  const double* U = basis.knots.data();
  const int p = basis.degree;
  double left[kMaxDegree + 1], right[kMaxDegree + 1];
  N[0] = 1;
  for (int j = 1; j <= p; ++j) {
    left[j] = u - U[k + 1 - j];
    right[j] = U[k + j] - u;
    double saved = 0;
    for (int r = 0; r < j; ++r) {
      // The denominator spans [u_k, u_k+1], which is not empty: 0/0 never arises here.
      const double t = N[r] / (right[r + 1] + left[j - r]);
      N[r] = saved + right[r + 1] * t;
      saved = left[j - r] * t;
    }
    N[j] = saved;
  }
}

void basis_derivatives(const SplineBasis& basis, int k, double u, int order, double* ders) {
  const double* U = basis.knots.data();
  const int p = basis.degree, width = p + 1;
  double ndu[kMaxDegree + 1][kMaxDegree + 1];  // functions above the diagonal, knot differences below
  double left[kMaxDegree + 1], right[kMaxDegree + 1];
  ndu[0][0] = 1;
  for (int j = 1; j <= p; ++j) {
    left[j] = u - U[k + 1 - j];
    right[j] = U[k + j] - u;
    double saved = 0;
    for (int r = 0; r < j; ++r) {
      ndu[j][r] = right[r + 1] + left[j - r];
      const double t = ndu[r][j - 1] / ndu[j][r];
      ndu[r][j] = saved + right[r + 1] * t;
      saved = left[j - r] * t;
    }
    ndu[j][j] = saved;
  }
  std::fill(ders, ders + (order + 1) * width, 0.0);
  for (int j = 0; j <= p; ++j) ders[j] = ndu[j][p];
  const int most = std::min(order, p);
  for (int r = 0; r <= p; ++r) {
    double a[2][kMaxDegree + 1];  // eq. 2.10, two rows in turn
    int now = 0, next = 1;
    a[0][0] = 1;
    for (int d = 1; d <= most; ++d) {
      double sum = 0;
      const int rk = r - d, pk = p - d;
      if (r >= d) {
        a[next][0] = a[now][0] / ndu[pk + 1][rk];
        sum = a[next][0] * ndu[rk][pk];
      }
      const int first = rk >= -1 ? 1 : -rk, last = r - 1 <= pk ? d - 1 : p - r;
      for (int j = first; j <= last; ++j) {
        a[next][j] = (a[now][j] - a[now][j - 1]) / ndu[pk + 1][rk + j];
        sum += a[next][j] * ndu[rk + j][pk];
      }
      if (r <= pk) {
        a[next][d] = -a[now][d - 1] / ndu[pk + 1][r];
        sum += a[next][d] * ndu[r][pk];
      }
      ders[d * width + r] = sum;
      std::swap(now, next);
    }
  }
  double factor = p;
  for (int d = 1; d <= most; ++d) {
    for (int j = 0; j <= p; ++j) ders[d * width + j] *= factor;
    factor *= p - d;
  }
}

int multiplicity(const SplineBasis& basis, double u) {
  const auto range = std::equal_range(basis.knots.begin(), basis.knots.end(), u);
  return static_cast<int>(range.second - range.first);
}

std::vector<double> breaks(const SplineBasis& basis) {
  std::vector<double> out(basis.knots.begin() + basis.degree, basis.knots.begin() + basis.size() + 1);
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::vector<double> greville(const SplineBasis& basis) {
  std::vector<double> out;
  for (int i = 0; i < basis.size(); ++i) {
    double sum = 0;
    for (int j = 1; j <= basis.degree; ++j) sum += basis.knots[static_cast<std::size_t>(i + j)];
    out.push_back(std::clamp(sum / basis.degree, basis.begin(), basis.end()));
  }
  return out;
}

}  // namespace sgrt
