#include "laser/stripe.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/median.hpp"
#include "core/parallel.hpp"
#include "laser/profile_fit.hpp"

namespace sgrt {
namespace {

constexpr int kBlock = 128;  // lines
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

void resize(std::size_t n, Stripe& s) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  s.centre.assign(n, kNaN);
  for (std::vector<float>* v : {&s.sigma, &s.signal, &s.width, &s.asymmetry}) v->assign(n, nan);
  s.reason.assign(n, 0);
}

// The width of the stripes across themselves, px, for the ridge's scale: the narrow half of the candidates tells it.
double ridge_sigma(const std::vector<LineCandidates>& lines, const std::vector<int>& chosen) {
  std::vector<float> widths;
  widths.reserve(lines.size());
  for (std::size_t y = 0; y < lines.size(); ++y) {
    if (chosen[y] >= 0) widths.push_back(lines[y][chosen[y]].width);
  }
  return widths.empty() ? 1.5 : std::clamp<double>(median(widths), 1, 6);
}

void write(std::size_t y, const Centre& c, const StripeOptions& o, Stripe& s) {
  LineReason reason = c.reason;
  if (reason == LineReason::kNone && std::abs(c.asymmetry) > o.max_asymmetry + 3 * c.asymmetry_sigma)
    reason = LineReason::kEdge;
  s.signal[y] = c.signal;
  s.width[y] = c.width;
  s.asymmetry[y] = c.asymmetry;
  s.reason[y] = static_cast<std::uint8_t>(reason);
  if (reason != LineReason::kNone) return;
  s.centre[y] = c.centre;
  s.sigma[y] = static_cast<float>(std::sqrt(c.variance));
}

// How much the reflectance changes from a pixel to the next, as a share: from line to line the stripe's signal shows
// it, and across the stripe, where it shifts the centre, it will be alike (eq. 8a). The noise of the signals themselves
// is the same between neighbours and between lines five apart, and falls out.
double texture_of(const Stripe& s) {
  const auto square = [&](std::size_t apart) {
    std::vector<float> changes;
    changes.reserve(s.signal.size());
    for (std::size_t y = 0; y + apart < s.signal.size(); ++y) {
      if (s.reason[y] == 0 && s.reason[y + apart] == 0)
        changes.push_back(2 * std::abs(s.signal[y + apart] - s.signal[y]) / (s.signal[y + apart] + s.signal[y]));
    }
    constexpr double kNormal = 1.4826;
    const double middle = changes.size() < 10 ? 0 : kNormal * median(changes);
    return middle * middle;
  };
  constexpr std::size_t kApart = 5;
  const double allowed = 1 + 4 / std::sqrt(static_cast<double>(s.signal.size()));  // for the noise of the medians
  return std::sqrt(std::max(0.0, (square(kApart) - allowed * square(1)) / (kApart * kApart - 1)));
}

// Residuals beyond the noise of dark pixels: the part that goes with the signal (shot noise, speckle) widens each sigma
// by what it does there, the rest (a profile that is no Gaussian) all of them alike (eq. 8).
void finish(const std::vector<Fit>& fits, const ProfileNoise& noise, Stripe& s) {
  double excess = 0, power = 0;
  std::vector<float> residuals;
  residuals.reserve(fits.size());
  for (const Fit& fit : fits) excess += fit.excess, power += fit.power;
  const double gain = power > 0 ? std::max(0.0, excess / power) : 0;
  for (std::size_t y = 0; y < fits.size(); ++y) {
    const Fit& fit = fits[y];
    if (!(fit.residual > 0) || s.reason[y] != 0) continue;
    const double share = gain * fit.shot / (fit.variance + gain * fit.shot);
    s.sigma[y] = static_cast<float>(std::sqrt(fit.variance + gain * fit.shot));
    if (share < 0.3) residuals.push_back(static_cast<float>(fit.residual));  // else the excess is accounted for
  }
  s.gain = noise.gain > 0 ? noise.gain : gain;
  if (residuals.size() >= 10) s.fit_scale = std::sqrt(std::max(1.0, median(residuals) / 0.95));
  std::vector<float> sigmas;
  sigmas.reserve(s.reason.size());
  const double texture = fits.empty() ? 0 : texture_of(s);
  for (std::size_t y = 0; y < s.reason.size(); ++y) {
    ++s.reason_count[s.reason[y]];
    if (s.reason[y] != 0) continue;
    const double shift = texture * s.width[y] * s.width[y];
    s.sigma[y] = static_cast<float>(std::hypot(s.fit_scale * s.sigma[y], shift));
    sigmas.push_back(s.sigma[y]);
  }
  s.found = static_cast<std::int64_t>(sigmas.size());
  s.median_sigma = median(sigmas);
  if (s.found > 0) return;
  s.status = Status::kNotFound;
  s.message = "no stripe in the image, expected a bright line of at least min_length lines above min_signal";
}

}  // namespace

