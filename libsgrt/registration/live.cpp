// See registration/live.hpp.
#include "registration/live.hpp"

#include <algorithm>
#include <cmath>

namespace sgrt {
namespace {

constexpr std::int64_t kLanes = 8;
constexpr float kFarAway = 1e7F;  // mm, where no voxel is
constexpr double kFloor2 = 5e-7;  // mm2: nothing is known better than a micron

void resize(LivePoints& live, std::int64_t n, bool normals, bool variances) {
  live.count = n;
  const auto padded = static_cast<std::size_t>((n + kLanes - 1) / kLanes * kLanes);
  for (std::vector<float>* v : {&live.x, &live.y, &live.z}) {
    v->resize(padded);
    std::fill(v->begin() + n, v->end(), kFarAway);
  }
  for (std::vector<float>* v : {&live.nx, &live.ny, &live.nz}) {
    v->resize(normals ? padded : 0);
    if (normals) std::fill(v->begin() + n, v->end(), 0.0F);
  }
  live.v.resize(variances ? padded : 0);
  if (variances) std::fill(live.v.begin() + n, live.v.end(), 1.0F);
  live.row.resize(static_cast<std::size_t>(n));
}

// A hash of the index (Steele, Lea, Flood 2014), so that no scan order resonates with the step.
std::uint64_t scatter(std::uint64_t i) {
  i = (i ^ (i >> 30)) * 0xBF58476D1CE4E5B9U;
  i = (i ^ (i >> 27)) * 0x94D049BB133111EBU;
  return i ^ (i >> 31);
}

}  // namespace

void read_live(const Surface& s, LivePoints& live) {
  const bool normals = s.has_normals();
  live.centre.setZero();
  std::int64_t n = 0;
  const auto usable = [&](std::int64_t i) { return s.present(i) && (!normals || s.normals(i, 0) == s.normals(i, 0)); };
  for (std::int64_t i = 0; i < s.size(); ++i) {
    if (!usable(i)) continue;
    live.centre += s.point(i);
    ++n;
  }
  if (n > 0) live.centre /= static_cast<double>(n);
  const bool variances = s.sigma.size() > 0 && s.covariance.rows() == 0;
  resize(live, n, normals, variances);
  std::size_t k = 0;
  double sum = 0;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    if (!usable(i)) continue;
    const Vec3 d = s.point(i) - live.centre;
    sum += d.squaredNorm();
    live.x[k] = static_cast<float>(d[0]);
    live.y[k] = static_cast<float>(d[1]);
    live.z[k] = static_cast<float>(d[2]);
    if (normals) {
      live.nx[k] = static_cast<float>(s.normals(i, 0));
      live.ny[k] = static_cast<float>(s.normals(i, 1));
      live.nz[k] = static_cast<float>(s.normals(i, 2));
    }
    if (variances) live.v[k] = static_cast<float>(s.sigma[i] * s.sigma[i] + kFloor2);
    live.row[k++] = static_cast<std::int32_t>(i);
  }
  live.lever = n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
  live.v_all = 1;
}

void draw_subset(const LivePoints& live, std::int64_t wanted, LivePoints& subset) {
  const std::int64_t n = std::min(wanted, live.count);
  resize(subset, n, !live.nx.empty(), !live.v.empty());
  subset.centre = live.centre;
  subset.lever = live.lever;
  subset.v_all = live.v_all;
  for (std::int64_t k = 0; k < n; ++k) {
    const std::int64_t begin = k * live.count / n, end = (k + 1) * live.count / n;
    const auto i =
        static_cast<std::size_t>(begin + static_cast<std::int64_t>(scatter(static_cast<std::uint64_t>(k) + 1) %
                                                                   static_cast<std::uint64_t>(end - begin)));
    const auto to = static_cast<std::size_t>(k);
    subset.x[to] = live.x[i];
    subset.y[to] = live.y[i];
    subset.z[to] = live.z[i];
    if (!live.nx.empty()) {
      subset.nx[to] = live.nx[i];
      subset.ny[to] = live.ny[i];
      subset.nz[to] = live.nz[i];
    }
    if (!live.v.empty()) subset.v[to] = live.v[i];
    subset.row[to] = live.row[i];
  }
}

}  // namespace sgrt
