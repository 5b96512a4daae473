// Coarse registration from landmarks: places with an id and a covariance on both bodies. Every triple of pairs of one
// id proposes a motion; the motion that most pairs agree on is fitted by weighted Procrustes, with its covariance, and
// must stand out from every other. Exhaustive, so without luck. docs/theory/coarse.md section 2.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/frames.hpp"
#include "core/run.hpp"
#include "registration/icp.hpp"

namespace sgrt {

struct LandmarkSet {
  Points position;               // mm
  std::vector<std::int32_t> id;  // one may occur more than once: candidates
  std::vector<Mat3> covariance;  // mm2; empty: LandmarkOptions.sigma of each coordinate
  std::int64_t size() const { return position.rows(); }
};

struct LandmarkOptions {
  double sigma = 2;              // mm a coordinate, of landmarks without a covariance
  double min_share = 0.5;        // of the ids that both sides have: fewer that agree are no answer
  double weak_sigma = 5;         // mm; turns at 100 mm
  double degenerate_sigma = 10;  // mm
};

struct LandmarkFit {
  Status status = Status::kOk;
  std::string message;
  Verdict verdict = Verdict::kNone;
  std::string verdict_words;
  std::int64_t common = 0, used = 0, runner_up = 0;  // ids on both sides; that agree; that agree on another motion
  Pose reference_from_live;                          // NaN unless kOk, like all numbers below
  Vec3 isocentre;
  PatientDisplacement displacement;
  CouchCorrection correction;
  Mat6 covariance;           // of delta in D_true = D exp(delta) about the isocentre
  double rms = 0, chi2 = 0;  // mm; reduced
  Eigen::VectorXd distance;  // mm, of each live landmark from its nearest partner at the pose; NaN without one
  std::vector<std::uint8_t> inlier;
};

constexpr std::int64_t kMaxLandmarkPairs = 64;

// Statuses 10-19 are returned, not thrown, so that the diagnostics are kept.
LandmarkFit fit_landmarks(const Run& run, const LandmarkSet& reference, const LandmarkSet& live, const Vec3& isocentre,
                          const LandmarkOptions& options);

}  // namespace sgrt
