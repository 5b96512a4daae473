// Calibration of a time-of-flight camera, see calibration/tof.hpp; eq. 13 of docs/theory/tof.md.
#include "calibration/tof.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/text.hpp"
#include "core/error.hpp"
#include "tof/correct.hpp"
#include "tof/kernels.hpp"

namespace sgrt {
namespace {

constexpr double kHalfLight = 299'792'458e3 / 2;  // mm/s

void check(const std::vector<TofPlacement>& placements, const TofCalibrationOptions& o) {
  const auto refuse = [](const char* name, double value, const char* expected) {
    fail(Status::kInvalidArgument, std::string(name) + ": " + text_of(value) + ", expected " + expected);
  };
  if (placements.empty()) fail(Status::kInvalidArgument, "placements: none, expected at least one");
  for (int i = 0; i < 2; ++i) {
    if (!(o.low[i] < o.high[i])) refuse("board_mm", o.low[i], "a rectangle: left, top, right, bottom");
  }
  if (!(o.knot_spacing >= 1 && o.knot_spacing <= 1e4)) refuse("knot_spacing_mm", o.knot_spacing, "1 to 1e4");
  if (o.amplitude_knots < 0 || o.amplitude_knots > 100) refuse("amplitude_knots", o.amplitude_knots, "0 to 100");
  if (!(o.pixel_sigma >= 0 && o.pixel_sigma <= 1e3)) refuse("pixel_sigma_mm", o.pixel_sigma, "0 to 1e3");
}

// Range along the ray to the board's plane; NaN where it meets none of the rectangle.
double true_range(const Pose& board_from_room, const Vec3& centre, const Vec3& ray, const TofCalibrationOptions& o) {
  const Vec3 from = board_from_room * centre, along = board_from_room.R * ray;
  const double d = -from.z() / along.z();
  const Vec3 at = from + d * along;
  const bool inside = d > 0 && at.x() > o.low.x() && at.x() < o.high.x() && at.y() > o.low.y() && at.y() < o.high.y();
  return inside ? d : kUnset;
}

void add_samples(const TofResult& r, const std::vector<Vec3>& rays, const Vec3& centre, const TofPlacement& placement,
                 int number, const TofCalibrationOptions& options, std::vector<TofSample>& samples) {
  constexpr double kLargestError = 500;  // mm; beyond it the turns are wrong, not the range
  const Pose board_from_room = placement.room_from_board.inverse();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (r.flags[i] & kernels::kTofRejected) continue;
    const double truth = true_range(board_from_room, centre, rays[i], options);
    const float range = r.range.plane(0)[i], sigma = r.sigma.plane(0)[i];
    const auto error = static_cast<float>(range - truth);
    if (!(std::abs(error) < std::min(kLargestError, r.ambiguity / 4))) continue;
    samples.push_back(
        {range, error, r.amplitude.plane(0)[i], sigma == sigma ? sigma : 5.F, static_cast<std::int32_t>(i), number});
  }
}

// Root mean squares before and after, of pixels and of placements.
void add_figures(const std::vector<TofSample>& samples, const TofFit& fit, TofCalibration& c) {
  const Correction range(fit.range_knots, fit.range_error), amplitude(fit.amplitude_knots, fit.amplitude_error);
  double before = 0, after = 0, expected = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const TofSample& s = samples[i];
    if (!fit.used[i]) {
      ++c.outliers;
      continue;
    }
    double left = s.error - range.at(s.range);
    if (!amplitude.empty()) left -= amplitude.at(s.amplitude);
    if (!fit.pixel_offset.empty()) left -= fit.pixel_offset[static_cast<std::size_t>(s.pixel)];
    TofPlacementFigures& p = c.placements[static_cast<std::size_t>(s.placement)];
    ++p.pixels;
    p.range += s.range, p.before += s.error, p.after += left;
    before += static_cast<double>(s.error) * s.error, after += left * left;
    expected += static_cast<double>(s.sigma) * s.sigma;
    ++c.samples;
  }
  const auto n = static_cast<double>(c.samples);
  c.rms_before = std::sqrt(before / n), c.rms_after = std::sqrt(after / n), c.expected = std::sqrt(expected / n);
  double square = 0, count = 0;
  for (TofPlacementFigures& p : c.placements) {
    const auto k = static_cast<double>(p.pixels);
    p.range /= k, p.before /= k, p.after /= k;  // NaN where none counts
    if (p.pixels == 0) continue;
    square += p.after * p.after;
    ++count;
  }
  c.placement_rms = std::sqrt(square / count);
  square = 0;
  for (const float o : fit.pixel_offset) square += static_cast<double>(o) * o;
  c.pixel_rms = fit.pixel_offset.empty() ? 0 : std::sqrt(square / static_cast<double>(fit.pixel_offset.size()));
}

