// The fit of the terms of a time-of-flight camera's range error, see calibration/tof.hpp; eq. 14-15 of
// docs/theory/tof.md.
#include <algorithm>
#include <cmath>

#include "calibration/tof.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

constexpr double kCurveSigma = 2;  // mm: how far three neighbouring knots of the amplitude's term may bend
constexpr double kWiggle = 60;     // mm: of the wiggling that sets how smooth the range's term is, with room to spare
constexpr double kPoseSigma = 1;   // mm: of the board's pose along the rays
constexpr double kLeastOffset = 0.2;  // mm
constexpr double kPi = 3.14159265358979323846;
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
  // The prior that differences of an order (their coefficients) have this one sigma.
  void smooth(const Eigen::VectorXd& difference, double sigma) {
    const Eigen::Index n = difference.size();
    for (Eigen::Index i = 0; i + n <= A.rows(); ++i)
      A.block(i, i, n, n) += difference * difference.transpose() / (sigma * sigma);
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
  knots.reserve(static_cast<std::size_t>(count));
  for (double k : even_knots(std::log(low), std::log(high), std::log(high / low) / (count - 1)))
    knots.push_back(std::exp(k));
  return knots;
}

struct Fitter {
  const std::vector<TofSample>& samples;
  const TofCalibrationOptions& options;
  Line range{}, amplitude{};  // amplitude without knots: no such term
  std::vector<double> offset{}, weight{}, residual{};
  Eigen::MatrixXd range_information{};
  Eigen::Index placements = 0;
  double bend_sigma = 1;
  double noise2 = 1;  // of the residuals over their own sigma, squared
  bool has_offset = false;

  double part(const TofSample& s) const { return amplitude.knots.empty() ? 0 : amplitude(s.amplitude); }

  // Pixels of one placement share the error of the board's pose: however many there are, a placement tells a knot no
  // more than kPoseSigma allows.
  void fit_range() {
    const auto knots = static_cast<Eigen::Index>(range.knots.size());
    Eigen::MatrixXd total = Eigen::MatrixXd::Zero(knots, placements);
    for (std::size_t i = 0; i < samples.size(); ++i)
      total(static_cast<Eigen::Index>(range.at(samples[i].range).first), samples[i].placement) += weight[i];
    Normal n(range.knots.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const TofSample& s = samples[i];
      const auto [interval, t] = range.at(s.range);
      const double shared = total(static_cast<Eigen::Index>(interval), s.placement) * kPoseSigma * kPoseSigma;
      n.add(interval, t, weight[i] / (1 + shared), s.error - part(s) - offset[static_cast<std::size_t>(s.pixel)]);
    }
    n.smooth(Eigen::Vector4d(-1, 3, -3, 1), bend_sigma);
    n.A.diagonal().array() += 1e-9;  // where there are too few knots for a difference
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
    n.smooth(Eigen::Vector3d(1, -2, 1), kCurveSigma);
    n.A.diagonal().array() += 1 / (kLevelSigma * kLevelSigma);
    const Eigen::VectorXd x = n.A.ldlt().solve(n.b);
    amplitude.value.assign(x.begin(), x.end());
    const double middle = amplitude(median(seen));  // the constant belongs to the range's term
    for (double& v : amplitude.value) v -= middle;
  }

  // Shrunk by how far the pixels differ beyond their noise (empirical Bayes), at most by the option.
  void fit_offset() {
    std::vector<double> sum(offset.size(), 0), total(offset.size(), 0);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const TofSample& s = samples[i];
      const auto p = static_cast<std::size_t>(s.pixel);
      sum[p] += weight[i] * (s.error - range(s.range) - part(s));
      total[p] += weight[i];
    }
    double square = 0, count = 0, all = 0, mean = 0;
    for (std::size_t p = 0; p < offset.size(); ++p) {
      if (!(total[p] > 0)) continue;
      square += sum[p] * sum[p] / total[p];
      all += total[p];
      ++count;
    }
    const double variance =
        std::min((square - noise2 * count) / std::max(all, 1e-9), options.pixel_sigma * options.pixel_sigma);
    has_offset = variance > kLeastOffset * kLeastOffset;
    for (std::size_t p = 0; p < offset.size(); ++p) {
      offset[p] = has_offset && total[p] > 0 ? sum[p] / (total[p] + noise2 / variance) : 0;
      mean += offset[p];
    }
    for (std::size_t p = 0; p < offset.size(); ++p) {
      if (has_offset && total[p] > 0) offset[p] -= mean / count;
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
    std::vector<double> reordered = size;
    const double spread = kMad * median(reordered), scale = std::max(1.0, spread);
    noise2 = std::pow(spread, 2);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double u = size[i] / (kTukey * scale), sigma = std::hypot(samples[i].sigma, kFloor);
      weight[i] = u < 1 ? (1 - u * u) * (1 - u * u) / (sigma * sigma) : 0;
    }
  }
};

}  // namespace

TofFit fit_tof(const std::vector<TofSample>& samples, std::size_t pixels, double wave,
               const TofCalibrationOptions& options) {
  Fitter f{samples, options};
  f.offset.assign(pixels, 0), f.residual.assign(samples.size(), 0);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  std::vector<float> amplitudes;
  amplitudes.reserve(samples.size());
  f.weight.reserve(samples.size());
  for (const TofSample& s : samples) {
    low = std::min(low, static_cast<double>(s.range)), high = std::max(high, static_cast<double>(s.range));
    amplitudes.push_back(s.amplitude);
    f.placements = std::max(f.placements, static_cast<Eigen::Index>(s.placement) + 1);
    f.weight.push_back(1 / (s.sigma * s.sigma + kFloor * kFloor));
  }
  f.range.knots = even_knots(low, std::max(high, low + 1), options.knot_spacing);
  f.range.value.assign(f.range.knots.size(), 0);
  f.bend_sigma = kWiggle * std::pow(2 * kPi * (f.range.knots[1] - f.range.knots[0]) / (wave / 4), 3);
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
  out.range_sigma.reserve(static_cast<std::size_t>(variance.size()));
  out.used.reserve(f.weight.size());
  for (const double v : variance) out.range_sigma.push_back(std::sqrt(v));
  if (f.has_offset) out.pixel_offset.assign(f.offset.begin(), f.offset.end());
  for (const double w : f.weight) out.used.push_back(w > 0 ? 1 : 0);
  return out;
}

}  // namespace sgrt
