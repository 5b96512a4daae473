// The tools, once on nets and then for curves and surfaces.
#include "nurbs/knots.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "nurbs/blossom.hpp"
#include "nurbs/net.hpp"

namespace sgrt {
namespace {

using Eigen::Index;

void check_inside(const SplineBasis& basis, double u, const char* name) {
  if (basis.contains(u)) return;
  fail(Status::kInvalidArgument,
       name + (": " + text_of(u)) + ", expected from " + text_of(basis.begin()) + " to " + text_of(basis.end()));
}

Net with_basis(const Net& net, SplineBasis basis) {
  Rows rows = change_knots(net.basis, basis) * net.rows;
  return {std::move(basis), std::move(rows), net.width};
}

Net refine(const Net& net, const std::vector<double>& knots) {
  SplineBasis basis = net.basis;
  if (knots.size() > static_cast<std::size_t>(kMaxKnots)) fail(Status::kLimit, "knots: too many");
  for (double u : knots) {
    if (!(u > basis.begin() && u < basis.end())) {
      fail(Status::kInvalidArgument, "knots: " + text_of(u) + ", expected inside the domain, between " +
                                         text_of(basis.begin()) + " and " + text_of(basis.end()));
    }
  }
  basis.knots.insert(basis.knots.end(), knots.begin(), knots.end());
  std::sort(basis.knots.begin(), basis.knots.end());
  check_basis(basis, basis.size(), "knots");
  return with_basis(net, std::move(basis));
}

Net restrict_to(const Net& net, double begin, double end) {
  check_inside(net.basis, begin, "begin");
  check_inside(net.basis, end, "end");
  if (!(begin < end)) fail(Status::kInvalidArgument, "begin: " + text_of(begin) + ", expected below end");
  SplineBasis basis{net.basis.degree, {}};
  basis.knots.assign(static_cast<std::size_t>(basis.degree) + 1, begin);
  for (double u : net.basis.knots) {
    if (u > begin && u < end) basis.knots.push_back(u);
  }
  basis.knots.insert(basis.knots.end(), static_cast<std::size_t>(basis.degree) + 1, end);
  return with_basis(net, std::move(basis));
}

Net clamped(const Net& net) {
  return restrict_to(net, net.basis.begin(), net.basis.end());
}

Net to_bezier(const Net& net) {
  Net out = clamped(net);
  std::vector<double> missing;
  const std::vector<double> all = breaks(out.basis);
  for (std::size_t i = 1; i + 1 < all.size(); ++i) {
    missing.insert(missing.end(), static_cast<std::size_t>(out.basis.degree - multiplicity(out.basis, all[i])), all[i]);
  }
  return refine(out, missing);
}

Net elevate(const Net& net, int times) {
  if (times < 1 || times > kMaxDegree - net.basis.degree) {
    fail(Status::kInvalidArgument,
         "times: " + std::to_string(times) + ", expected 1 to " + std::to_string(kMaxDegree - net.basis.degree));
  }
  Net out = clamped(net);
  for (int i = 0; i < times; ++i) {
    Net next{{}, {}, net.width};
    next.rows = raise_degree(out.basis, &next.basis) * out.rows;
    out = std::move(next);
  }
  return out;
}

// How far the shape of `a` can lie from that of `b`, both over one basis: the difference of (A / w) is
// (dA - S dw) / w_b, and every value lies within its control points. Infinite where a weight of b is not above 0.
double bound_between(const Net& a, const Net& b) {
  double worst_point = 0, worst_weight = 0, lowest = 1, farthest = 0;
  if (a.rational()) lowest = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < a.rows.rows(); ++i) {
    for (Index j = 0; j < a.rows.cols(); j += a.width) {
      const auto x = a.rows.row(i).segment(j, a.width), y = b.rows.row(i).segment(j, a.width);
      worst_point = std::max(worst_point, (x - y).head<3>().norm());
      if (!a.rational()) continue;
      worst_weight = std::max(worst_weight, std::abs(x[3] - y[3]));
      lowest = std::min(lowest, y[3]);
      farthest = std::max(farthest, (x.head<3>() / x[3]).norm());
    }
  }
  if (!(lowest > 0)) return std::numeric_limits<double>::infinity();
  return (worst_point + farthest * worst_weight) / lowest;
}

void check_tolerance(double mm) {
  if (!(mm >= 0) || !std::isfinite(mm))
    fail(Status::kInvalidArgument, "tolerance_mm: " + text_of(mm) + ", expected 0 or more");
}

// M leads from the coarser basis to that of `fine`.
Approximated<Net> coarsen(const Net& fine, SplineBasis basis, const ChangeOfBasis& M, int count) {
  Net coarse{std::move(basis), least_squares(M, fine.rows), fine.width};
  const double bound = bound_between(fine, {fine.basis, M * coarse.rows, fine.width});
  return {std::move(coarse), count, bound};
}

Approximated<Net> remove_knot(const Net& net, double u, int times, double tolerance) {
  check_tolerance(tolerance);
  if (times < 1) fail(Status::kInvalidArgument, "times: " + std::to_string(times) + ", expected 1 or more");
  const bool inner = u > net.basis.begin() && u < net.basis.end();
  const int there = inner ? multiplicity(net.basis, u) : 0;
  if (there == 0) fail(Status::kInvalidArgument, "u: " + text_of(u) + ", expected a knot inside the domain");
  const Net fine = clamped(net);
  for (int count = std::min(times, there); count > 0; --count) {
    SplineBasis basis = fine.basis;
    const auto first = std::lower_bound(basis.knots.begin(), basis.knots.end(), u);
    basis.knots.erase(first, first + count);
    const ChangeOfBasis M = change_knots(basis, fine.basis);
    Approximated<Net> out = coarsen(fine, std::move(basis), M, count);
    if (out.bound_mm <= tolerance) return out;
  }
  return {net, 0, 0};
}

// Over the lower degree every knot stands once less, but at least once; its raised basis then holds that of the net.
Approximated<Net> reduce_degree(const Net& net, double tolerance) {
  check_tolerance(tolerance);
  if (net.basis.degree < 2) fail(Status::kInvalidArgument, "degree: 1, expected at least 2 to reduce");
  const Net same = clamped(net);
  SplineBasis low{net.basis.degree - 1, {}}, high;
  for (double u : breaks(same.basis)) {
    const int times = std::min(multiplicity(same.basis, u) - 1, same.basis.degree);
    low.knots.insert(low.knots.end(), static_cast<std::size_t>(std::max(times, 1)), u);
  }
  const ChangeOfBasis M = raise_degree(low, &high);
  Approximated<Net> out = coarsen(with_basis(same, high), std::move(low), M, 1);
  return out.bound_mm <= tolerance ? out : Approximated<Net>{net, 0, 0};
}

Net reparameterise(const Net& net, double begin, double end) {
  if (!std::isfinite(begin) || !std::isfinite(end) || begin == end) {
    fail(Status::kInvalidArgument, "begin, end: " + text_of(begin) + ", " + text_of(end) + ", expected two numbers");
  }
  Net out = net;
  const double from = net.basis.begin(), to = net.basis.end();
  for (double& u : out.basis.knots) {  // both ends exactly
    const double share = (u - from) / (to - from);
    u = share == 1 ? end : begin + (end - begin) * share;
  }
  if (begin < end) return out;
  std::reverse(out.basis.knots.begin(), out.basis.knots.end());
  out.rows = net.rows.colwise().reverse();
  return out;
}

Approximated<NurbsCurve> curve_of(const Approximated<Net>& a) {
  return {curve_of(a.shape), a.count, a.bound_mm};
}
Approximated<NurbsSurface> surface_of(const Approximated<Net>& a, const NurbsSurface& like, int direction) {
  return {surface_of(a.shape, like, direction), a.count, a.bound_mm};
}

}  // namespace

