// Time of flight, see tof/tof.hpp. Equations of docs/theory/tof.md; Buettgen and Seitz (2008), Lange (2000).
#include "tof/tof.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/parallel.hpp"
#include "rig/tof_unit.hpp"
#include "tof/check.hpp"
#include "tof/correct.hpp"
#include "tof/kernels.hpp"
#include "tof/organise.hpp"
#include "tof/summary.hpp"
#include "tof/taps.hpp"
#include "tof/unwrap.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSpeed = 299'792'458e3, kChapterSpeed = 3e11;  // mm/s
constexpr int kRows = 8;                                        // of a block
constexpr double kJumpSigmas = 1.8;                             // of each of two neighbours: 2.5 of their difference

Planes rays_of(const Run& run, const Camera& camera) {
  Planes rays;
  rays.resize(3, static_cast<std::int64_t>(camera.width) * camera.height);
  parallel_for(
      run, camera.height, kRows,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t y = begin; y < end; ++y) {
          for (int x = 0; x < camera.width; ++x) {
            const Vec3 ray = unproject(camera, Vec2(x, static_cast<double>(y)));
            for (int i = 0; i < 3; ++i) rays.plane(i)[y * camera.width + x] = static_cast<float>(ray[i]);
          }
        }
      },
      "rays");
  return rays;
}

struct Kernels {
  void (*phasor)(const kernels::PhasorRow*);
  void (*range)(const kernels::RangeRow*);
  void (*judge)(const kernels::JudgeRow*);
  void (*points)(const kernels::PointsRow*);
};
Kernels kernels_of(Isa isa) {
  using namespace kernels;
  if (isa == Isa::kAvx2) return {phasor_row_avx2, range_row_avx2, judge_row_avx2, points_row_avx2};
  return {phasor_row_baseline, range_row_baseline, judge_row_baseline, points_row_baseline};
}

}  // namespace

void Planes::resize(std::int64_t count, std::int64_t size) {
  count_ = count;
  stride_ = size + kMargin;
  values_.resize(static_cast<std::size_t>(kMargin + count * stride_ + kMargin));
}

struct TofSensor::Impl {
  TofUnit unit;
  Camera camera;
  Vec3 centre;
  TofOptions options;
  std::vector<float> pixel_offset;
  Planes rays, reach;
  Correction range_correction, amplitude_correction;
  Unwrapper unwrapper;
  double ambiguity = 0, jump_slope = 0;  // mm; half of what a neighbour may differ by, mm a mm of range
  TapModel model;
  TapsView::Type model_type = TapsView::Type::kU16;
  std::vector<double> sigmas;
  std::shared_ptr<TofResult> result;

  void set_frequencies();
  void prepare(const TapsView& taps);
  void measure_rows(const TapsView& taps, const Kernels& kernels, std::int64_t begin, std::int64_t end);
  void range_row(const Kernels& kernels, std::int64_t at, const float* variance, std::int64_t stride);
  void correct_row(std::int64_t at);
  void point_row(const Kernels& kernels, std::int64_t y);
};

void TofSensor::Impl::set_frequencies() {
  const double speed = options.chapter_c ? kChapterSpeed : kSpeed / unit.refractive_index;
  Unwrapper& u = unwrapper;
  u.frequencies = static_cast<int>(unit.modulation_hz.size());
  for (int i = 0; i < u.frequencies; ++i) {
    u.mm_per_rad[i] = speed / (4 * kPi * unit.modulation_hz[static_cast<std::size_t>(i)]);  // eq. 10.2
    u.ambiguity[i] = 2 * kPi * u.mm_per_rad[i];
  }
  ambiguity = joint_ambiguity(unit.modulation_hz, speed);
  u.low = options.range_min;
  u.high = options.range_max == options.range_max ? options.range_max : std::min(u.low + ambiguity, kMaxCoordinate);
  u.tolerance = options.unwrap_tolerance;
  u.unknown_sigma = 0.05;
}

void TofSensor::Impl::prepare(const TapsView& taps) {
  if (model.taps == 0 || model_type != taps.type) {
    model = make_tap_model(unit, taps.type != TapsView::Type::kF32);
    model_type = taps.type;
  }
  // use_count is relaxed: the fence orders our writes behind the reads of whoever let go last.
  if (!result || result.use_count() > 1) result = std::make_shared<TofResult>();
  std::atomic_thread_fence(std::memory_order_acquire);
  TofResult& r = *result;
  const std::int64_t n = static_cast<std::int64_t>(camera.width) * camera.height;
  r.width = camera.width, r.height = camera.height, r.frequencies = unwrapper.frequencies;
  for (Planes* planes : {&r.phase, &r.amplitude, &r.offset}) planes->resize(r.frequencies, n);
  for (Planes* planes : {&r.range, &r.sigma, &reach}) planes->resize(1, n);
  r.score.resize(r.frequencies > 1 ? 1 : 0, n);
  r.frames.resize(taps.shape[0] > 1 ? 1 : 0, n);
  r.points.resize(3, n);
  r.flags.assign(static_cast<std::size_t>(n) + 8, 0);
  r.range_min = unwrapper.low, r.range_max = unwrapper.high, r.ambiguity = ambiguity;
}

