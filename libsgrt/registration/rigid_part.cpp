// Contacts, consensus, step; then who belongs to it. docs/theory/nonrigid.md section 3.
#include "registration/rigid_part.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kSearches = 4, kSteps = 10;
constexpr double kRest = 2e-3;         // mm, of the farthest patch
constexpr double kTurnLever = 100;     // mm, at which turns are compared with shifts
constexpr double kDifferent = 0.3;     // mm at the isocentre: another motion
constexpr double kBehind = 0.15;       // of the area: agrees that much worse, and is no rival
constexpr double kSignificant2 = 100;  // in the metric of the information

Pose motion_of(const Vec6& xi, const Patches& patches) {
  const Mat3 R = so3_exp(xi.head<3>() / patches.lever);
  return {R, xi.tail<3>() + patches.pivot - R * patches.pivot};
}

// Length of the motion at the isocentre, mm, turns at kTurnLever.
double length_at(const Vec6& xi, const Patches& patches, const Vec3& isocentre) {
  const Vec3 w = xi.head<3>() / patches.lever;
  return std::hypot((xi.tail<3>() + w.cross(isocentre - patches.pivot)).norm(), kTurnLever * w.norm());
}

double farthest(const Vec6& xi, const Patches& patches) {
  double most = 0;
  for (const Vec3& c : patches.centre) {
    most = std::max(most, (xi.head<3>().cross(c - patches.pivot) / patches.lever + xi.tail<3>()).norm());
  }
  return most;
}

std::vector<std::uint8_t> agreeing(const Patches& patches, const Evidence& e, const Vec6& xi) {
  std::vector<std::uint8_t> rigid(patches.size(), 0);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    rigid[p] = e.seen[p] && misfit2(e, p, xi) < kAgrees * kAgrees ? 1 : 0;
  }
  // A lone patch among those that disagree agrees by chance.
  std::vector<std::uint8_t> smooth = rigid;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    std::size_t with = 0, against = 0;
    for (const std::int32_t q : patches.next[p]) {
      if (!e.seen[static_cast<std::size_t>(q)]) continue;
      ++(rigid[static_cast<std::size_t>(q)] ? with : against);
    }
    if (rigid[p] && against > 2 * with) smooth[p] = 0;
  }
  return smooth;
}

double area_of(const Patches& patches, const std::vector<std::uint8_t>& marked) {
  double area = 0;
  for (std::size_t p = 0; p < patches.size(); ++p) area += marked[p] ? patches.area[p] : 0;
  return area;
}

// Of the motions that differ from the answer beyond what noise explains, the one that rivals it most: by the area that
// it alone explains over the area that the answer alone explains. Where both agree nothing speaks for either.
void find_runner_up(const std::vector<Agreement>& found, const Patches& patches, const Evidence& e,
                    const Vec3& isocentre, RigidPart& part) {
  std::vector<double> weights(patches.size(), 0);
  const std::vector<std::uint8_t> rigid = agreeing(patches, e, found[0].xi);
  for (std::size_t p = 0; p < patches.size(); ++p) weights[p] = rigid[p];
  const Mat6 A = information(e, weights, nullptr) / (e.noise * e.noise);
  part.runner_up_rivalry = part.runner_up_share = 0;
  part.runner_up_distance = std::numeric_limits<double>::quiet_NaN();
  for (const Agreement& a : found) {
    const Vec6 d = a.xi - found[0].xi;
    const double length = length_at(d, patches, isocentre);
    if (length < kDifferent || d.dot(A * d) < kSignificant2 || a.score > found[0].score + kBehind) continue;
    const std::vector<std::uint8_t> other = agreeing(patches, e, a.xi);
    double ours = 0, theirs = 0;
    for (std::size_t p = 0; p < patches.size(); ++p) {
      if (rigid[p] && !other[p]) ours += patches.area[p];
      if (other[p] && !rigid[p]) theirs += patches.area[p];
    }
    const double rivalry = theirs / std::max(ours, 1e-9 * e.seen_area);
    if (rivalry <= part.runner_up_rivalry) continue;
    part.runner_up_rivalry = rivalry;
    part.runner_up_share = a.share;
    part.runner_up_distance = length;
  }
}

