// The amplitude of a patch. docs/theory/tracking.md section 4.
#include "tracking/breathing.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"
#include "core/median.hpp"
#include "registration/pass.hpp"

namespace sgrt {
namespace {

constexpr double kReach = 40;  // mm: a deep breath lifts the chest by 10 to 20
constexpr std::int64_t kMinSamples = 6;
constexpr double kTukeyEnd = 4.685;
constexpr int kRounds = 4;

}  // namespace

Breathing::Breathing(const Run& run, const Surface& reference, const Roi& patch) {
  direction_.setZero();
  std::int64_t count = 0;
  for (std::int64_t i = 0; i < reference.size(); ++i) {
    if (!contains(patch, reference, i) || !reference.normal(i).allFinite()) continue;
    direction_ += reference.normal(i);
    ++count;
  }
  if (count < kMinSamples) {
    fail(Status::kInsufficientData,
         "gate_roi: " + std::to_string(count) + " points of the reference, expected at least 6");
  }
  require(direction_.norm() > 0.1 * static_cast<double>(count),
          "gate_roi: the patch faces all ways, expected one side of the body");
  direction_.normalize();
  patch_ = prepare_reference(run, reference, &patch);
}

// Distances over the patch with the live points lowered by a, so that they are those of the finest level.
void Breathing::look(const Run& run, const LivePoints& live, double a) {
  const SurfelField& field = patch_->field;
  r_.resize(live.x.size());
  surfel_.resize(live.x.size());
  PassOptions o;
  o.levels = static_cast<int>(field.levels.size());
  o.unit_noise = true;
  o.r = r_.data();
  o.surfel = surfel_.data();
  do_pass(run, field, live, Pose{Mat3::Identity(), -a * direction_}, o);
  samples_.clear();
  for (std::size_t i = 0; i < static_cast<std::size_t>(live.count); ++i) {
    if (surfel_[i] < 0 || !(std::abs(r_[i]) < static_cast<float>(kReach))) continue;
    const kernels::Surfel& s = surfel_of(field, surfel_[i]);
    const double slope = normal_of(s).dot(direction_);
    if (s.counts > 0 && slope > 0.3) samples_.push_back({static_cast<double>(r_[i]), slope});
  }
}

template <class Of>
double Breathing::median(Of&& of) {
  sorted_.clear();
  for (const Sample& s : samples_) sorted_.push_back(of(s));
  return sgrt::median(sorted_);
}

// The shift a along the direction u that explains the distances r_i = a (n_i . u) best: Tukey's weights.
Amplitude Breathing::measure(const Run& run, const LivePoints& live) {
  Amplitude out;
  double a = 0, sigma = 0;
  for (int round = 0; round < kRounds; ++round) {
    look(run, live, a);
    out.points = static_cast<std::int64_t>(samples_.size());
    if (out.points < kMinSamples) return out;
    double d = median([](const Sample& s) { return s.r / s.slope; });
    if (round > 1) {
      const double scale =
          std::max(1e-6, 1.4826 * median([d](const Sample& s) { return std::abs(s.r - d * s.slope); }));
      double sum = 0, information = 0, scatter = 0;
      for (const Sample& s : samples_) {
        const double u = (s.r - d * s.slope) / (kTukeyEnd * scale);
        const double w = u * u < 1 ? (1 - u * u) * (1 - u * u) : 0;
        sum += w * s.r * s.slope;
        information += w * s.slope * s.slope;
        scatter += w * w * s.slope * s.slope * (s.r - d * s.slope) * (s.r - d * s.slope);
      }
      if (!(information > 0)) return out;
      d = sum / information;
      sigma = std::sqrt(scatter) / information;
    }
    a += d;
  }
  out.mm = a;
  out.sigma = sigma;
  return out;
}

}  // namespace sgrt
