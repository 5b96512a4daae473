// Persistence by union of superlevel sets; crests by comparison across the bend. docs/theory/landmarks.md eq. 1-3.
#include "shape/extrema.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/nearest.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kReach = 2.5;  // of neighbours over the spacing
constexpr std::int64_t kBlock = 1024;

void add_extrema(const CurvatureField& field, const std::vector<std::int32_t>& beside, int sign, double sigmas,
                 std::vector<Extremum>& out) {
  const std::int64_t n = field.mean.size();
  std::vector<std::int32_t> order;
  order.reserve(static_cast<std::size_t>(n));
  for (std::int64_t i = 0; i < n; ++i) {
    if (field.reason[static_cast<std::size_t>(i)] == 0) order.push_back(static_cast<std::int32_t>(i));
  }
  const auto height = [&](std::int32_t i) { return sign * field.mean[i]; };
  std::sort(order.begin(), order.end(),
            [&](std::int32_t a, std::int32_t b) { return height(a) != height(b) ? height(a) > height(b) : a < b; });
  std::vector<std::int32_t> parent(static_cast<std::size_t>(n), -1);
  const auto top = [&](std::int32_t i) {
    while (parent[static_cast<std::size_t>(i)] != i) {
      auto& p = parent[static_cast<std::size_t>(i)];
      p = parent[static_cast<std::size_t>(p)];
      i = p;
    }
    return i;
  };
  const auto report = [&](std::int32_t peak, double saddle) {
    const double persistence = height(peak) - std::max(saddle, 0.0);
    if (height(peak) > 0 && persistence > sigmas * field.sigma_mean[peak]) out.push_back({peak, sign, persistence});
  };
  for (const std::int32_t i : order) {
    parent[static_cast<std::size_t>(i)] = i;
    for (std::size_t k = 0; k < kBeside; ++k) {
      const std::int32_t j = beside[static_cast<std::size_t>(i) * kBeside + k];
      if (j < 0 || j == i || parent[static_cast<std::size_t>(j)] < 0) continue;
      const std::int32_t a = top(i), b = top(j);
      if (a == b) continue;
      const bool a_higher = height(a) != height(b) ? height(a) > height(b) : a < b;
      const std::int32_t low = a_higher ? b : a, high = a_higher ? a : b;
      if (low != i) report(low, height(i));
      parent[static_cast<std::size_t>(low)] = high;
    }
  }
  for (const std::int32_t i : order) {
    if (parent[static_cast<std::size_t>(i)] == i) report(i, 0);
  }
}

}  // namespace

std::vector<std::int32_t> beside_in_sheet(const Run& run, const Surface& surface, const CurvatureField& field) {
  const std::int64_t n = surface.size();
  std::vector<std::int32_t> out(static_cast<std::size_t>(n) * kBeside, -1);
  Points known = surface.points;
  for (std::int64_t i = 0; i < n; ++i) {
    if (field.reason[static_cast<std::size_t>(i)] != 0)
      known.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  const Nearest nearest(run, known);
  parallel_for(
      run, n, kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        Nearest::Hit hits[kBeside];
        for (std::int64_t i = begin; i < end; ++i) {
          if (field.reason[static_cast<std::size_t>(i)] != 0) continue;
          const int count = nearest.neighbours(surface.point(i), kBeside, kReach * field.spacing, hits);
          for (int k = 0; k < count; ++k) {
            // Another sheet is not next to this one, however near.
            if (field.normals.row(i).dot(field.normals.row(hits[k].index)) < 0.3) continue;
            out[static_cast<std::size_t>(i) * kBeside + static_cast<std::size_t>(k)] =
                static_cast<std::int32_t>(hits[k].index);
          }
        }
      },
      "landmarks: neighbours");
  return out;
}

std::vector<Extremum> extrema(const CurvatureField& field, const std::vector<std::int32_t>& beside, double sigmas) {
  std::vector<Extremum> out;
  for (const int sign : {1, -1}) add_extrema(field, beside, sign, sigmas, out);
  std::stable_sort(out.begin(), out.end(),
                   [](const Extremum& a, const Extremum& b) { return a.persistence > b.persistence; });
  return out;
}

std::vector<std::uint8_t> crests(const Run& run, const Surface& surface, const CurvatureField& field,
                                 const std::vector<std::int32_t>& beside, double sigmas) {
  std::vector<std::uint8_t> out(field.reason.size(), 0);
  parallel_for(
      run, surface.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto at = static_cast<std::size_t>(i);
          if (field.reason[at] != 0) continue;
          const bool ridge = field.k1[i] > std::abs(field.k2[i]);
          const double own = ridge ? field.k1[i] : -field.k2[i];
          if (!(own > sigmas * (ridge ? field.sigma_k1[i] : field.sigma_k2[i]))) continue;
          const Vec3 d = (ridge ? field.d1.row(i) : field.d2.row(i)).transpose();
          bool most = true, sides[2] = {false, false};
          for (std::size_t k = 0; k < kBeside && most; ++k) {
            const std::int32_t j = beside[at * kBeside + k];
            if (j < 0 || j == i) continue;
            const Vec3 step = surface.point(j) - surface.point(i);
            const double along = step.dot(d);
            if (std::abs(along) < 0.6 * step.norm()) continue;  // not across the bend
            sides[along > 0] = true;
            most = (ridge ? field.k1[j] : -field.k2[j]) < own;
          }
          if (most && sides[0] && sides[1]) out[at] = static_cast<std::uint8_t>(ridge ? Crest::kRidge : Crest::kValley);
        }
      },
      "crests");
  return out;
}

}  // namespace sgrt