NurbsCurve refine(const NurbsCurve& curve, const std::vector<double>& knots) {
  return curve_of(refine(net_of(curve), knots));
}
NurbsSurface refine(const NurbsSurface& s, int direction, const std::vector<double>& knots) {
  return surface_of(refine(net_of(s, direction), knots), s, direction);
}

NurbsCurve to_bezier(const NurbsCurve& curve) {
  return curve_of(to_bezier(net_of(curve)));
}
NurbsSurface to_bezier(const NurbsSurface& s, int direction) {
  return surface_of(to_bezier(net_of(s, direction)), s, direction);
}

NurbsCurve restrict_to(const NurbsCurve& curve, double begin, double end) {
  return curve_of(restrict_to(net_of(curve), begin, end));
}
NurbsSurface restrict_to(const NurbsSurface& s, int direction, double begin, double end) {
  return surface_of(restrict_to(net_of(s, direction), begin, end), s, direction);
}

NurbsCurve elevate(const NurbsCurve& curve, int times) {
  return curve_of(elevate(net_of(curve), times));
}
NurbsSurface elevate(const NurbsSurface& s, int direction, int times) {
  return surface_of(elevate(net_of(s, direction), times), s, direction);
}

Approximated<NurbsCurve> remove_knot(const NurbsCurve& curve, double u, int times, double tolerance_mm) {
  return curve_of(remove_knot(net_of(curve), u, times, tolerance_mm));
}
Approximated<NurbsSurface> remove_knot(const NurbsSurface& s, int direction, double u, int times, double tolerance_mm) {
  return surface_of(remove_knot(net_of(s, direction), u, times, tolerance_mm), s, direction);
}

Approximated<NurbsCurve> reduce_degree(const NurbsCurve& curve, double tolerance_mm) {
  return curve_of(reduce_degree(net_of(curve), tolerance_mm));
}
Approximated<NurbsSurface> reduce_degree(const NurbsSurface& s, int direction, double tolerance_mm) {
  return surface_of(reduce_degree(net_of(s, direction), tolerance_mm), s, direction);
}

NurbsCurve reparameterise(const NurbsCurve& curve, double begin, double end) {
  return curve_of(reparameterise(net_of(curve), begin, end));
}
NurbsSurface reparameterise(const NurbsSurface& s, int direction, double begin, double end) {
  return surface_of(reparameterise(net_of(s, direction), begin, end), s, direction);
}

}  // namespace sgrt
