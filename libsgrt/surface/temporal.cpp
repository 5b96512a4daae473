// A scalar Kalman filter a pixel, and a motion test over patches of all sizes. docs/theory/filters.md eq. 8-10.
#include "surface/temporal.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kLeastHalf = 1, kMostHalf = 31;  // of the patches' sides: 3, 7 ... 63 pixels
constexpr std::int64_t kBlock = 4096;
constexpr double kMinShare = 0.5;  // of a patch that must be seen

void expect(bool ok, const char* name, double value, const char* expected) {
  if (!ok) fail(Status::kInvalidArgument, std::string(name) + " is " + text_of(value) + ", expected " + expected);
}

}  // namespace

TemporalFilter::TemporalFilter(const TemporalOptions& options)
    : options_(options), time_(-std::numeric_limits<double>::infinity()) {
  expect(options.motion_sigmas >= 1 && options.motion_sigmas <= 100, "motion_sigmas", options.motion_sigmas,
         "1 to 100");
  expect(options.drift >= 0 && options.drift <= 1e3, "drift_mm", options.drift, "0 to 1000");
}

void TemporalFilter::check(const Surface& frame, double time) const {
  require(frame.organised(), "frame: it is no organised grid, whose pixels alone can be followed over time");
  require(frame.has_normals(), "frame: it has no normals; estimate them first");
  require(frame.sigma.size() > 0 || frame.covariance.rows() > 0, "frame: it carries neither sigma nor covariance");
  require(std::isfinite(time), "time_s is not finite");
  if (time < time_)
    fail(Status::kInvalidArgument,
         "time_s is " + text_of(time) + ", expected at least that of the push before, " + text_of(time_));
  if (height_ == 0 || (frame.height == height_ && frame.width == width_)) return;
  fail(Status::kInvalidArgument, "frame: a grid of " + std::to_string(frame.height) + " x " +
                                     std::to_string(frame.width) + ", expected that of the push before, " +
                                     std::to_string(height_) + " x " + std::to_string(width_));
}

void TemporalFilter::start(const Surface& frame) {
  if (height_ > 0) return;
  const std::int64_t n = frame.size();
  point_ = normal_ = Points::Constant(n, 3, kNan);
  variance_ = seen_ = measured_ = predicted_ = innovation_ = Eigen::VectorXd::Constant(n, kNan);
  sum_.assign(static_cast<std::size_t>((frame.height + 1) * (frame.width + 1)), 0);
  number_ = sum_;
  state_.resize(static_cast<std::size_t>(n));
  height_ = frame.height;  // last: without memory it has not started
  width_ = frame.width;
}

// eq. 8: how far the new point lies from the expected one, in sigmas.
void TemporalFilter::innovate(const Surface& frame, double time, std::int64_t begin, std::int64_t end) {
  for (std::int64_t i = begin; i < end; ++i) {
    measured_[i] = frame.present(i) ? frame.variance_along(i, frame.normal(i)) : kNan;
    const double wander = options_.drift * options_.drift * (time - seen_[i]);
    predicted_[i] = variance_[i] + wander;
    const Vec3 n = normal_.row(i).transpose();
    innovation_[i] = n.dot(frame.point(i) - point_.row(i).transpose()) / std::sqrt(predicted_[i] + measured_[i]);
  }
}

// Summed-area tables of the innovations and of how many there are.
void TemporalFilter::sum_up() {
  const std::int64_t stride = width_ + 1;
  for (std::int64_t r = 0; r < height_; ++r) {
    double row_sum = 0, row_number = 0;
    for (std::int64_t c = 0; c < width_; ++c) {
      const double z = innovation_[r * width_ + c];
      row_sum += z == z ? z : 0;
      row_number += z == z ? 1 : 0;
      const auto at = static_cast<std::size_t>((r + 1) * stride + c + 1);
      const auto above = at - static_cast<std::size_t>(stride);
      sum_[at] = sum_[above] + row_sum;
      number_[at] = number_[above] + row_number;
    }
  }
}

