// Arc length: ten Gauss points a polynomial piece, halved until both halves agree with the whole.
#include "nurbs/length.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kNode[5] = {0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845,
                             0.9739065285171717};
constexpr double kWeight[5] = {0.2955242247147529, 0.2692667193099963, 0.2190863625159820, 0.1494513491505806,
                               0.0666713443086881};

double gauss(const NurbsCurve& curve, double a, double b) {
  const double middle = (a + b) / 2, half = (b - a) / 2;
  double sum = 0;
  Vec3 d[2];
  for (int i = 0; i < 5; ++i) {
    for (double side : {-1.0, 1.0}) {
      derivatives(curve, middle + side * half * kNode[i], 1, d);
      sum += kWeight[i] * d[1].norm();
    }
  }
  return sum * half;
}

double adaptive(const NurbsCurve& curve, double a, double b, double whole, double tolerance, int depth) {
  const double middle = (a + b) / 2;
  const double left = gauss(curve, a, middle), right = gauss(curve, middle, b);
  if (depth == 0 || std::abs(left + right - whole) <= tolerance) return left + right;
  return adaptive(curve, a, middle, left, tolerance / 2, depth - 1) +
         adaptive(curve, middle, b, right, tolerance / 2, depth - 1);
}

}  // namespace

double arc_length(const NurbsCurve& curve, double begin, double end) {
  for (double u : {begin, end}) {
    if (!curve.basis.contains(u))
      fail(Status::kInvalidArgument, "begin, end: " + text_of(u) + ", expected in the domain");
  }
  if (end < begin) return -arc_length(curve, end, begin);
  const double size = (curve.points.colwise().maxCoeff() - curve.points.colwise().minCoeff()).norm();
  double total = 0, from = begin;
  for (double u : breaks(curve.basis)) {
    if (u <= begin) continue;
    const double to = std::min(u, end);
    if (to > from) total += adaptive(curve, from, to, gauss(curve, from, to), 1e-14 * size, 30);
    from = to;
  }
  return total;
}

}  // namespace sgrt
