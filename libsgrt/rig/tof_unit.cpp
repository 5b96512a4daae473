// Numbers of a time-of-flight unit, see rig/tof_unit.hpp. docs/theory/tof.md.
#include "rig/tof_unit.hpp"

#include <cmath>

#include "core/error.hpp"

namespace sgrt {
namespace {

[[noreturn]] void refuse(const std::string& field, const std::string& value, const char* expected) {
  fail(Status::kFormat, field + ": " + value + ", expected " + expected);
}

void check(const char* field, double value, double low, double high, const char* expected) {
  if (!(value >= low && value <= high)) refuse(field, text_of(value), expected);
}

}  // namespace

Eigen::Matrix<double, Eigen::Dynamic, 3> tap_model(const std::vector<double>& tap_phase_rad) {
  Eigen::Matrix<double, Eigen::Dynamic, 3> model(static_cast<Eigen::Index>(tap_phase_rad.size()), 3);
  for (Eigen::Index k = 0; k < model.rows(); ++k) {
    const double phase = tap_phase_rad[static_cast<std::size_t>(k)];
    model.row(k) << 1, std::cos(phase), std::sin(phase);
  }
  return model;
}

void check_tof(const TofUnit& unit) {
  constexpr double kLowest = 1e3, kHighest = 1e10;  // Hz
  constexpr double kWorstCondition = 20;            // of the taps' model; four quarters of the circle have 1.4
  for (double f : unit.modulation_hz) check("modulation_hz", f, kLowest, kHighest, "1e3 to 1e10 Hz");
  for (std::size_t i = 0; i < unit.modulation_hz.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (unit.modulation_hz[i] == unit.modulation_hz[j])
        refuse("modulation_hz", text_of(unit.modulation_hz[i]) + " twice", "each frequency once");
    }
  }
  for (double phase : unit.tap_phase_rad) check("tap_phase_rad", phase, -100, 100, "angles of -100 to 100 rad");
  const Eigen::Matrix<double, Eigen::Dynamic, 3> model = tap_model(unit.tap_phase_rad);
  const Vec3 s2 = Eigen::SelfAdjointEigenSolver<Mat3>(model.transpose() * model).eigenvalues();  // increasing
  if (unit.tap_phase_rad.size() < 3 || !(s2(0) * kWorstCondition * kWorstCondition >= s2(2)))
    refuse("tap_phase_rad", "phases that do not span the circle", "at least 3 well apart");
  check("electrons_per_count", unit.electrons_per_count, 1e-6, 1e6, "1e-6 to 1e6");
  check("read_noise_e", unit.read_noise_e, 0, 1e6, "0 to 1e6");
  check("refractive_index", unit.refractive_index, 1, 2, "1 to 2");
}

}  // namespace sgrt
