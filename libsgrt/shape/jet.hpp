// The shape of a surface near a place: a polynomial height over a tangent disc, fitted to the points in it, and what
// their noise does to it. Degree 2 has circles for normal sections instead of parabolas, which is exact on a sphere
// of any size; degrees 3 and 4 are jets. Cazals and Pouget (2005). docs/theory/curvature.md eq. 11-13.
#pragma once

#include <vector>

#include "core/run.hpp"
#include "shape/cells.hpp"

namespace sgrt {

enum class JetFault : std::uint8_t { kNone, kTooFew, kBorder, kNotASheet };

struct Jet {
  JetFault fault = JetFault::kNone;
  int count = 0;         // points in the disc
  Vec3 normal, e1, e2;   // of the fitted surface at the place; unit, right-handed with the normal
  Vec3 foot;             // on the fitted surface
  double a, b, c;        // curvature tensor on e1, e2, 1/mm, convex positive
  Mat3 covariance;       // of (a, b, c) for points with unit variance of height, 1/mm4
  double foot_variance;  // of the foot along the normal, for unit variance
  double residual;       // mm2, sum of squares about the fit
  int unknowns;

  bool found() const { return fault == JetFault::kNone; }
};

// The curvature tensor in the surface's own axes.
Mat3 tensor_of(const Jet& jet);

// One thread's scratch.
class JetFitter {
 public:
  JetFitter(const Run& run, const Pyramid& pyramid, int degree);
  // At place p with about this normal (outward).
  Jet fit(const Vec3& p, const Vec3& normal, double radius);
  // How far the normals about p agree with the one given: the mean of their cosines with it; 1 where hardly any of them
  // look the other way, as where a thin part is bent.
  double agreement(const Vec3& p, const Vec3& normal, double radius) const;

 private:
  void gather(const Vec3& p, const Mat3& axes, double radius);
  void thin_out();

  const Pyramid& pyramid_;
  int degree_;
  bool avx2_;
  long n_ = 0;
  std::vector<double> u_, v_, w_, one_;
};

constexpr double kLeastDisc[] = {0, 0, 2.2, 2.8, 3.4};  // smallest radius over the points' spacing, by degree

constexpr int unknowns_of(int degree) {
  return (degree + 1) * (degree + 2) / 2;
}

}  // namespace sgrt
