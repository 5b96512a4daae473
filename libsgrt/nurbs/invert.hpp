// The closest point of a curve or surface, globally: branch and bound over the Bezier pieces, whose control points
// enclose them, with Newton's method (The NURBS Book, section 6.1) for the upper bound. docs/theory/nurbs.md,
// "Closest point".
#pragma once

#include <memory>

#include "nurbs/curve.hpp"
#include "nurbs/evaluate.hpp"
#include "nurbs/surface.hpp"

namespace sgrt {

struct ClosestPoint {
  double u, v;  // v: 0 for a curve
  Vec3 point;
  double distance;
  double gap;  // no other point is nearer by more: about 1e-8 of the shape's size, unless the bound on work came first
};

// A shape made ready to be asked; immutable.
class ClosestFinder {
 public:
  explicit ClosestFinder(const NurbsSurface& surface);
  explicit ClosestFinder(const NurbsCurve& curve);
  ~ClosestFinder();
  ClosestPoint operator()(const Vec3& x) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

}  // namespace sgrt
