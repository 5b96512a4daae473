// Predict, align, judge. docs/theory/tracking.md.
#include "tracking/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "registration/search.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNearStart = 4;  // mm: a predicted start is seldom farther off
constexpr double kMaxCarry = 2;   // a motion is carried on for at most so many times the step in which it was seen

Tolerance tolerance_in(const TrackerOptions& o) {
  const Tolerance t = tolerance_of(o.profile);
  return {o.tolerance_mm > 0 ? o.tolerance_mm : t.mm, o.tolerance_deg > 0 ? o.tolerance_deg : t.deg};
}

BeamOptions beam_options(const TrackerOptions& o) {
  return {tolerance_in(o), o.hysteresis, o.resume, o.gated, {o.gate_low, o.gate_high}};
}

void check(const Vec3& isocentre, const TrackerOptions& o) {
  require(isocentre.allFinite(), "isocentre_mm is not finite");
  const auto refuse_unless = [](bool ok, const char* name, double value, const char* expected) {
    if (!ok) fail(Status::kInvalidArgument, std::string(name) + ": " + text_of(value) + ", expected " + expected);
  };
  refuse_unless(o.tolerance_mm >= 0 && std::isfinite(o.tolerance_mm), "tolerance_mm", o.tolerance_mm, "0 or more");
  refuse_unless(o.tolerance_deg >= 0 && std::isfinite(o.tolerance_deg), "tolerance_deg", o.tolerance_deg, "0 or more");
  refuse_unless(o.hysteresis > 0 && o.hysteresis <= 1, "hysteresis", o.hysteresis, "more than 0, at most 1");
  refuse_unless(o.resume >= 0 && std::isfinite(o.resume), "resume_s", o.resume, "0 or more");
  refuse_unless(o.max_gap > 0, "max_gap_s", o.max_gap, "more than 0");
  refuse_unless(o.search_every >= 0 && std::isfinite(o.search_every), "search_every_s", o.search_every, "0 or more");
  refuse_unless(o.gate_low < o.gate_high, "gate_low_mm", o.gate_low, "less than gate_high_mm");
}

void clear(SixDof& s) {
  s = {kNan, kNan, kNan, kNan, kNan, kNan, kNan};
}

// Everything NaN, the beam on hold.
void blank(TrackFrame& f, const Vec3& isocentre, double time) {
  IcpResult& r = f.icp;
  r.status = Status::kInsufficientData;
  r.verdict = Verdict::kNone;
  r.verdict_words.clear();
  r.message.clear();
  r.iterations = 0;
  r.pair_count = 0;
  r.reference_from_live = {Mat3::Constant(kNan), Vec3::Constant(kNan)};
  r.isocentre = isocentre;
  clear(r.displacement);
  clear(r.correction);
  r.covariance.setConstant(kNan);
  r.random = r.shared = r.covariance;
  r.free.clear();
  r.directions.clear();
  r.rms = r.inlier_share = kNan;
  clear(f.drift);
  f.time = time;
  f.state = TrackState::kLost;
  f.attempts = 0;
  f.searched = false;
  f.beam = false;
  f.hold = kHoldNoPose;
  f.breathing = Amplitude{};
}

double angle_deg(const Mat3& R) {
  return so3_log(R).norm() / kDegree;
}

bool trusted(const IcpResult& r) {
  return r.status == Status::kOk && r.verdict == Verdict::kOk;
}

}  // namespace

Tracker::Tracker(const Run& run, std::shared_ptr<const Surface> reference, const Vec3& isocentre, const Roi* roi,
                 const Roi* patch, const TrackerOptions& options)
    : isocentre_(isocentre), options_(options), beam_(beam_options(options)), work_(std::make_unique<Workspace>()) {
  check(isocentre, options);
  // A pose is good enough for a tolerance when two of its sigmas fit inside.
  options_.icp.weak_sigma = std::min(options_.icp.weak_sigma, 0.5 * tolerance_in(options).mm);
  blank(frame_, isocentre_, -std::numeric_limits<double>::infinity());
  frame_.index = -1;
  replace_reference(run, std::move(reference), roi, patch);
}

Tracker::Tracker(Tracker&&) noexcept = default;
Tracker::~Tracker() = default;

void Tracker::replace_reference(const Run& run, std::shared_ptr<const Surface> reference, const Roi* roi,
                                const Roi* patch) {
  require(!options_.gated || patch != nullptr, "gate_roi: none, expected one because the beam is gated by breathing");
  // All that can fail comes first: a refused reference leaves the old one, but the beam holds in any case.
  beam_.hold(kHoldNoPose);
  frame_.beam = false;
  if (!reference->has_normals()) {
    reference = std::make_shared<const Surface>(estimate_normals(run, *reference, NormalsOptions{}));
  }
  std::unique_ptr<Breathing> breathing;
  if (patch != nullptr) breathing = std::make_unique<Breathing>(run, *reference, *patch);
  reference_ = prepare_reference(run, *reference, roi);
  breathing_ = std::move(breathing);
  beam_ = Beam(beam_options(options_));
  last_.reset();
  before_.reset();
  start_.reset();
  searched_.reset();
  lost_ = false;
}