// Phase to range: one frequency by a kernel, several pixel by pixel.
void TofSensor::Impl::range_row(const Kernels& kernels, std::int64_t at, const float* variance, std::int64_t stride) {
  TofResult& r = *result;
  if (r.frequencies == 1) {
    kernels::RangeRow row{};
    row.phase = r.phase.plane(0) + at, row.amplitude = r.amplitude.plane(0) + at, row.variance = variance;
    row.count = r.width;
    row.mm_per_rad = static_cast<float>(unwrapper.mm_per_rad[0]);
    row.ambiguity = static_cast<float>(unwrapper.ambiguity[0]);
    row.low = static_cast<float>(unwrapper.low), row.high = static_cast<float>(unwrapper.high);
    row.range = r.range.plane(0) + at, row.sigma = r.sigma.plane(0) + at;
    return kernels.range(&row);
  }
  // Frequencies that disagree by a chance of 5 sigma, tolerance included, have no range in the window.
  const double misfit_limit = 25 + 3 * (r.frequencies - 2);
  for (int x = 0; x < r.width; ++x) {
    double phase[kMostFrequencies], v[kMostFrequencies];
    for (int f = 0; f < r.frequencies; ++f) {
      phase[f] = r.phase.plane(f)[at + x];
      v[f] = variance[f * stride + x];
    }
    const Unwrapped d = unwrap(unwrapper, phase, v);
    r.range.plane(0)[at + x] = static_cast<float>(d.range);
    r.sigma.plane(0)[at + x] = static_cast<float>(d.sigma);
    r.score.plane(0)[at + x] = static_cast<float>(d.score);
    if (d.score < options.min_unwrap_score || d.misfit > misfit_limit)
      r.flags[static_cast<std::size_t>(at + x)] |= kernels::kWrapped;
  }
}

void TofSensor::Impl::correct_row(std::int64_t at) {
  TofResult& r = *result;
  if (range_correction.empty() && amplitude_correction.empty() && pixel_offset.empty()) return;
  float* range = r.range.plane(0) + at;
  for (int x = 0; x < r.width; ++x) {
    float error = 0;
    if (!range_correction.empty()) {
      error += range_correction.at(range[x]);
      if (!range_correction.covers(range[x])) r.flags[static_cast<std::size_t>(at + x)] |= kernels::kUncalibrated;
    }
    if (!amplitude_correction.empty()) error += amplitude_correction.at(r.amplitude.plane(0)[at + x]);
    if (!pixel_offset.empty()) error += pixel_offset[static_cast<std::size_t>(at + x)];
    range[x] -= error;
  }
}

void TofSensor::Impl::measure_rows(const TapsView& taps, const Kernels& kernels, std::int64_t begin, std::int64_t end) {
  TofResult& r = *result;
  const int stride = (r.width + 15) / 8 * 8, rows = r.frequencies * model.taps;
  std::vector<float> scratch(static_cast<std::size_t>(stride) * static_cast<std::size_t>(rows + r.frequencies + 2),
                             1.F);
  float *variance = scratch.data() + rows * stride, *share = variance + r.frequencies * stride, *used = share + stride;
  AverageWork work;
  const double clip = std::min(options.saturation == options.saturation ? options.saturation : taps.high(), 1e9);
  const auto high = static_cast<float>(clip);
  const auto low = static_cast<float>(unit.differential ? -clip : std::max(taps.low(), -1e9));
  const bool average = taps.shape[0] > 1;
  for (std::int64_t y = begin; y < end; ++y) {
    const std::int64_t at = y * r.width;
    if (average) {
      average_taps(taps, model, static_cast<int>(y), low, high, scratch.data(), stride, used, share, work);
      std::copy(used, used + r.width, r.frames.plane(0) + at);
    }
    for (int f = 0; f < r.frequencies; ++f) {
      float* rows_of_f = scratch.data() + f * model.taps * stride;
      if (!average) load_taps(taps, 0, f, static_cast<int>(y), rows_of_f, stride);
      kernels::PhasorRow p{};
      p.taps = rows_of_f, p.stride = stride, p.count = r.width, p.tap_count = model.taps;
      p.null_count = model.null_count, p.model = model.weights.data(), p.null_space = model.null_space.data();
      p.gain = model.gain, p.floor = model.floor, p.share = average ? share : nullptr;
      p.low = low, p.high = high;
      p.moved_limit = model.moved_limit;
      p.tolerance2 = static_cast<float>(options.moved_tolerance * options.moved_tolerance);
      p.phase = r.phase.plane(f) + at, p.amplitude = r.amplitude.plane(f) + at, p.offset = r.offset.plane(f) + at;
      p.variance = variance + f * stride, p.flags = r.flags.data() + at;
      kernels.phasor(&p);
    }
    range_row(kernels, at, variance, stride);
    correct_row(at);
    kernels::JudgeRow j{};
    j.range = r.range.plane(0) + at, j.sigma = r.sigma.plane(0) + at, j.amplitude = r.amplitude.plane(0) + at;
    j.count = r.width, j.known_sigma = unit.differential ? 0 : 1;
    j.low = static_cast<float>(unwrapper.low), j.high = static_cast<float>(unwrapper.high);
    j.ambiguity = r.frequencies == 1 ? static_cast<float>(ambiguity) : std::numeric_limits<float>::infinity();
    j.min_amplitude = static_cast<float>(options.min_amplitude), j.max_sigma = static_cast<float>(options.max_sigma);
    j.max_phase_sigma_mm = static_cast<float>(options.max_phase_sigma * unwrapper.mm_per_rad[0]);
    j.jump_sigmas = static_cast<float>(kJumpSigmas), j.jump_slope = static_cast<float>(jump_slope);
    j.reach = reach.plane(0) + at, j.flags = r.flags.data() + at;
    kernels.judge(&j);
  }
}

