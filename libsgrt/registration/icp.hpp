// Fine registration: point-to-plane ICP with robust weights, refined with ceres::TinySolver, and its certificate at the
// isocentre. Besl and McKay (1992), Chen and Medioni (1992), Rusinkiewicz (2019). docs/theory/icp.md.
#pragma once

#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/frames.hpp"
#include "core/roi.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "registration/reference.hpp"

namespace sgrt {

struct IcpOptions {
  int max_iterations = 60;
  double max_distance = 40;  // mm
  double max_angle_deg = 45;
  double min_inlier_share = 0.3;
  double step_tolerance = 1e-4;  // mm
  double weak_sigma = 0.5;       // mm; rotations at 100 mm
  double degenerate_sigma = 5;   // mm
};

enum class Verdict : int { kNone = 0, kOk = 1, kWeak = 2 };

struct FreeMotion {
  Vec6 motion;        // (rotation rad, translation mm) at the isocentre, largest entry 1 with rotations at 100 mm
  std::string words;  // "slides along LNG"
};

struct IcpResult {
  Status status = Status::kOk;
  std::string message;  // why there is no pose; "" for kOk
  Verdict verdict = Verdict::kNone;
  std::string verdict_words;
  int iterations = 0;
  std::int64_t pair_count = 0;
  Pose reference_from_live;  // NaN unless kOk, like all numbers below
  Vec3 isocentre;
  PatientDisplacement displacement;
  CouchCorrection correction;
  Mat6 covariance;  // of delta in D_true = D exp(delta) about the isocentre
  std::vector<FreeMotion> free;
  double rms = 0, inlier_share = 0;
  std::int64_t live_height = 0, live_width = 0;
  Eigen::VectorXd distance;  // signed distance map at the pose; NaN without correspondence
  std::vector<std::uint8_t> inlier;
};

// Statuses 10-19 are returned, not thrown, so that the diagnostics are kept.
IcpResult align(const Run& run, const Reference& reference, const Surface& live, const Vec3& isocentre,
                const Pose& initial_reference_from_live, const IcpOptions& options);

// The same, the reference prepared for this once. roi may be null. Statuses 10-19 are returned, not thrown, so that the
// diagnostics are kept.
IcpResult align(const Run& run, const Surface& reference, const Surface& live, const Vec3& isocentre, const Roi* roi,
                const Pose& initial_reference_from_live, const IcpOptions& options);

}  // namespace sgrt
