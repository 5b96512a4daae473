// The fit of the terms of a time-of-flight camera's range error, see calibration/tof.hpp; eq. 14-15 of
// docs/theory/tof.md.
#include <algorithm>
#include <cmath>

#include "calibration/tof.hpp"

namespace sgrt {
namespace {

constexpr double kCurveSigma = 2;   // mm: how far three neighbouring knots may bend
constexpr double kLevelSigma = 20;  // mm: of the amplitude's term
constexpr double kFloor = 1;        // mm: what the model is trusted to, beside a pixel's noise
constexpr int kRounds = 30;

// A line between knots, found in an index of cells.
struct Line {
  std::vector<double> knots, value;

  // The interval of x and its weight at the interval's end.
  std::pair<std::size_t, double> at(double x) const {
    const auto above = std::upper_bound(knots.begin() + 1, knots.end() - 1, x);
    const auto i = static_cast<std::size_t>(above - knots.begin()) - 1;
    return {i, std::clamp((x - knots[i]) / (knots[i + 1] - knots[i]), 0.0, 1.0)};
  }
  double operator()(double x) const {
    const auto [i, t] = at(x);
    return value[i] + t * (value[i + 1] - value[i]);
  }
};

// What each sample says of one line, kept as normal equations of neighbouring knots.
struct Normal {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  explicit Normal(std::size_t n)
      : A(Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n))),
        b(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n))) {}

  void add(std::size_t interval, double t, double w, double y) {
    const auto i = static_cast<Eigen::Index>(interval);
    A(i, i) += w * (1 - t) * (1 - t);
    A(i, i + 1) += w * t * (1 - t);
    A(i + 1, i) += w * t * (1 - t);
    A(i + 1, i + 1) += w * t * t;
    b(i) += w * (1 - t) * y;
    b(i + 1) += w * t * y;
  }
  void bend(double sigma) {
    for (Eigen::Index i = 1; i + 1 < A.rows(); ++i) {
      Eigen::Vector3d d(1, -2, 1);
      A.block<3, 3>(i - 1, i - 1) += d * d.transpose() / (sigma * sigma);
    }
  }
};

std::vector<double> even_knots(double low, double high, double spacing) {
  const int n = std::max(1, static_cast<int>(std::ceil((high - low) / spacing)));
  std::vector<double> knots(static_cast<std::size_t>(n) + 1);
  for (std::size_t i = 0; i < knots.size(); ++i) knots[i] = low + (high - low) * static_cast<double>(i) / n;
  return knots;
}

