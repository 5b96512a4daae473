// Which patches moved as one: the motion that most of the area agrees on, sought from many hypotheses of where the body
// changed its shape. Deformations of skin are smooth and small against the noise of a point, so the unit of agreement
// is the mean of a patch and its neighbours, not a point. Graduated weights after Yang et al. (2020).
// docs/theory/nonrigid.md section 2.
#pragma once

#include <vector>

#include "registration/patches.hpp"

namespace sgrt {

// Heights of a patch, alone and with its neighbours, as linear functions of the motion, and their variances.
struct Evidence {
  std::vector<PatchSum> sums;
  std::vector<std::uint8_t> seen;  // enough live points to tell
  std::vector<double> variance;    // mm2, of the patch's mean height
  std::vector<double> trust;       // what share of the patch's weight is not lost to noise that its points share
  struct Pooled {
    double r = 0, variance = 0;
    Vec6 j = Vec6::Zero();
  };
  std::vector<Pooled> pooled;
  double seen_area = 0;
  double noise = 1;  // how many times the expected sigma the points scatter within a patch
};
Evidence evidence_of(const Patches& patches, std::vector<PatchSum> sums, double correlation_points);

// Height of a patch after the motion against its sigma, squared: the larger of its own and its neighbourhood's.
double misfit2(const Evidence& e, std::size_t patch, const Vec6& xi);

struct Agreement {
  Vec6 xi = Vec6::Zero();  // (w lever, t) about the pivot
  double score = 0;        // area that disagrees, graduated; 0 to 1 of the seen area
  double share = 0;        // of the seen area that agrees
};

// Motions at which the weights come to rest, best first.
std::vector<Agreement> consensus(const Patches& patches, const Evidence& evidence);

// The weighted information sum of the patches: xi = -A^-1 g.
Mat6 information(const Evidence& e, const std::vector<double>& weights, Vec6* gradient);

constexpr double kAgrees = 3;  // sigmas

}  // namespace sgrt
