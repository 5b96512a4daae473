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
#include "registration/residual.hpp"
#include "registration/robust.hpp"

namespace sgrt {

struct IcpOptions {
  int max_iterations = 60;
  double max_distance = 40;  // mm
  double max_angle_deg = 45;
  double min_inlier_share = 0.3;
  double step_tolerance = 1e-4;  // mm
  double weak_sigma = 0.5;       // mm; rotations at 100 mm
  double degenerate_sigma = 5;   // mm
  bool anywhere = false;         // assume nothing about the start: the initial pose is not used
  Residual residual = Residual::kPlane;
  Kernel kernel = Kernel::kAuto;
  double keep_share = 1;  // of the pairs, the nearest: the others are trimmed
};

enum class Verdict : int { kNone = 0, kOk = 1, kWeak = 2 };

struct FreeMotion {
  Vec6 motion;        // (rotation rad, translation mm) at the isocentre, largest entry 1 with rotations at 100 mm
  std::string words;  // "slides along LNG"
};

// An eigenvector of the covariance at the isocentre, turns at 100 mm.
struct Direction {
  Vec6 motion;        // (rotation rad, translation mm); unit length with rotations at 100 mm
  double sigma;       // mm along it
  double detectable;  // mm: the smallest shift that is found 95 times in 100 at a false alarm in 20
  std::string words;
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
  Mat6 covariance;  // of delta in D_true = D exp(delta) about the isocentre; random + shared
  Mat6 random;      // of the live noise: new in every frame
  Mat6 shared;      // what all frames on this reference have in common: its noise, the error modes of both surfaces
  std::vector<FreeMotion> free;
  std::vector<Direction> directions;  // the least certain first
  double chi2 = 0;                    // reduced; 1 where the residuals are as the noise predicts
  double rms = 0, inlier_share = 0;
  double coarse_score, coarse_runner_up;  // of the search without a start; NaN where there was none
  std::int64_t live_height = 0, live_width = 0;
  Eigen::VectorXd distance;  // signed distance map at the pose, mm; NaN without correspondence
  std::vector<std::uint8_t> inlier;
};

// Statuses 10-19 are returned, not thrown, so that the diagnostics are kept.
IcpResult align(const Run& run, const Reference& reference, const Surface& live, const Vec3& isocentre,
                const Pose& initial_reference_from_live, const IcpOptions& options);

// As align, into a result that is used again and again: in the steady state nothing is allocated. start_error: mm, how
// far the start may lie from the answer.
struct Workspace;
enum class Detail { kPose, kAll };  // kAll: with the maps of the live points and the words of the directions
void align_into(const Run& run, const Reference& reference, const Surface& live, const Vec3& isocentre,
                const Pose& initial_reference_from_live, double start_error, const IcpOptions& options, Detail detail,
                Workspace& work, IcpResult& result);

// What the reference promises before anything is seen, as a result without a pose: free motions (kDegenerate), or
// covariance and directions for live points as dense as its own with live_sigma along the normal.
IcpResult promise_of(const Reference& reference, const Vec3& isocentre, double live_sigma);

// The same as align, the reference prepared for this once. roi may be null. Statuses 10-19 are returned, not thrown, so
// that the diagnostics are kept.
IcpResult align(const Run& run, const Surface& reference, const Surface& live, const Vec3& isocentre, const Roi* roi,
                const Pose& initial_reference_from_live, const IcpOptions& options);

}  // namespace sgrt
