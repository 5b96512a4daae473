// Patches and their sums. docs/theory/nonrigid.md section 1.
#include "registration/patches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.hpp"
#include "core/median.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kFloor2 = 1e-6;  // mm2: nothing is known better than a micron

// Farthest points first, from the one nearest to the centre: even, and the same on every machine (Gonzalez 1985).
std::vector<std::int64_t> spread(const Surface& s, const std::vector<std::int64_t>& rows, const Vec3& centre,
                                 std::int64_t count, std::vector<std::int32_t>& of) {
  std::vector<double> distance2(rows.size(), std::numeric_limits<double>::infinity());
  std::vector<std::int64_t> seeds;
  std::size_t next = 0;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    if ((s.point(rows[k]) - centre).squaredNorm() < (s.point(rows[next]) - centre).squaredNorm()) next = k;
  }
  while (static_cast<std::int64_t>(seeds.size()) < count && distance2[next] > 0) {
    const auto patch = static_cast<std::int32_t>(seeds.size());
    const Vec3 seed = s.point(rows[next]);
    seeds.push_back(rows[next]);
    std::size_t farthest = 0;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const double d2 = (s.point(rows[k]) - seed).squaredNorm();
      if (d2 < distance2[k]) {
        distance2[k] = d2;
        of[static_cast<std::size_t>(rows[k])] = patch;
      }
      if (distance2[k] > distance2[farthest]) farthest = k;
    }
    next = farthest;
  }
  return seeds;
}

void link(const Field& field, const std::vector<std::int64_t>& rows, Patches& p) {
  for (const std::int64_t i : rows) {
    const std::int32_t a = p.of[static_cast<std::size_t>(i)];
    for (const std::int32_t j : field.ring.row(i)) {
      if (j < 0) continue;
      const std::int32_t b = p.of[static_cast<std::size_t>(j)];
      if (b < 0 || b == a) continue;
      p.next[static_cast<std::size_t>(a)].push_back(b);
      p.next[static_cast<std::size_t>(b)].push_back(a);
    }
  }
  for (auto& next : p.next) {
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
  }
}

}  // namespace

Patches make_patches(const Field& field, const Roi* roi, std::int64_t count, double roughness) {
  const Surface& s = *field.surface;
  Patches p;
  p.of.assign(static_cast<std::size_t>(s.size()), -1);
  std::vector<std::int64_t> rows;
  p.pivot.setZero();
  for (std::int64_t i = 0; i < s.size(); ++i) {
    if (!s.present(i) || !(s.normals(i, 0) == s.normals(i, 0)) || (roi != nullptr && !contains(*roi, s, i))) continue;
    rows.push_back(i);
    p.pivot += s.point(i);
  }
  if (rows.size() < 6) {
    fail(Status::kInsufficientData, "the reference" + std::string(roi != nullptr ? " within the roi" : "") + " has " +
                                        std::to_string(rows.size()) + " usable points, at least 6 are needed");
  }
  p.pivot /= static_cast<double>(rows.size());
  double sum2 = 0;
  for (const std::int64_t i : rows) sum2 += (s.point(i) - p.pivot).squaredNorm();
  p.lever = std::max(1e-3, std::sqrt(sum2 / static_cast<double>(rows.size())));

  const std::size_t n = spread(s, rows, p.pivot, count, p.of).size();
  p.centre.assign(n, Vec3::Zero());
  p.area.assign(n, 0);
  p.reference_variance.assign(n, 0);
  p.next.resize(n);
  std::vector<double> members(n, 0);
  for (const std::int64_t i : rows) {
    const auto k = static_cast<std::size_t>(p.of[static_cast<std::size_t>(i)]);
    p.centre[k] += s.point(i);
    p.area[k] += field.reach[i] * field.reach[i];  // each point stands for a share of its surroundings
    const double variance = s.variance_along(i, s.normal(i));
    p.reference_variance[k] += variance == variance ? variance : roughness * roughness;
    members[k] += 1;
  }
  for (std::size_t k = 0; k < n; ++k) {
    p.centre[k] /= members[k];
    p.reference_variance[k] *= s.correlation_points / (members[k] * members[k]);
  }
  link(field, rows, p);
  return p;
}

std::vector<Contact> contacts_at(const Run& run, const Field& field, const Patches& patches, const Surface& live,
                                 const Pose& T, double max_distance, double min_cos, double live_roughness) {
  std::vector<Contact> all(static_cast<std::size_t>(live.size()));
  parallel_for(
      run, live.size(), 512,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          Contact& c = all[static_cast<std::size_t>(i)];
          c.patch = -1;
          if (!live.present(i)) continue;
          c.y = T * live.point(i);
          const FieldDistance d = distance_at(field, c.y, max_distance);
          if (d.nearest < 0) continue;
          if (live.has_normals() && !(d.normal.dot(T.R * live.normal(i)) >= min_cos)) continue;
          c.live = i;
          c.r = d.distance;
          c.n = d.normal;
          const double variance = live.variance_along(i, T.R.transpose() * d.normal);
          c.variance = (variance == variance ? variance : live_roughness * live_roughness) + kFloor2;
          c.patch = patches.of[static_cast<std::size_t>(d.nearest)];
        }
      },
      "contacts");
  all.erase(std::remove_if(all.begin(), all.end(), [](const Contact& c) { return c.patch < 0; }), all.end());
  return all;
}

std::vector<PatchSum> sum_patches(const Patches& patches, const std::vector<Contact>& contacts) {
  std::vector<PatchSum> sums(patches.size());
  for (const Contact& c : contacts) {
    PatchSum& s = sums[static_cast<std::size_t>(c.patch)];
    const double w = 1 / c.variance;
    Vec6 j;
    j << (c.y - patches.pivot).cross(c.n) / patches.lever, c.n;
    s.A.noalias() += w * j * j.transpose();
    s.g += w * c.r * j;
    s.j += w * j;
    s.c += w * c.r * c.r;
    s.r += w * c.r;
    s.w += w;
    ++s.count;
  }
  return sums;
}

double robust_sigma(const std::vector<Contact>& contacts) {
  if (contacts.empty()) return 0;
  std::vector<double> u;
  u.reserve(contacts.size());
  for (const Contact& c : contacts) u.push_back(std::abs(c.r) / std::sqrt(c.variance));
  return 1.4826 * median(u);
}

}  // namespace sgrt
