// B-spline basis functions of any degree on any non-decreasing knot vector, clamped or not, and their derivatives.
// Piegl and Tiller, The NURBS Book, A2.1-A2.5 (eq. 10.5-10.10 of the chapter). docs/theory/nurbs.md.
#pragma once

#include <string>
#include <vector>

namespace sgrt {

constexpr int kMaxDegree = 24;
constexpr int kMaxKnots = 1 << 20;
constexpr int kMaxOrder = 24;  // of derivatives

// A space of splines: u_0 <= ... <= u_m, m + 1 = size() + degree + 1.
struct SplineBasis {
  int degree = 1;             // p
  std::vector<double> knots;  // U

  int size() const { return static_cast<int>(knots.size()) - degree - 1; }  // n + 1 functions
  double begin() const { return knots[static_cast<std::size_t>(degree)]; }  // of the domain [u_p, u_n+1]
  double end() const { return knots[static_cast<std::size_t>(size())]; }    // it is closed on both sides
  bool contains(double u) const { return u >= begin() && u <= end(); }      // false for NaN
};

// Throws kInvalidArgument unless the knots fit the degree and `count` control points: their number (the message says
// the required one), finite, not decreasing, an inner multiplicity of at most the degree, at the ends of at most
// degree + 1, a domain that is not empty; kLimit beyond kMaxDegree or kMaxKnots. name: "knots[0]".
void check_basis(const SplineBasis& basis, int count, const std::string& name);

// Knots of `count` functions, clamped on [0, 1], equally spaced inside (eq. 10.9, 10.10).
SplineBasis uniform_basis(int degree, int count);

// A2.1: the k with u_k <= u < u_k+1; the last non-empty span for u = end(). u must lie in the domain.
int find_span(const SplineBasis& basis, double u);

// A2.2: N_{k-p}(u) ... N_k(u), degree + 1 numbers; k = find_span(u). 0/0 := 0.
void basis_functions(const SplineBasis& basis, int k, double u, double* N);

// A2.3: row d is the d-th derivative of what basis_functions gives: (order + 1) x (degree + 1), row-major. Rows beyond
// the degree are 0. At a knot the derivative from the right, at end() from the left.
void basis_derivatives(const SplineBasis& basis, int k, double u, int order, double* ders);

// How often u stands among the knots.
int multiplicity(const SplineBasis& basis, double u);

// The distinct knots of the domain: the borders of its polynomial pieces, begin() and end() included.
std::vector<double> breaks(const SplineBasis& basis);

// The mean of degree successive knots (Greville): where function i is felt most; size() numbers.
std::vector<double> greville(const SplineBasis& basis);

}  // namespace sgrt
