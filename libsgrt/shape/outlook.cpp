// The rate of the bias by weighted least squares over the drifts. docs/theory/curvature.md eq. 15-17.
#include "shape/outlook.hpp"

#include <algorithm>
#include <cmath>

namespace sgrt {
namespace {

constexpr double kEnough = 0.1;      // of the disc's own variance: a rate need not be known better
constexpr double kUnlike = 0.1;      // of the squared bias: what no law tells
constexpr double kSpread = 0.9;      // of the squared spread between nodes that is a node's own
constexpr double kChance = 1;        // sigma of the spread: less is chance
constexpr double kSure = 3;          // times its noise: what a departure from the law exceeds not by chance
constexpr double kSureOwn = 6;       // the same of the node's own drift, which is noisier
constexpr double kInner = 0.5;       // of the radius: departures are looked for from there on
constexpr double kRounding = 1e-18;  // of squared curvature over the disc's radius

double grown(double r, int order) {
  return order == 4 ? r * r * r * r : r * r;
}

// Bias of the tensor over r^order.
struct Rate {
  Mat3 mean = Mat3::Zero();
  double variance = 0;  // by noise
  double shared = 0;    // covariance with the disc's own noise, which the drifts beyond it have in common with it
  double spread = 0;    // squared, between the nodes beyond chance
  bool known = false;
};

Rate rate_of(const Drift* drifts, const double* growth, std::size_t count, std::size_t top, double enough) {
  Rate rate;
  double sum = 0, sum2 = 0, chance2 = 0;
  for (std::size_t j = 0; j < count; ++j) {
    const Drift& d = drifts[j];
    if (d.variance < 0) continue;
    const double g = growth[j], w = g / (d.variance + enough * g * g);
    sum += w * g;
    sum2 += w * w * g * g;
    rate.mean += w * d.mean;
    rate.variance += w * w * d.variance;
    rate.spread += w * w * d.spread;
    const double chance = w * w * d.chance;
    chance2 += chance * chance;
    if (j >= top) rate.shared += w * d.variance;
  }
  if (!(sum > 0)) return rate;
  rate.known = true;
  rate.mean /= sum;
  rate.variance /= sum * sum;
  rate.shared /= sum;
  rate.spread = std::max(0.0, (rate.spread - kChance * std::sqrt(chance2)) / sum2);
  return rate;
}

// A sum of steps less what the law says of them.
struct Departure {
  Mat3 sum = Mat3::Zero();
  double variance = 0;
  // Squared, beyond chance.
  double add(const Mat3& step, double step_variance, double sure) {
    sum += step;
    variance += step_variance;
    return sum.squaredNorm() - sure * variance;
  }
};

// How far the tensor strays from the law on the way to the disc, squared, beyond chance: a bias that stops growing, or
// turns back, must not be taken for none.
double departure2(const Drift* drifts, const double* radii, const double* growth, std::size_t top, const Mat3& rate,
                  double inner) {
  Departure about, own;
  double most = 0;
  for (std::size_t j = top; j-- > 0;) {
    const Drift& d = drifts[j];
    if (d.variance < 0 || radii[j] < inner) break;
    const Mat3 law = growth[j] * rate;
    most = std::max(most, about.add(d.mean - law, d.variance, kSure));
    if (d.own_variance >= 0) most = std::max(most, own.add(d.own - law, d.own_variance, kSureOwn));
  }
  return most;
}

}  // namespace

Outlook outlook_of(const Drift* drifts, const double* radii, std::size_t count, int order, double r, double variance) {
  const std::size_t steps = std::min(count, kMostDiscs) - 1;
  double growth[kMostDiscs];
  const double power = grown(r, order), power2 = power * power;
  double inside = grown(radii[0], order);
  for (std::size_t j = 0; j < steps; ++j) {
    const double outside = grown(radii[j + 1], order);
    growth[j] = outside - inside;
    inside = outside;
  }
  std::size_t top = 0;  // steps that lie within the disc, which is nearest to radii[top]
  while (top < steps && radii[top] * radii[top + 1] <= r * r) ++top;
  Outlook o;
  const Rate rate =
      rate_of(drifts, growth, std::min(top + 1, steps), top, (kEnough * variance + kRounding / (r * r)) / power2);
  if (!rate.known) return o;
  const double norm2 = rate.mean.squaredNorm(), square = std::max(0.0, norm2 - rate.variance);
  const double doubt =
      departure2(drifts, radii, growth, top, rate.mean, kInner * r) / power2 + kUnlike * square + kSpread * rate.spread;
  const double share = square > 0 ? square / (square + rate.variance + doubt) : 0;
  o.bias = share * power * rate.mean;
  o.left2 = std::max(doubt, (1 - share) * (1 - share) * square + share * share * doubt) * power2;
  if (variance > 0) o.inflate = 1 + share * power * (2 * rate.shared + share * power * rate.variance) / variance;
  const double mean = 0.5 * rate.mean.trace();
  o.mean_part = (mean * mean + 0.25 * rate.variance + 1e-300) / (norm2 + rate.variance + 4e-300);
  return o;
}

}  // namespace sgrt