// What a reader should doubt: gaps in the ranges, pixels without a sample, residuals beyond the noise.
void warn(const std::vector<TofSample>& samples, const TofFit& fit, std::size_t pixels, TofCalibration& c) {
  constexpr double kGap = 300, kWorse = 3, kLeastShare = 0.5;
  std::vector<float> ranges;
  std::vector<char> seen(pixels, 0);
  ranges.reserve(samples.size());
  for (const TofSample& s : samples) {
    ranges.push_back(s.range);
    seen[static_cast<std::size_t>(s.pixel)] = 1;
  }
  std::sort(ranges.begin(), ranges.end());
  double gap = 0, at = 0;
  for (std::size_t i = 1; i < ranges.size(); ++i) {
    if (ranges[i] - ranges[i - 1] <= gap) continue;
    gap = ranges[i] - ranges[i - 1];
    at = ranges[i - 1];
  }
  if (gap > kGap)
    c.warnings.push_back("no board between " + rounded(at, 0) + " and " + rounded(at + gap, 0) +
                         " mm: the range correction is a guess there");
  const double share = static_cast<double>(std::count(seen.begin(), seen.end(), 1)) / static_cast<double>(pixels);
  if (share < kLeastShare && !fit.pixel_offset.empty())
    c.warnings.push_back("the board was seen by " + rounded(100 * share, 0) +
                         " % of the pixels: the others have no offset of their own");
  if (c.rms_after > kWorse * c.expected)
    c.warnings.push_back("pixels scatter by " + rounded(c.rms_after, 2) +
                         " mm after the correction, their noise lets expect " + rounded(c.expected, 2) + " mm");
}

}  // namespace

TofCalibration calibrate_tof(const Run& run, const Rig& rig, int unit, const std::vector<TofPlacement>& placements,
                             const TofOptions& sensor_options, const TofCalibrationOptions& options) {
  constexpr std::size_t kFewest = 500;
  check(placements, options);
  TofCalibration c;
  c.rig = rig;
  TofUnit& u = c.rig.tofs[static_cast<std::size_t>(unit)];
  c.unit = u.id;
  u.range_mm.clear(), u.range_error_mm.clear(), u.amplitude.clear(), u.amplitude_error_mm.clear();
  u.pixel_offset_file.clear();
  TofSensor sensor(run, c.rig, unit, sensor_options, {});
  const Camera& camera = sensor.camera();
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  std::vector<Vec3> rays;
  rays.reserve(pixels);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) rays.push_back(unproject(camera, Vec2(x, y)));
  }
  std::vector<TofSample> samples;
  c.placements.reserve(placements.size());
  for (std::size_t i = 0; i < placements.size(); ++i) {
    run.poll(static_cast<double>(i) / static_cast<double>(placements.size()), "measuring the board");
    add_samples(*sensor.measure(run, placements[i].taps), rays, camera.centre_in_room(), placements[i],
                static_cast<int>(i), options, samples);
    c.placements.push_back({placements[i].name, 0, 0, 0, 0});
  }
  if (samples.size() < kFewest) {
    c.status = Status::kInsufficientData;
    c.message = std::to_string(samples.size()) + " pixels saw the board, expected at least " + std::to_string(kFewest);
    return c;
  }
  const double highest = *std::max_element(u.modulation_hz.begin(), u.modulation_hz.end());
  const TofFit fit = fit_tof(samples, pixels, kHalfLight / highest, options);
  add_figures(samples, fit, c);
  warn(samples, fit, pixels, c);
  u.range_mm = fit.range_knots, u.range_error_mm = fit.range_error;
  u.amplitude = fit.amplitude_knots, u.amplitude_error_mm = fit.amplitude_error;
  c.pixel_offset = fit.pixel_offset;
  c.range_sigma = fit.range_sigma;
  return c;
}

}  // namespace sgrt