void check_options(const StripeOptions& o) {
  const auto refuse = [](const char* name, double value, const char* expected) {
    fail(Status::kInvalidArgument, std::string(name) + ": " + text_of(value) + ", expected " + expected);
  };
  const int method = static_cast<int>(o.method);
  if (method < 0 || method > 2) refuse("method", method, "SGRT_STRIPE_CENTROID (0), _GAUSSIAN (1) or _RIDGE (2)");
  if (o.min_length < 1 || o.min_length > 1000) refuse("min_length", o.min_length, "1 to 1000");
  if (!(o.half_width == 0 || (o.half_width >= 2 && o.half_width <= 100)))
    refuse("half_width_px", o.half_width, "0 or 2 to 100");
  if (!(o.min_signal >= 0 && o.min_signal <= 1e9)) refuse("min_signal", o.min_signal, "0 to 1e9");
  if (!(o.noise >= 0 && o.noise <= 1e9)) refuse("noise", o.noise, "0 to 1e9");
  if (!(o.gain >= 0 && o.gain <= 1e9)) refuse("gain", o.gain, "0 to 1e9");
  if (!(o.saturation >= 0 && o.saturation <= 1e9)) refuse("saturation", o.saturation, "0 to 1e9");
  if (!(o.max_asymmetry > 0 && o.max_asymmetry <= 1))
    refuse("max_asymmetry", o.max_asymmetry, "more than 0, at most 1");
}

Stripe extract_stripe(const Run& run, const ImageView& image, const ImageView* dark, const StripeOptions& o) {
  constexpr double kLeastSignal = 2, kSignalSigmas = 6;
  check_options(o);
  if (dark && (dark->height != image.height || dark->width != image.width || dark->type != image.type))
    fail(Status::kInvalidArgument, "dark: " + std::to_string(dark->width) + " x " + std::to_string(dark->height) +
                                       " px, expected the image's size and type, " + std::to_string(image.width) +
                                       " x " + std::to_string(image.height));
  const Lines lines(image, dark, o.columns, o.saturation);
  Stripe s;
  const auto n = static_cast<std::size_t>(lines.count());
  resize(n, s);
  s.noise = o.noise > 0 ? o.noise : noise_of(lines);
  if (!(s.noise > 0)) s.noise = 1e-6;  // a float image without any
  const bool whole = image.type != ImageView::Type::kF32;
  const auto min_signal = static_cast<float>(
      o.min_signal > 0 ? o.min_signal : std::max(whole ? kLeastSignal : 0.0, kSignalSigmas * s.noise));
  int half = o.half_width > 0 ? static_cast<int>(std::lround(o.half_width)) : window_of(run, lines, min_signal);
  half = std::max(1, std::min(half, (lines.width() - 1) / 4));
  std::vector<LineCandidates> found(n);
  parallel_for(
      run, lines.count(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        std::vector<float> buffer(static_cast<std::size_t>(2 * lines.width()));
        for (std::int64_t y = begin; y < end; ++y)
          found[y] = find_candidates(run, lines, static_cast<int>(y), half, min_signal, buffer);
      },
      "stripe");
  std::vector<LineReason> reason;
  std::vector<int> chosen;
  choose(found, o.min_length, reason, chosen);
  std::optional<RidgeKernel> ridge;
  if (o.method == StripeMethod::kRidge) ridge.emplace(ridge_sigma(found, chosen));
  const ProfileNoise noise{s.noise, o.gain};
  std::vector<Fit> fits(o.method == StripeMethod::kGaussian ? n : 0);
  parallel_for(
      run, lines.count(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto y = static_cast<std::size_t>(i);
          const int line = static_cast<int>(i);
          s.reason[y] = static_cast<std::uint8_t>(reason[y]);
          if (reason[y] != LineReason::kNone) continue;
          const Candidate& c = found[y][chosen[y]];
          const Centre centre = ridge                                 ? ridge_centre(lines, line, c, *ridge, noise)
                                : o.method == StripeMethod::kGaussian ? gaussian_centre(run, lines, line, c, noise)
                                                                      : centroid_centre(lines, line, c, half, noise);
          if (!fits.empty()) fits[y] = centre.fit;
          write(y, centre, o, s);
        }
      },
      "stripe");
  finish(fits, noise, s);
  return s;
}

}  // namespace sgrt
