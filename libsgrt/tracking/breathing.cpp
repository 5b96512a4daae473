// The amplitude of a patch. docs/theory/tracking.md section 4.
#include "tracking/breathing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kReach = 40;  // mm: a deep breath lifts the chest by 10 to 20
constexpr std::int64_t kMaxSamples = 600;
constexpr std::int64_t kMinSamples = 6;
constexpr double kTukeyEnd = 4.685;

}  // namespace

Breathing::Breathing(const Run& run, const Surface& reference, const Roi& patch)
    : field_(make_field(run, reference)), inside_(static_cast<std::size_t>(reference.size()), 0) {
  direction_.setZero();
  std::int64_t count = 0;
  for (std::int64_t i = 0; i < reference.size(); ++i) {
    if (!contains(patch, reference, i) || !reference.normal(i).allFinite()) continue;
    inside_[static_cast<std::size_t>(i)] = 1;
    direction_ += reference.normal(i);
    low_ = count == 0 ? reference.point(i) : low_.cwiseMin(reference.point(i));
    high_ = count == 0 ? reference.point(i) : high_.cwiseMax(reference.point(i));
    ++count;
  }
  if (count < kMinSamples) {
    fail(Status::kInsufficientData,
         "gate_roi: " + std::to_string(count) + " points of the reference, expected at least 6");
  }
  require(direction_.norm() > 0.1 * static_cast<double>(count),
          "gate_roi: the patch faces all ways, expected one side of the body");
  direction_.normalize();
  low_.array() -= kReach;
  high_.array() += kReach;
}

// The shift a along the direction u that explains the distances r_i = a (n_i . u) best: Tukey's weights, three rounds.
Amplitude Breathing::measure(const Run& run, const Surface& live) {
  rows_.clear();
  for (std::int64_t i = 0; i < live.size(); ++i) {
    const Vec3 x = live.point(i);
    if ((x.array() >= low_.array()).all() && (x.array() <= high_.array()).all()) rows_.push_back(i);
  }
  const auto in_box = static_cast<std::int64_t>(rows_.size());
  const std::int64_t step = std::max<std::int64_t>(1, in_box / kMaxSamples), count = in_box / step;
  samples_.resize(static_cast<std::size_t>(count));
  parallel_for(
      run, count, 256,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          const FieldDistance d = distance_at(field_, live.point(rows_[static_cast<std::size_t>(k * step)]), kReach);
          Sample& s = samples_[static_cast<std::size_t>(k)];
          s.r = std::numeric_limits<double>::quiet_NaN();
          if (d.nearest < 0 || inside_[static_cast<std::size_t>(d.nearest)] == 0) continue;
          s = {d.distance, d.normal.dot(direction_)};
        }
      },
      "breathing");
  samples_.erase(std::remove_if(samples_.begin(), samples_.end(),
                                [](const Sample& s) { return !(std::abs(s.r) < kReach && s.slope > 0.3); }),
                 samples_.end());
  Amplitude out;
  out.points = static_cast<std::int64_t>(samples_.size());
  if (out.points < kMinSamples) return out;
  const auto median = [&](auto&& of) {
    sorted_.clear();
    for (const Sample& s : samples_) sorted_.push_back(of(s));
    const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
    std::nth_element(sorted_.begin(), middle, sorted_.end());
    return *middle;
  };
  double a = median([](const Sample&s) { return s.r / s.slope; }), information = 0, scatter = 0;
  for (int round = 0; round < 3; ++round) {
    const double scale = std::max(1e-6, 1.4826 * median([a](const Sample& s) { return std::abs(s.r - a * s.slope); }));
    double sum = 0;
    information = scatter = 0;
    for (const Sample& s : samples_) {
      const double u = (s.r - a * s.slope) / (kTukeyEnd * scale);
      const double w = u * u < 1 ? (1 - u * u) * (1 - u * u) : 0;
      sum += w * s.r * s.slope;
      information += w * s.slope * s.slope;
      scatter += w * w * s.slope * s.slope * (s.r - a * s.slope) * (s.r - a * s.slope);
    }
    if (!(information > 0)) return out;
    a = sum / information;
  }
  out.mm = a;
  out.sigma = std::sqrt(scatter) / information;
  return out;
}

}  // namespace sgrt