// The last motion carried on: T_k (T_k-1)^-1 per time, about the isocentre.
Pose Tracker::predicted(double time) const {
  if (!last_) return {};
  if (!before_ || time - last_->time > options_.max_gap) return last_->pose;
  const double step = last_->time - before_->time;
  if (!(step > 0)) return last_->pose;
  const double share = std::min((time - last_->time) / step, kMaxCarry);
  const Pose motion = about(last_->pose * before_->pose.inverse(), isocentre_);
  const Pose carried{so3_exp(share * so3_log(motion.R)), share * motion.t};
  return about(carried, -isocentre_) * last_->pose;
}

bool Tracker::align_from(const Run& run, const Surface& live, const Pose& start, double start_error) {
  ++frame_.attempts;
  align_into(run, *reference_, live, isocentre_, start, start_error, options_.icp, Detail::kPose, *work_, attempt_);
  const bool good = trusted(attempt_);
  // The first attempt tells what is the matter, unless a later one gets further.
  if (frame_.attempts == 1 || good || (attempt_.status == Status::kOk && frame_.icp.status != Status::kOk)) {
    std::swap(frame_.icp, attempt_);
  }
  return good;
}

// Assumes nothing about where the patient is; not more often than search_every.
bool Tracker::search_anywhere(const Run& run, const Surface& live) {
  if (!options_.search || (searched_ && frame_.time - *searched_ < options_.search_every)) return false;
  searched_ = frame_.time;
  frame_.searched = true;
  IcpOptions anywhere = options_.icp;
  anywhere.anywhere = true;
  align_into(run, *reference_, live, isocentre_, Pose{}, kInfinity, anywhere, Detail::kPose, *work_, attempt_);
  if (!trusted(attempt_)) return false;
  std::swap(frame_.icp, attempt_);
  frame_.icp.verdict_words = "ok: found by a search anywhere";
  return true;
}

void Tracker::locate(const Run& run, const Surface& live) {
  if (align_from(run, live, predicted(frame_.time), last_ ? kNearStart : kInfinity)) return;
  if (last_ && align_from(run, live, last_->pose, kInfinity)) return;
  if (last_ && align_from(run, live, Pose{}, kInfinity)) return;
  if (search_anywhere(run, live)) return;
  if (frame_.searched) frame_.icp.verdict_words += "; nor found by a search anywhere";
}

void Tracker::remember() {
  const IcpResult& r = frame_.icp;
  if (!trusted(r)) {
    lost_ = true;
    before_.reset();  // the motion is not known any more
    return;
  }
  const bool jump = lost_ || frame_.searched;
  frame_.state = jump ? TrackState::kFound : TrackState::kTracking;
  before_ = jump ? std::nullopt : last_;
  last_ = Seen{r.reference_from_live, frame_.time};
  lost_ = false;
  if (!start_) start_ = r.reference_from_live;
  // D_now D_start^-1, with D the inverse of the pose: where the patient went since.
  frame_.drift = displacement_of(start_->inverse() * r.reference_from_live, isocentre_);
}

void Tracker::take(const Run& run, const Surface* live) {
  if (live == nullptr) {
    frame_.icp.message = frame_.icp.verdict_words = "no surface: the cameras had nothing";
  } else {
    locate(run, *live);
    if (breathing_) frame_.breathing = breathing_->measure(run, work_->live);
  }
  remember();
  const IcpResult& r = frame_.icp;
  const bool pose = r.status == Status::kOk;
  const double deg = pose ? angle_deg(r.reference_from_live.R) : kNan;
  frame_.beam =
      beam_.take({frame_.time, pose, r.verdict != Verdict::kOk, r.displacement.mag_mm, deg, frame_.breathing.mm});
  frame_.hold = beam_.why();
}

const TrackFrame& Tracker::push(const Run& run, const Surface* live, double time) {
  try {
    if (!std::isfinite(time)) fail(Status::kInvalidArgument, "time_s: " + text_of(time) + ", expected a finite number");
    if (time < frame_.time) {
      fail(Status::kInvalidArgument,
           "time_s: " + text_of(time) + ", expected at least that of the frame before, " + text_of(frame_.time));
    }
    // After a pause nobody knows what happened in it: the beam has to come back as from a hold.
    if (beam_.on() && time - frame_.time > options_.max_gap) beam_.hold(kHoldReturning);
    blank(frame_, isocentre_, time);
    ++frame_.index;
    take(run, live);
  } catch (...) {
    beam_.hold(kHoldNoPose);
    frame_.beam = false;
    frame_.hold = kHoldNoPose;
    throw;
  }
  return frame_;
}

}  // namespace sgrt
