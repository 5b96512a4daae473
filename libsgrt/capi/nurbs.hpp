// What the skins of NURBS curves and surfaces share: parameters in, directly written outputs.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "capi/capi.hpp"
#include "core/within.hpp"
#include "nurbs/basis.hpp"
#include "nurbs/interpolate.hpp"
#include "nurbs/invert.hpp"

namespace sgrt {

inline std::vector<double> numbers_of(const sgrt_view& view, std::int64_t count) {
  std::vector<double> out(static_cast<std::size_t>(count));
  read_view(view, out.data());
  return out;
}

// Parameters, `Sides` a point, each in its domain or moved to its end: the caller's own where they are float64 in a row
// and need no moving, else a copy.
template <int Sides>
class ParameterView {
 public:
  ParameterView(const sgrt_view& view, const char* name, const SplineBasis* basis, std::int32_t outside) {
    if (outside != SGRT_OUTSIDE_REFUSE && outside != SGRT_OUTSIDE_CLAMP)
      refuse("outside", std::to_string(outside), "SGRT_OUTSIDE_REFUSE (0) or SGRT_OUTSIDE_CLAMP (1)");
    check_limit(view.shape[0], kMaxPoints, name);
    const std::int64_t n = view.shape[0];
    const bool in_a_row =
        view.dtype == SGRT_F64 && (n <= 1 || view.strides[0] == 8 * Sides) && (Sides == 1 || view.strides[1] == 8);
    if (!in_a_row) copy_ = numbers_of(view, n * Sides);
    data_ = in_a_row ? static_cast<const double*>(view.data) : copy_.data();
    if (inside(n, basis)) return;
    if (in_a_row) copy_ = numbers_of(view, n * Sides);
    for (std::int64_t i = 0; i < n * Sides; ++i) {
      double& u = copy_[static_cast<std::size_t>(i)];
      const SplineBasis& b = basis[i % Sides];
      if (!b.contains(u) && (outside == SGRT_OUTSIDE_REFUSE || u != u))
        refuse((name + ("[" + std::to_string(i / Sides) + "]")).c_str(), text_of(u),
               "within the domain, " + text_of(b.begin()) + " to " + text_of(b.end()));
      u = std::clamp(u, b.begin(), b.end());
    }
    data_ = copy_.data();
  }
  ParameterView(const ParameterView&) = delete;
  ParameterView& operator=(const ParameterView&) = delete;
  const double* data() const { return data_; }

 private:
  bool inside(std::int64_t n, const SplineBasis* basis) const {
    const double low[2] = {basis[0].begin(), basis[Sides - 1].begin()};
    const double high[2] = {basis[0].end(), basis[Sides - 1].end()};
    int all = 1;
    for (std::int64_t i = 0; i < n; ++i)
      for (int s = 0; s < Sides; ++s) all &= (data_[Sides * i + s] >= low[s]) & (data_[Sides * i + s] <= high[s]);
    return all != 0;
  }

  std::vector<double> copy_;
  const double* data_ = nullptr;
};

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
    if (!within(points.row(i), kMaxCoordinate))
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
