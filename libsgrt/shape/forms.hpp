// Curvature of a surface at a point from its derivatives: the first and second fundamental forms and what follows from
// them. Lengths mm, curvatures 1/mm, the normal outward, convex positive. do Carmo (1976), ch. 3; Koenderink and van
// Doorn, "Surface shape and curvature scales" (1992). docs/theory/curvature.md eq. 3-7 (the chapter's 10.12-10.17).
#pragma once

#include <cstdint>

#include "core/eigen.hpp"

namespace sgrt {

// Signs of the mean and the Gaussian curvature (fig. 10.7). The numbers are those of SGRT_HK_... in sgrt.h.
enum class HkClass : std::uint8_t {
  kUnknown = 0,
  kFlat = 1,
  kPeak = 2,          // H > 0, K > 0: convex cap
  kPit = 3,           // H < 0, K > 0: concave cup
  kRidge = 4,         // H > 0, K = 0
  kValley = 5,        // H < 0, K = 0
  kSaddleRidge = 6,   // H > 0, K < 0
  kSaddleValley = 7,  // H < 0, K < 0
  kMinimal = 8        // H = 0, K < 0
};

struct Curvature {
  double k1, k2;  // principal, k1 >= k2
  double mean, gauss;
  double shape_index;  // 2/pi atan2(k1 + k2, k1 - k2): +1 a cap, -1 a cup; NaN on a plane
  double curvedness;   // sqrt((k1^2 + k2^2) / 2)
  Vec3 normal;         // unit, outward
  Vec3 d1, d2;         // unit, of k1 and k2; n, d1, d2 right-handed. Any pair at an umbilic
};

double shape_index(double k1, double k2);
double curvedness(double k1, double k2);

// Two axes of the plane across the unit vector n, in rows, right-handed with it.
Eigen::Matrix<double, 2, 3> tangent_plane(const Vec3& n);

// All NaN.
Curvature unknown_curvature();

// d: S_u, S_v, S_uu, S_uv, S_vv. The normal is S_u x S_v. All NaN where that vanishes.
Curvature curvature_of_forms(const Vec3* d);

// k1, k2 and what follows from them, of a tensor [a b; b c] (positive convex) on the unit axes e1, e2 of the tangent
// plane.
Curvature curvature_of_tensor(double a, double b, double c, const Vec3& normal, const Vec3& e1, const Vec3& e2);

// Zero where |H| or |K| does not exceed what is stated.
HkClass hk_class(double mean, double gauss, double mean_zero, double gauss_zero);

}  // namespace sgrt
