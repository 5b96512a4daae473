// The sub-pixel corner, see calibration/saddle.hpp: two blurred edges that cross, on light that may have a slope,
// fitted to the pixels themselves; so blur, skew and uneven light do not pull the corner. docs/theory/calibration.md
// eq. 18.
#include <cmath>

#include "calibration/saddle.hpp"

namespace sgrt {
namespace {

// x, y, angle1, angle2, blur | mean, slope x, slope y, contrast
constexpr int kSize = 9;
using Unknowns = Eigen::Matrix<double, kSize, 1>;
using Gram = Eigen::Matrix<double, kSize, kSize>;

struct Sums {
  Gram A = Gram::Zero();
  Unknowns a = Unknowns::Zero();
  double square = 0;
  int count = 0;
};

// The value of the model at a pixel and its derivatives. `from` is the pixel less the disc's middle.
double model_at(const Unknowns& p, const Vec2& from, Unknowns* J) {
  constexpr double kSlope = 1.1283791670955126;  // 2 / sqrt pi, of erf at 0
  const Vec2 d = from - p.head<2>();
  const double c1 = std::cos(p(2)), s1 = std::sin(p(2)), c2 = std::cos(p(3)), s2 = std::sin(p(3)), w = 1 / p(4);
  const double t1 = (-s1 * d.x() + c1 * d.y()) * w, t2 = (-s2 * d.x() + c2 * d.y()) * w;
  const double e1 = std::erf(t1), e2 = std::erf(t2);
  if (J) {
    const double g1 = p(8) * e2 * kSlope * std::exp(-t1 * t1), g2 = p(8) * e1 * kSlope * std::exp(-t2 * t2);
    *J << (g1 * s1 + g2 * s2) * w, -(g1 * c1 + g2 * c2) * w, -g1 * (c1 * d.x() + s1 * d.y()) * w,
        -g2 * (c2 * d.x() + s2 * d.y()) * w, -(g1 * t1 + g2 * t2) * w, 1, from.x(), from.y(), e1 * e2;
  }
  return p(5) + p(6) * from.x() + p(7) * from.y() + p(8) * e1 * e2;
}

Sums sums_of(const Image& image, const Vec2& middle, double radius, const Unknowns& p, bool with_gram) {
  Sums s;
  const int x0 = static_cast<int>(std::ceil(middle.x() - radius)),
            x1 = static_cast<int>(std::floor(middle.x() + radius));
  const int y0 = static_cast<int>(std::ceil(middle.y() - radius)),
            y1 = static_cast<int>(std::floor(middle.y() + radius));
  Unknowns J;
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const Vec2 from(x - middle.x(), y - middle.y());
      if (from.squaredNorm() > radius * radius) continue;
      const double r = image.row(y)[x] - model_at(p, from, with_gram ? &J : nullptr);
      s.square += r * r;
      ++s.count;
      if (!with_gram) continue;
      s.A.selfadjointView<Eigen::Lower>().rankUpdate(J);
      s.a += r * J;
    }
  }
  s.A = s.A.selfadjointView<Eigen::Lower>();
  return s;
}

}  // namespace

std::optional<FittedCorner> fit_corner(const Image& image, const Vec2& start, double angle1, double angle2,
                                       double radius) {
  constexpr int kIterations = 30;
  constexpr double kEnough = 1e-4, kLeastContrast = 2, kLeastAngle = 0.2;
  constexpr double kOther = 0.12;  // of the contrast squared: what is no corner leaves more
  if (!(start.x() - radius >= 0 && start.y() - radius >= 0 && start.x() + radius <= image.width - 1 &&
        start.y() + radius <= image.height - 1))
    return std::nullopt;
  // Mean and contrast of the start from the sectors along the bisectors.
  const double between = (angle1 + angle2) / 2;
  const double v1 = sample(image, start + 0.6 * radius * Vec2(std::cos(between), std::sin(between)));
  const double v2 = sample(image, start + 0.6 * radius * Vec2(-std::sin(between), std::cos(between)));
  Unknowns p;
  p << 0, 0, angle1, angle2, 1.2, (v1 + v2) / 2, 0, 0, (v2 - v1) / 2;
  double lambda = 1e-3;
  Sums sums = sums_of(image, start, radius, p, true);
  for (int i = 0; i < kIterations; ++i) {
    Gram damped = sums.A;
    damped.diagonal() *= 1 + lambda;
    const Unknowns step = damped.ldlt().solve(sums.a);
    Unknowns next = p + step;
    next(4) = std::min(std::max(next(4), 0.3), radius);
    if (!next.allFinite()) return std::nullopt;
    const Sums tried = sums_of(image, start, radius, next, true);
    if (!(tried.square <= sums.square)) {
      lambda *= 10;
      if (lambda > 1e6) break;
      continue;
    }
    p = next;
    sums = tried;
    lambda = std::max(lambda / 10, 1e-9);
    if (step.head<2>().norm() < kEnough) break;
  }
  const double turn = std::abs(std::sin(p(2) - p(3)));
  if (!(p.head<2>().norm() < 0.5 * radius && std::abs(p(8)) > kLeastContrast && turn > kLeastAngle))
    return std::nullopt;
  const double variance = sums.square / std::max(1, sums.count - kSize);
  if (variance > kOther * p(8) * p(8)) return std::nullopt;
  const Gram C = sums.A.inverse() * variance;
  const double sigma = std::sqrt((C(0, 0) + C(1, 1)) / 2);
  if (!std::isfinite(sigma)) return std::nullopt;
  return FittedCorner{start + p.head<2>(), sigma, p(4), std::abs(p(8))};
}

}  // namespace sgrt
