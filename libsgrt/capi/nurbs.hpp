// What the skins of NURBS curves and surfaces share: parameters in, directly written outputs.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "capi/capi.hpp"
#include "nurbs/basis.hpp"
#include "nurbs/interpolate.hpp"
#include "nurbs/invert.hpp"

namespace sgrt {

inline std::vector<double> numbers_of(const sgrt_view& view, std::int64_t count) {
  std::vector<double> out(static_cast<std::size_t>(count));
  read_view(view, out.data());
  return out;
}

// A checked view of parameters, as many a point as there are bases; each in its domain, or moved to its end.
inline std::vector<double> parameters_of(const sgrt_view& view, const char* name, const SplineBasis* basis, int sides,
                                         std::int32_t outside) {
  if (outside != SGRT_OUTSIDE_REFUSE && outside != SGRT_OUTSIDE_CLAMP)
    refuse("outside", std::to_string(outside), "SGRT_OUTSIDE_REFUSE (0) or SGRT_OUTSIDE_CLAMP (1)");
  check_limit(view.shape[0], kMaxPoints, name);
  std::vector<double> u = numbers_of(view, view.shape[0] * sides);
  for (std::size_t i = 0; i < u.size(); ++i) {
    const SplineBasis& b = basis[i % static_cast<std::size_t>(sides)];
    if (b.contains(u[i])) continue;
    if (outside == SGRT_OUTSIDE_REFUSE || u[i] != u[i]) {
      const std::string index = std::to_string(i / static_cast<std::size_t>(sides));
      refuse((name + ("[" + index + "]")).c_str(), text_of(u[i]),
             "within the domain, " + text_of(b.begin()) + " to " + text_of(b.end()));
    }
    u[i] = std::clamp(u[i], b.begin(), b.end());
  }
  return u;
}

inline SplineBasis basis_of(const sgrt_view& knots, std::int32_t degree, std::int64_t count, const char* name) {
  const auto n = static_cast<int>(std::min<std::int64_t>(count, kMaxKnots));
  if (absent(&knots)) return uniform_basis(degree, n);
  check_view(&knots, name, Kind::kReal, {kAny});
  check_limit(knots.shape[0], kMaxKnots, name);
  SplineBasis basis{degree, numbers_of(knots, knots.shape[0])};
  check_basis(basis, n, name);
  return basis;
}

inline void check_order(std::int32_t order) {
  if (order < 0 || order > kMaxOrder) refuse("order", std::to_string(order), "0 to " + std::to_string(kMaxOrder));
}

inline Parameters parameters_kind(std::int32_t kind) {
  if (kind < SGRT_PARAMETERS_UNIFORM || kind > SGRT_PARAMETERS_CENTRIPETAL)
    refuse("parameters", std::to_string(kind), "SGRT_PARAMETERS_UNIFORM (0) to SGRT_PARAMETERS_CENTRIPETAL (2)");
  return static_cast<Parameters>(kind);
}

// Runs fill(double*) straight into the caller's memory where that is contiguous. fill must not throw once it has begun
// to write.
template <class Fill>
void fill_output(const sgrt_mut_view& view, Fill&& fill) {
  std::int64_t size = 1;
  bool contiguous = true;
  for (int i = view.ndim - 1; i >= 0; --i) {
    contiguous = contiguous && (view.shape[i] == 1 || view.strides[i] == 8 * size);
    size *= view.shape[i];
  }
  if (contiguous) return fill(static_cast<double*>(view.data));
  std::vector<double> values(static_cast<std::size_t>(size));
  fill(values.data());
  write_view(view, values.data());
}

// The closest points: `sides` parameters a point. Everything is computed before the first output is written.
inline void closest_points(sgrt_context* context, const ClosestFinder& finder, const sgrt_view* points_mm, int sides,
                           const sgrt_mut_view* parameters, const sgrt_mut_view* distance_mm,
                           const sgrt_mut_view* gap_mm) {
  const char* name = sides == 1 ? "u" : "uv";
  const Points points = read_points(points_mm, "points_mm");
  const std::int64_t n = points.rows();
  for (std::int64_t i = 0; i < n; ++i) {
    if (!(points.row(i).cwiseAbs().maxCoeff() <= kMaxCoordinate))
      refuse(("points_mm[" + std::to_string(i) + "]").c_str(), "not finite", "coordinates within 1e5 mm");
  }
  if (!absent(parameters)) {
    if (sides == 1)
      check_output(parameters, name, SGRT_F64, {n});
    else
      check_output(parameters, name, SGRT_F64, {n, 2});
    check_apart(parameters, name, points_mm, "points_mm");
  }
  for (const auto& [view, label] : {std::pair(distance_mm, "distance_mm"), std::pair(gap_mm, "gap_mm")}) {
    if (absent(view)) continue;
    check_output(view, label, SGRT_F64, {n});
    check_apart(view, label, points_mm, "points_mm");
    if (!absent(parameters)) check_apart(view, label, parameters, name);
  }
  if (!absent(distance_mm) && !absent(gap_mm)) check_apart(distance_mm, "distance_mm", gap_mm, "gap_mm");
  const auto count = static_cast<std::size_t>(n);
  std::vector<double> u(count * static_cast<std::size_t>(sides)), distance(count), gap(count);
  parallel_for(
      run_of(context), n, 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto k = static_cast<std::size_t>(i);
          const ClosestPoint c = finder(points.row(i).transpose());
          u[k * static_cast<std::size_t>(sides)] = c.u;
          if (sides == 2) u[2 * k + 1] = c.v;
          distance[k] = c.distance;
          gap[k] = c.gap;
        }
      },
      "closest points");
  if (!absent(parameters)) write_view(*parameters, u.data());
  if (!absent(distance_mm)) write_view(*distance_mm, distance.data());
  if (!absent(gap_mm)) write_view(*gap_mm, gap.data());
}

}  // namespace sgrt