// eq. 9: a patch whose mean innovation is no noise has moved.
bool TemporalFilter::moved_at(std::int64_t row, std::int64_t column, double correlation) const {
  const double limit2 = options_.motion_sigmas * options_.motion_sigmas;
  const double z = innovation_[row * width_ + column];
  if (z * z > limit2) return true;
  for (std::int64_t half = kLeastHalf; half <= kMostHalf; half = 2 * half + 1) {
    const std::int64_t r0 = std::max<std::int64_t>(0, row - half), r1 = std::min(height_, row + half + 1);
    const std::int64_t c0 = std::max<std::int64_t>(0, column - half), c1 = std::min(width_, column + half + 1);
    const auto over = [&](const std::vector<double>& table) {
      const auto at = [&](std::int64_t r, std::int64_t c) {
        return table[static_cast<std::size_t>(r * (width_ + 1) + c)];
      };
      return at(r1, c1) - at(r0, c1) - at(r1, c0) + at(r0, c0);
    };
    const double sum = over(sum_), number = over(number_);
    if (number < kMinShare * static_cast<double>((r1 - r0) * (c1 - c0))) continue;
    // The sum of n innovations, of which `correlation` share one noise sample, has variance n * correlation.
    if (sum * sum > limit2 * number * std::min(correlation, number)) return true;
  }
  return false;
}

TemporalState TemporalFilter::state_at(const Surface& frame, std::int64_t i) const {
  if (!frame.present(i)) return TemporalState::kAbsent;
  if (!(innovation_[i] == innovation_[i])) return TemporalState::kStarted;
  return moved_at(i / width_, i % width_, frame.correlation_points) ? TemporalState::kMoved : TemporalState::kAveraged;
}

// eq. 10. A point that is started or has moved is the new one as it is.
void TemporalFilter::update(const Surface& frame, double time, std::int64_t i) {
  const TemporalState state = state_[static_cast<std::size_t>(i)] = state_at(frame, i);
  if (state == TemporalState::kAbsent) return;
  Surface& out = *next_;
  seen_[i] = time;
  if (state != TemporalState::kAveraged) {
    point_.row(i) = frame.points.row(i);
    normal_.row(i) = frame.normals.row(i);
    variance_[i] = measured_[i];
    return;
  }
  const double gain = predicted_[i] / (predicted_[i] + measured_[i]);
  point_.row(i) += gain * (frame.points.row(i) - point_.row(i));
  normal_.row(i) = (normal_.row(i) + gain * (frame.normals.row(i) - normal_.row(i))).normalized();
  variance_[i] = gain * measured_[i];
  out.points.row(i) = point_.row(i);
  out.normals.row(i) = normal_.row(i);
  if (out.sigma.size() > 0) out.sigma[i] = std::sqrt(variance_[i]);
  if (out.covariance.rows() > 0) set_variance_along(out, i, frame.normal(i), variance_[i]);
}

const std::shared_ptr<Surface>& TemporalFilter::push(const Run& run, const Surface& frame, double time) {
  check(frame, time);
  run.poll(0, "filtering");
  Run quiet = run;  // from here on nothing is polled: a push is done whole or not at all
  quiet.progress = nullptr;
  start(frame);
  // use_count is relaxed: the fence orders our writes behind the reads of whoever let go last.
  if (!next_ || next_.use_count() > 1) next_ = std::make_shared<Surface>();
  std::atomic_thread_fence(std::memory_order_acquire);
  *next_ = frame;  // the last step that may lack memory
  const auto in_blocks = [&](auto&& body) { parallel_for(quiet, frame.size(), kBlock, body, "filtering"); };
  in_blocks([&](std::int64_t begin, std::int64_t end) { innovate(frame, time, begin, end); });
  sum_up();
  in_blocks([&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) update(frame, time, i);
  });
  count_.fill(0);
  for (const TemporalState state : state_) ++count_[static_cast<std::size_t>(state)];
  time_ = time;
  result_.swap(next_);
  return result_;
}

}  // namespace sgrt
