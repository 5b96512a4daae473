// Temporal filter: each pixel of an organised grid is a Kalman filter of the point seen there, and starts again where
// the skin has moved. What is absent in a frame stays absent. docs/theory/filters.md.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct TemporalOptions {
  double motion_sigmas = 4;  // of the mean innovation of a patch, beyond which it has moved
  double drift = 0.05;       // mm in a second: how far skin may wander unseen (random walk, one sigma)
};

// The same numbers as SGRT_TEMPORAL_...
enum class TemporalState : std::uint8_t { kAveraged, kAbsent, kStarted, kMoved, kCount };

class TemporalFilter {
 public:
  explicit TemporalFilter(const TemporalOptions& options);

  // frame: organised, with normals and sigma or covariance, always of one size. time: seconds, must not decrease. The
  // answer is this object's own and is written again by the next push, unless somebody else still holds it.
  const std::shared_ptr<Surface>& push(const Run& run, const Surface& frame, double time);

  // Of the last push; nullptr and empty before the first. A state a pixel.
  const std::shared_ptr<Surface>& result() const { return result_; }
  const std::vector<TemporalState>& states() const { return state_; }
  const std::array<std::int64_t, static_cast<std::size_t>(TemporalState::kCount)>& counts() const { return count_; }

 private:
  void check(const Surface& frame, double time) const;
  void start(const Surface& frame);
  void innovate(const Surface& frame, double time, std::int64_t begin, std::int64_t end);
  void sum_up();
  bool moved_at(std::int64_t row, std::int64_t column, double correlation) const;
  TemporalState state_at(const Surface& frame, std::int64_t i) const;
  void update(const Surface& frame, double time, std::int64_t i);

  TemporalOptions options_;
  std::int64_t height_ = 0, width_ = 0;
  double time_;
  // The filter of each pixel; NaN variance: it has seen nothing yet.
  Points point_, normal_;
  Eigen::VectorXd variance_, seen_;  // mm2 along the normal; s
  // Of this push.
  Eigen::VectorXd measured_, predicted_, innovation_;  // mm2, mm2, in sigmas (NaN: none)
  std::vector<double> sum_, number_;                   // summed-area tables
  std::vector<TemporalState> state_;
  std::array<std::int64_t, static_cast<std::size_t>(TemporalState::kCount)> count_{};
  std::shared_ptr<Surface> result_, next_;  // of the last push; memory for the next one
};

}  // namespace sgrt
