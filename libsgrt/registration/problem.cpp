// Preparing both surfaces. docs/theory/icp.md section 1.
#include "registration/problem.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"
#include "surface/local_fit.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kMinPoints = 6;

// The number that interleaves the bits of three cell indices: near points get near numbers (Morton 1966).
std::uint64_t morton(const Vec3& x, const Vec3& origin, double cell) {
  std::uint64_t code = 0;
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::uint64_t>(std::clamp((x[k] - origin[k]) / cell, 0.0, 1023.0));
    for (int bit = 0; bit < 10; ++bit) code |= (at >> bit & 1) << (3 * bit + k);
  }
  return code;
}

// Rows in an order that keeps neighbours together: look-ups then find the tree in the cache, and every k-th row is an
// even subset of the surface however it was scanned.
void sort_in_space(const Surface& s, std::vector<std::int64_t>& rows) {
  Vec3 low = s.point(rows[0]), high = low;
  for (const std::int64_t i : rows) {
    low = low.cwiseMin(s.point(i));
    high = high.cwiseMax(s.point(i));
  }
  const double cell = std::max(1e-9, (high - low).maxCoeff() / 1023);
  std::vector<std::pair<std::uint64_t, std::int64_t>> order;
  order.reserve(rows.size());
  for (const std::int64_t i : rows) order.emplace_back(morton(s.point(i), low, cell), i);
  std::sort(order.begin(), order.end());
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = order[k].second;
}

// The surface itself, or a copy in `storage` with estimated normals.
const Surface& with_normals(const Run& run, const Surface& surface, Surface& storage) {
  if (surface.has_normals()) return surface;
  storage = estimate_normals(run, surface, NormalsOptions{});
  return storage;
}

bool usable(const Surface& s, std::int64_t i) {
  return s.present(i) && s.normals(i, 0) == s.normals(i, 0);
}

void require_points(std::int64_t count, const char* where) {
  if (count >= kMinPoints) return;
  fail(Status::kInsufficientData, std::string(where) + " has " + std::to_string(count) +
                                      " usable points (present, with a normal), at least 6 are needed");
}

bool carries_noise(const Surface& s) {
  return s.sigma.size() > 0 || s.covariance.rows() > 0;
}

double squared_or_zero(double v) {
  return v == v ? v * v : 0;
}

}  // namespace

Problem::Problem(const Run& run, const Surface& reference_in, const Surface& live_in, const Roi* roi)
    : field(make_field(run, with_normals(run, reference_in, estimated_reference))) {
  live = &with_normals(run, live_in, estimated_live);
  signs_unsure = !reference_in.has_normals() || !live_in.has_normals();

  const Surface& r = *field.surface;
  if (roi != nullptr) in_roi.assign(static_cast<std::size_t>(r.size()), 0);
  centre.setZero();
  for (std::int64_t i = 0; i < r.size(); ++i) {
    if (!usable(r, i) || (roi != nullptr && !contains(*roi, r, i))) continue;
    if (roi != nullptr) in_roi[static_cast<std::size_t>(i)] = 1;
    centre += r.point(i);
    ++reference_count;
  }
  require_points(reference_count, roi != nullptr ? "the reference within the roi" : "the reference");
  centre /= static_cast<double>(reference_count);
  double sum2 = 0;
  std::vector<double> reach;
  for (std::int64_t i = 0; i < r.size(); ++i) {
    if (!usable(r, i) || !counts(i)) continue;
    sum2 += (r.point(i) - centre).squaredNorm();
    reach.push_back(field.reach[i]);
  }
  std::nth_element(reach.begin(), reach.begin() + reference_count / 2, reach.end());
  spacing = reach[static_cast<std::size_t>(reference_count / 2)];
  lever = std::max(1e-3, std::sqrt(sum2 / static_cast<double>(reference_count)));

  for (std::int64_t i = 0; i < live->size(); ++i) {
    if (usable(*live, i)) rows.push_back(i);
  }
  require_points(static_cast<std::int64_t>(rows.size()), "the live surface");
  sort_in_space(*live, rows);
  if (!carries_noise(r)) reference_noise2 = squared_or_zero(roughness(run, r, field.nearest));
  if (!carries_noise(*live)) live_noise2 = squared_or_zero(roughness(run, *live, Nearest(live->points)));
}

double Problem::reference_variance(std::int64_t row, const Vec3& n) const {
  return carries_noise(reference()) ? reference().variance_along(row, n) : reference_noise2;
}

double Problem::live_variance(std::int64_t row, const Vec3& n) const {
  return carries_noise(*live) ? live->variance_along(row, n) : live_noise2;
}

}  // namespace sgrt