// Patches that touch a disagreeing one carry the flank of its deformation; leave them out while enough remains.
std::vector<std::uint8_t> without_flanks(const Patches& patches, const Evidence& e,
                                         const std::vector<std::uint8_t>& rigid) {
  std::vector<std::uint8_t> core = rigid;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    for (const std::int32_t q : patches.next[p]) {
      if (e.seen[static_cast<std::size_t>(q)] && !rigid[static_cast<std::size_t>(q)]) core[p] = 0;
    }
  }
  return area_of(patches, core) >= 0.5 * area_of(patches, rigid) ? core : rigid;
}

}  // namespace

RigidPart find_rigid_part(const Run& run, const Field& field, const Patches& patches, const Surface& live,
                          const Vec3& isocentre, const Pose& start, double live_roughness, const IcpOptions& options) {
  RigidPart part;
  part.pose = start;
  const double min_cos = std::cos(options.max_angle_deg * kPi / 180);
  for (int step = 0; step < kSteps; ++step) {
    run.poll(static_cast<double>(step) / kSteps, "rigid part");
    const auto contacts =
        contacts_at(run, field, patches, live, part.pose, options.max_distance, min_cos, live_roughness);
    const Evidence e = evidence_of(patches, sum_patches(patches, contacts), live.correlation_points);
    if (!(e.seen_area > 0)) fail(Status::kNotFound, "the surfaces do not overlap: no part of the region is seen");
    const std::vector<Agreement> found = consensus(patches, e);
    if (step < kSearches) find_runner_up(found, patches, e, isocentre, part);
    part.rigid = agreeing(patches, e, found[0].xi);
    part.core = without_flanks(patches, e, part.rigid);
    part.share = area_of(patches, part.rigid) / e.seen_area;
    part.pose = motion_of(found[0].xi, patches) * part.pose;
    if (step > 0 && farthest(found[0].xi, patches) < kRest) break;
  }
  return part;
}

double structure_of(const Patches& patches, const Evidence& e, const std::vector<std::uint8_t>& marked) {
  double product = 0, variance = 0, count = 0;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    if (!marked[p]) continue;
    const double a = e.sums[p].r / e.sums[p].w;
    for (const std::int32_t q : patches.next[p]) {
      const auto k = static_cast<std::size_t>(q);
      if (k < p || !marked[k]) continue;
      product += a * e.sums[k].r / e.sums[k].w;
      variance += e.variance[p] * e.variance[k];
      count += 1;
    }
  }
  if (count < 3) return 0;
  const double mean = product / count, sigma = std::sqrt(variance) / count;
  return mean > 3 * sigma ? std::sqrt(mean) : 0;
}

Mat6 structure_covariance(const Patches& patches, const Evidence& e, const std::vector<std::uint8_t>& marked,
                          double structure, const Vec3& isocentre) {
  std::vector<double> weights(patches.size());
  for (std::size_t p = 0; p < patches.size(); ++p) weights[p] = marked[p];
  const Mat6 inverse = information(e, weights, nullptr).ldlt().solve(Mat6::Identity());
  Mat6 B = Mat6::Zero();
  for (std::size_t p = 0; p < patches.size(); ++p) {
    if (!marked[p]) continue;
    Vec6 j = e.trust[p] * e.sums[p].j;
    for (const std::int32_t q : patches.next[p]) {
      const auto k = static_cast<std::size_t>(q);
      if (marked[k]) j += e.trust[k] * e.sums[k].j;
    }
    B += structure * structure / (1 + static_cast<double>(patches.next[p].size())) * j * j.transpose();
  }
  Vec6 unit;
  unit << Vec3::Constant(1 / patches.lever), Vec3::Ones();
  const Mat6 to_iso = adjoint(Pose{Mat3::Identity(), patches.pivot - isocentre}) * Mat6(unit.asDiagonal());
  return to_iso * inverse * B * inverse * to_iso.transpose();
}

}  // namespace sgrt