// Evenly in the logarithm: an amplitude's error runs with it.
std::vector<double> amplitude_knots(std::vector<float> amplitudes, int count) {
  constexpr double kEnds = 0.005, kLeastRatio = 1.5;
  const auto quantile = [&](double q) {
    const auto at = amplitudes.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(amplitudes.size() - 1));
    std::nth_element(amplitudes.begin(), at, amplitudes.end());
    return static_cast<double>(*at);
  };
  const double low = quantile(kEnds), high = quantile(1 - kEnds);
  if (count < 2 || !(low > 0) || high < kLeastRatio * low) return {};
  std::vector<double> knots;
  for (double k : even_knots(std::log(low), std::log(high), std::log(high / low) / (count - 1)))
    knots.push_back(std::exp(k));
  return knots;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Fitter {
  const std::vector<TofSample>& samples;
  const TofCalibrationOptions& options;
  Line range, amplitude;  // amplitude without knots: no such term
  std::vector<double> offset, weight, residual;
  Eigen::MatrixXd range_information;

  double part(const TofSample& s) const { return amplitude.knots.empty() ? 0 : amplitude(s.amplitude); }

  void fit_range() {
    Normal n(range.knots.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const TofSample& s = samples[i];
      const auto [interval, t] = range.at(s.range);
      n.add(interval, t, weight[i], s.error - part(s) - offset[static_cast<std::size_t>(s.pixel)]);
    }
    n.bend(kCurveSigma);
    const Eigen::VectorXd x = n.A.ldlt().solve(n.b);
    range.value.assign(x.begin(), x.end());
    range_information = n.A;
  }

  void fit_amplitude() {
    if (amplitude.knots.empty()) return;
    Normal n(amplitude.knots.size());
    std::vector<double> seen;
    seen.reserve(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const TofSample& s = samples[i];
      const auto [interval, t] = amplitude.at(s.amplitude);
      n.add(interval, t, weight[i], s.error - range(s.range) - offset[static_cast<std::size_t>(s.pixel)]);
      seen.push_back(s.amplitude);
    }
    n.bend(kCurveSigma);
    n.A.diagonal().array() += 1 / (kLevelSigma * kLevelSigma);
    const Eigen::VectorXd x = n.A.ldlt().solve(n.b);
    amplitude.value.assign(x.begin(), x.end());
    const double middle = amplitude(median_of(seen));  // the constant belongs to the range's term
    for (double& v : amplitude.value) v -= middle;
  }

  void fit_offset() {
    std::vector<double> sum(offset.size(), 0), total(offset.size(), 0);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const TofSample& s = samples[i];
      const auto p = static_cast<std::size_t>(s.pixel);
      sum[p] += weight[i] * (s.error - range(s.range) - part(s));
      total[p] += weight[i];
    }
    double mean = 0, count = 0;
    const double prior = options.pixel_sigma > 0 ? 1 / (options.pixel_sigma * options.pixel_sigma) : 0;
    for (std::size_t p = 0; p < offset.size(); ++p) {
      if (!(total[p] > 0) || prior == 0) continue;
      offset[p] = sum[p] / (total[p] + prior);
      mean += offset[p];
      ++count;
    }
    for (std::size_t p = 0; p < offset.size(); ++p) {
      if (total[p] > 0 && prior > 0) offset[p] -= mean / count;
    }
  }

  // Tukey's weights on residuals over their own sigma, at their robust scale.
  void weigh() {
    constexpr double kTukey = 4.685, kMad = 1.4826;
    std::vector<double> size;
    size.reserve(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const TofSample& s = samples[i];
      residual[i] = s.error - range(s.range) - part(s) - offset[static_cast<std::size_t>(s.pixel)];
      size.push_back(std::abs(residual[i]) / std::hypot(s.sigma, kFloor));
    }
    const double scale = std::max(1.0, kMad * median_of(size));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double u = size[i] / (kTukey * scale), sigma = std::hypot(samples[i].sigma, kFloor);
      weight[i] = u < 1 ? (1 - u * u) * (1 - u * u) / (sigma * sigma) : 0;
    }
  }
};

}  // namespace

TofFit fit_tof(const std::vector<TofSample>& samples, std::size_t pixels, const TofCalibrationOptions& options) {
  Fitter f{samples, options, {}, {}, {}, {}, {}, {}};
  f.offset.assign(pixels, 0), f.residual.assign(samples.size(), 0);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  std::vector<float> amplitudes;
  amplitudes.reserve(samples.size());
  for (const TofSample& s : samples) {
    low = std::min(low, static_cast<double>(s.range)), high = std::max(high, static_cast<double>(s.range));
    amplitudes.push_back(s.amplitude);
    f.weight.push_back(1 / (s.sigma * s.sigma + kFloor * kFloor));
  }
  f.range.knots = even_knots(low, std::max(high, low + 1), options.knot_spacing);
  f.range.value.assign(f.range.knots.size(), 0);
  f.amplitude.knots = amplitude_knots(std::move(amplitudes), options.amplitude_knots);
  f.amplitude.value.assign(f.amplitude.knots.size(), 0);
  for (int round = 0; round < kRounds; ++round) {
    f.fit_range();
    f.fit_amplitude();
    f.fit_offset();
    f.weigh();
  }
  TofFit out;
  out.range_knots = f.range.knots, out.range_error = f.range.value;
  out.amplitude_knots = f.amplitude.knots, out.amplitude_error = f.amplitude.value;
  const Eigen::VectorXd variance = f.range_information.inverse().diagonal();
  for (const double v : variance) out.range_sigma.push_back(std::sqrt(v));
  if (options.pixel_sigma > 0) out.pixel_offset.assign(f.offset.begin(), f.offset.end());
  for (const double w : f.weight) out.used.push_back(w > 0 ? 1 : 0);
  return out;
}

}  // namespace sgrt
