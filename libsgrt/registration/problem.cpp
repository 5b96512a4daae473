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
  std::int64_t count = 0;
  centre.setZero();
  for (std::int64_t i = 0; i < r.size(); ++i) {
    if (!usable(r, i) || (roi != nullptr && !contains(*roi, r, i))) continue;
    if (roi != nullptr) in_roi[static_cast<std::size_t>(i)] = 1;
    centre += r.point(i);
    ++count;
  }
  require_points(count, roi != nullptr ? "the reference within the roi" : "the reference");
  centre /= static_cast<double>(count);
  double sum2 = 0;
  std::vector<double> reach;
  for (std::int64_t i = 0; i < r.size(); ++i) {
    if (!usable(r, i) || !counts(i)) continue;
    sum2 += (r.point(i) - centre).squaredNorm();
    reach.push_back(field.reach[i]);
  }
  std::nth_element(reach.begin(), reach.begin() + count / 2, reach.end());
  spacing = reach[static_cast<std::size_t>(count / 2)];
  lever = std::max(1e-3, std::sqrt(sum2 / static_cast<double>(count)));

  for (std::int64_t i = 0; i < live->size(); ++i) {
    if (usable(*live, i)) rows.push_back(i);
  }
  require_points(static_cast<std::int64_t>(rows.size()), "the live surface");
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