void TofSensor::Impl::point_row(const Kernels& kernels, std::int64_t y) {
  TofResult& r = *result;
  const std::int64_t at = y * r.width, above = at - r.width, below = at + r.width;
  const float *range = r.range.plane(0), *reaches = reach.plane(0);
  kernels::PointsRow p{};
  p.range = range + at, p.reach = reaches + at, p.count = r.width, p.flags = r.flags.data() + at;
  if (y > 0) p.range_above = range + above, p.reach_above = reaches + above;
  if (y + 1 < r.height) p.range_below = range + below, p.reach_below = reaches + below;
  for (int i = 0; i < 3; ++i) {
    p.ray[i] = rays.plane(i) + at;
    p.centre[i] = static_cast<float>(centre[i]);
    p.point[i] = r.points.plane(i) + at;
  }
  kernels.points(&p);
}

TofSensor::TofSensor(const Run& run, const Rig& rig, int unit, const TofOptions& options,
                     std::vector<float> pixel_offset)
    : impl_(std::make_unique<Impl>()) {
  check_options(options);
  Impl& m = *impl_;
  m.unit = rig.tofs[static_cast<std::size_t>(unit)];
  check_tof(m.unit);
  m.camera = rig.cameras[static_cast<std::size_t>(m.unit.camera)];
  m.centre = m.camera.centre_in_room();
  m.options = options;
  const std::size_t n = static_cast<std::size_t>(m.camera.width) * static_cast<std::size_t>(m.camera.height);
  if (!pixel_offset.empty() && pixel_offset.size() != n)
    fail(Status::kInvalidArgument, "pixel_offset_mm: " + std::to_string(pixel_offset.size()) +
                                       " numbers, expected one a pixel, " + std::to_string(n));
  for (const float offset : pixel_offset) {
    if (!(std::abs(offset) <= kMaxCoordinate))
      fail(Status::kInvalidArgument, "pixel_offset_mm: " + text_of(offset) + ", expected finite numbers up to 1e5");
  }
  m.pixel_offset = std::move(pixel_offset);
  m.set_frequencies();
  m.range_correction = Correction(m.unit.range_mm, m.unit.range_error_mm);
  m.amplitude_correction = Correction(m.unit.amplitude, m.unit.amplitude_error_mm);
  m.jump_slope = std::tan(options.max_incidence_deg * kPi / 180) / (m.camera.fx + m.camera.fy);
  m.rays = rays_of(run, m.camera);
}

TofSensor::~TofSensor() = default;
TofSensor::TofSensor(TofSensor&&) noexcept = default;

const TofUnit& TofSensor::unit() const {
  return impl_->unit;
}

const Camera& TofSensor::camera() const {
  return impl_->camera;
}

const std::shared_ptr<TofResult>& TofSensor::measure(const Run& run, const TapsView& taps) {
  Impl& m = *impl_;
  check_taps(taps, m.unit, m.camera);
  m.prepare(taps);
  const Kernels kernels = kernels_of(run.isa);
  parallel_for(
      run, m.camera.height, kRows,
      [&](std::int64_t begin, std::int64_t end) { m.measure_rows(taps, kernels, begin, end); }, "ranging");
  parallel_for(
      run, m.camera.height, kRows,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t y = begin; y < end; ++y) m.point_row(kernels, y);
      },
      "placing");
  summarise(*m.result, m.sigmas);
  return m.result;
}

Surface TofSensor::surface(const Run& run, const TofResult& result) const {
  return organise(run, result, impl_->rays, impl_->centre, impl_->options.normal_window, 2 * impl_->jump_slope);
}

}  // namespace sgrt
