// Joint unwrapping, see tof/unwrap.hpp.
#include "tof/unwrap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Candidate {
  double range, cost;
};

// The range near `start` that suits all frequencies best, each at its nearest number of turns.
Candidate nearest(const Unwrapper& u, const double* first, const double* weight, double start) {
  double sum = 0, sum_weight = 0, square = 0, mean = start;
  for (int i = 0; i < u.frequencies; ++i) {
    const double d = first[i] + u.ambiguity[i] * std::round((mean - first[i]) / u.ambiguity[i]) - start;
    sum += weight[i] * d;
    square += weight[i] * d * d;
    sum_weight += weight[i];
    mean = start + sum / sum_weight;  // the next frequency is unwrapped to what is known so far
  }
  return {mean, std::max(0.0, square - sum * sum / sum_weight)};
}

}  // namespace

Unwrapped unwrap(const Unwrapper& u, const double* phase, const double* variance) {
  double first[kMostFrequencies], weight[kMostFrequencies], information = 0, weighted = 0;
  double own[kMostFrequencies];
  bool known = true;
  for (int i = 0; i < u.frequencies; ++i) {
    first[i] = phase[i] * u.mm_per_rad[i];
    known = known && variance[i] == variance[i];
    const double v = variance[i] == variance[i] ? variance[i] : u.unknown_sigma * u.unknown_sigma;
    own[i] = 1 / std::max(v * u.mm_per_rad[i] * u.mm_per_rad[i], 1e-12);
    weight[i] = 1 / (1 / own[i] + u.tolerance * u.tolerance);
    information += own[i];
  }
  // Each turn of the first frequency inside the window, and one beyond: the mean of all may lie inside.
  const auto turn = [&](double x) { return std::floor((x - first[0]) / u.ambiguity[0]); };
  Candidate best{kNan, kInfinity}, second{kNan, kInfinity};
  for (double n = turn(u.low); n <= turn(u.high) + 1; ++n) {
    const Candidate c = nearest(u, first, weight, first[0] + n * u.ambiguity[0]);
    if (!(c.range >= u.low && c.range <= u.high)) continue;
    if (c.cost < best.cost) {
      second = best;
      best = c;
    } else if (c.cost < second.cost) {
      second = c;
    }
  }
  if (!(best.cost < kInfinity)) return {kNan, kNan, kNan, kNan};
  // The estimate itself weighs by noise alone.
  for (int i = 0; i < u.frequencies; ++i)
    weighted +=
        own[i] * (first[i] + u.ambiguity[i] * std::round((best.range - first[i]) / u.ambiguity[i]) - best.range);
  return {best.range + weighted / information, known ? 1 / std::sqrt(information) : kNan, (second.cost - best.cost) / 2,
          best.cost};
}

double joint_ambiguity(const std::vector<double>& modulation_hz, double speed_mm_s) {
  double divisor = modulation_hz.front();
  for (double f : modulation_hz) {
    double a = f;
    while (divisor >= 1) {  // Euclid; below 1 Hz they have none that matters
      const double rest = std::abs(std::remainder(a, divisor));
      a = divisor;
      divisor = rest;
    }
    divisor = a;
  }
  return speed_mm_s / (2 * divisor);
}

}  // namespace sgrt
