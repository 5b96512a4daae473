#include "tof/check.hpp"

namespace sgrt {

void check_options(const TofOptions& o) {
  const auto refuse = [](const char* name, double value, const char* expected) {
    fail(Status::kInvalidArgument, std::string(name) + ": " + text_of(value) + ", expected " + expected);
  };
  if (!(o.range_min >= 0 && o.range_min < kMaxCoordinate)) refuse("range_min_mm", o.range_min, "0 to 1e5");
  if (o.range_max == o.range_max && !(o.range_max > o.range_min && o.range_max <= kMaxCoordinate))
    refuse("range_max_mm", o.range_max, "more than range_min_mm, at most 1e5");
  if (o.saturation == o.saturation && !(o.saturation > 0)) refuse("saturation", o.saturation, "more than 0");
  if (!(o.min_amplitude >= 0)) refuse("min_amplitude", o.min_amplitude, "at least 0");
  if (!(o.max_phase_sigma > 0)) refuse("max_phase_sigma_rad", o.max_phase_sigma, "more than 0");
  if (!(o.max_sigma > 0)) refuse("max_sigma_mm", o.max_sigma, "more than 0");
  if (!(o.moved_tolerance >= 0)) refuse("moved_tolerance", o.moved_tolerance, "at least 0");
  if (!(o.max_incidence_deg > 0 && o.max_incidence_deg < 90))
    refuse("max_incidence_deg", o.max_incidence_deg, "more than 0, less than 90");
  if (!(o.min_unwrap_score >= 0)) refuse("min_unwrap_score", o.min_unwrap_score, "at least 0");
  if (!(o.unwrap_tolerance >= 0 && o.unwrap_tolerance <= 1e4))
    refuse("unwrap_tolerance_mm", o.unwrap_tolerance, "0 to 1e4");
  if (o.normal_window < 3 || o.normal_window > 31 || o.normal_window % 2 == 0)
    refuse("normal_window_px", o.normal_window, "an odd number from 3 to 31");
}

void check_taps(const TapsView& taps, const TofUnit& unit, const Camera& camera) {
  const auto shape = [](const std::array<std::int64_t, 5>& s) {
    std::string text;
    for (std::size_t i = 0; i < s.size(); ++i) text += (i ? " x " : "") + std::to_string(s[i]);
    return text;
  };
  const std::array<std::int64_t, 5> expected{taps.shape[0], static_cast<std::int64_t>(unit.modulation_hz.size()),
                                             static_cast<std::int64_t>(unit.tap_phase_rad.size()), camera.height,
                                             camera.width};
  if (taps.shape != expected || taps.shape[0] < 1)
    fail(Status::kInvalidArgument, "taps: shape " + shape(taps.shape) +
                                       ", expected frames x frequencies x taps x height x width, frames x" +
                                       shape(expected).substr(shape(expected).find(" x ") + 2) + " of tof " + unit.id);
  constexpr std::int64_t kMostFrames = 1000;
  if (taps.shape[0] > kMostFrames)
    fail(Status::kLimit, "taps: " + std::to_string(taps.shape[0]) + " frames, expected at most 1000");
}

}  // namespace sgrt
