// The tracker: surfaces in, shifts out. Each frame starts where the motion of the last ones predicts; a patient who is
// lost is looked for where he was last seen, where he was set up and, now and then, anywhere. Time is an input. In the
// steady state a frame allocates nothing. docs/theory/tracking.md.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "registration/icp.hpp"
#include "tracking/beam.hpp"
#include "tracking/breathing.hpp"

namespace sgrt {

struct TrackerOptions {
  Profile profile = Profile::kConventional;
  double tolerance_mm = 0, tolerance_deg = 0;  // 0: the profile's
  double hysteresis = 0.8;
  double resume = 0;                        // s
  double max_gap = 1;                       // s without a frame after which no motion is predicted
  double gate_low = -1.5, gate_high = 1.5;  // mm
  bool gated = false;
  bool search = true;       // look anywhere for a patient who is lost
  double search_every = 1;  // s between two such searches: each takes as long as hundreds of frames
  IcpOptions icp;
};

enum class TrackState : int { kLost = 0, kTracking = 1, kFound = 2 };  // kFound: the first frame after a loss

struct TrackFrame {
  double time;
  std::int64_t index = 0;  // of the frame, from 0
  IcpResult icp;           // its status, verdict, pose and covariance
  TrackState state = TrackState::kLost;
  int attempts = 0;       // starts tried
  bool searched = false;  // anywhere
  bool beam = false;
  int hold = kHoldNoPose;
  PatientDisplacement drift;  // since the first trusted frame
  Amplitude breathing;
};

class Tracker {
 public:
  // patch: of the breathing trace; null: none, and then options.gated must be false.
  Tracker(const Run& run, std::shared_ptr<const Surface> reference, const Vec3& isocentre, const Roi* roi,
          const Roi* patch, const TrackerOptions& options);
  Tracker(Tracker&&) noexcept;
  ~Tracker();

  // live may be null: the cameras had nothing. Throws kInvalidArgument for a time before that of the frame before;
  // after any throw the beam holds.
  const TrackFrame& push(const Run& run, const Surface* live, double time);
  // Another reference, from the next frame on: the motion, the drift and the beam start afresh, the time does not.
  void replace_reference(const Run& run, std::shared_ptr<const Surface> reference, const Roi* roi, const Roi* patch);

  const TrackFrame& last() const { return frame_; }
  const Vec3& isocentre() const { return isocentre_; }
  const TrackerOptions& options() const { return options_; }

 private:
  struct Seen {
    Pose pose;  // reference_from_live
    double time;
  };
  bool align_from(const Run& run, const Surface& live, const Pose& start, double start_error);
  bool search_anywhere(const Run& run, const Surface& live);
  void locate(const Run& run, const Surface& live);
  Pose predicted(double time) const;
  void remember();
  void take(const Run& run, const Surface* live);

  Vec3 isocentre_;
  TrackerOptions options_;
  std::shared_ptr<const Reference> reference_;
  std::unique_ptr<Breathing> breathing_;
  Beam beam_;
  std::optional<Seen> last_, before_;  // trusted frames; `before_` only if the motion between them may be carried on
  std::optional<Pose> start_;          // of the drift
  bool lost_ = false;                  // since the last trusted frame
  std::optional<double> searched_;     // when
  TrackFrame frame_;
  std::unique_ptr<Workspace> work_;
  IcpResult attempt_;
};

}  // namespace sgrt
