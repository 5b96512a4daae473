// The region of interest cut into patches, and what the live points say of each: a least-squares problem of its own in
// the small motion xi = (w, t) about the pivot. Sums over patches then cost nothing. docs/theory/nonrigid.md section 1.
#pragma once

#include <vector>

#include "core/geometry.hpp"
#include "core/roi.hpp"
#include "core/run.hpp"
#include "surface/field.hpp"

namespace sgrt {

struct Patches {
  std::vector<std::int32_t> of;                 // a reference point: its patch; -1 outside the region
  std::vector<Vec3> centre;                     // mm
  std::vector<double> area;                     // mm2, about
  std::vector<double> reference_variance;       // mm2, of the mean height that the reference's own noise makes
  std::vector<std::vector<std::int32_t>> next;  // patches that touch it
  Vec3 pivot;                                   // of the motions: the region's centre
  double lever;                                 // mm, rms distance from it

  std::size_t size() const { return centre.size(); }
};

// About `count` patches of even size. roi may be null. Throws kInsufficientData below 6 points.
Patches make_patches(const Field& field, const Roi* roi, std::int64_t count, double roughness);

// A live point on the reference, at a pose.
struct Contact {
  std::int64_t live;
  std::int32_t patch;
  double r, variance;  // mm, mm2: distance along the normal n and its random variance
  Vec3 y, n;           // the live point moved
};

// Robust scale of r over its own sigma: 1.4826 times the median; 0 where there is no contact.
double robust_sigma(const std::vector<Contact>& contacts);

// For each live point with a correspondence in the region; others are left out. In the live points' order.
std::vector<Contact> contacts_at(const Run& run, const Field& field, const Patches& patches, const Surface& live,
                                 const Pose& reference_from_live, double max_distance, double min_cos,
                                 double live_roughness);

// sum w (r + J xi)^2 of one patch as c + 2 g.xi + xi^T A xi, with J = ((y - pivot) x n, n); turns scaled by 1 / lever.
struct PatchSum {
  Mat6 A = Mat6::Zero();
  Vec6 g = Vec6::Zero(), j = Vec6::Zero();  // sum w J r, sum w J
  double c = 0, r = 0, w = 0;               // sum w r^2, sum w r, sum w
  std::int64_t count = 0;

  double mean(const Vec6& xi) const { return (r + j.dot(xi)) / w; }  // mm, of the patch's heights after xi
};

std::vector<PatchSum> sum_patches(const Patches& patches, const std::vector<Contact>& contacts);

}  // namespace sgrt
