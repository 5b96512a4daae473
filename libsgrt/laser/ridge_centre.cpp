// Steger's ridge of the smoothed image. docs/theory/laser.md, "Ridge".
#include "core/eigen.hpp"
#include "laser/profile_window.hpp"

namespace sgrt {

RidgeKernel::RidgeKernel(double sigma) : radius(static_cast<int>(std::ceil(3.5 * sigma))) {
  const auto n = static_cast<std::size_t>(2 * radius + 1);
  g0.resize(n), g1.resize(n), g2.resize(n);
  double sum0 = 0, sum1 = 0;
  for (int i = -radius; i <= radius; ++i) {
    const double g = std::exp(-i * i / (2 * sigma * sigma)) / (std::sqrt(2 * EIGEN_PI) * sigma);
    const double d = -i / (sigma * sigma) * g;
    g0[i + radius] = static_cast<float>(g);
    g1[i + radius] = static_cast<float>(d);
    g2[i + radius] = static_cast<float>((i * i / (sigma * sigma) - 1) / (sigma * sigma) * g);
    sum0 += g * g;
    sum1 += d * d;
  }
  noise_gain = sum0 * sum1;
}

Centre ridge_centre(const Lines& lines, int line, const Candidate& c, const RidgeKernel& k, const ProfileNoise& noise) {
  constexpr int kMoves = 4;
  Centre out;
  const int n = 2 * k.radius + 1;
  int x0 = c.at;
  std::vector<float> row(static_cast<std::size_t>(n));
  out.reason = LineReason::kNoMatch;
  for (int move = 0; move < kMoves; ++move) {
    if (x0 < k.radius || x0 + k.radius >= lines.width() || line < k.radius || line + k.radius >= lines.count()) {
      out.reason = LineReason::kOutOfView;
      return out;
    }
    double rx = 0, ry = 0, rxx = 0, rxy = 0, ryy = 0;
    for (int j = 0; j < n; ++j) {
      lines.read(line + j - k.radius, x0 - k.radius, n, row.data());
      float s0 = 0, s1 = 0, s2 = 0;
      for (int i = 0; i < n; ++i) {
        const float v = std::min(row[i], lines.clip < Lines::kClipped ? lines.clip : row[i]);
        s0 += k.g0[i] * v;
        s1 += k.g1[i] * v;
        s2 += k.g2[i] * v;
      }
      rx -= k.g0[j] * s1;  // a convolution turns the kernel round
      ry -= k.g1[j] * s0;
      rxx += k.g0[j] * s2;
      rxy += k.g1[j] * s1;
      ryy += k.g2[j] * s0;
    }
    // The eigenvector of the largest curvature, which a bright stripe has negative.
    const double mean = (rxx + ryy) / 2, half = (rxx - ryy) / 2, root = std::hypot(half, rxy);
    const double curvature = mean - root, angle = std::atan2(rxy, half) / 2 + EIGEN_PI / 2;
    const double nx = std::cos(angle), ny = std::sin(angle);
    if (!(curvature < 0) || std::abs(nx) < 0.25) return out;
    const double t = -(rx * nx + ry * ny) / curvature, offset = t / nx;
    if (!(std::abs(offset) < 2.0 * k.radius)) return out;
    if (std::abs(offset) > 0.6 && move + 1 < kMoves) {
      x0 += static_cast<int>(std::lround(offset));
      continue;
    }
    out.reason = LineReason::kNone;
    out.centre = x0 + offset;
    out.variance = noise.sigma * noise.sigma * k.noise_gain / (curvature * curvature * nx * nx);
    break;
  }
  if (out.reason != LineReason::kNone || std::abs(out.centre - c.at) > 3.0 * c.width + 2) {
    out.reason = LineReason::kNoMatch;
    return out;
  }
  out.signal = c.contrast;
  out.width = c.width;
  if (c.sum > 0) {  // the kernel has it already, and nothing is clipped
    out.asymmetry = c.asymmetry;
    out.asymmetry_sigma = asymmetry_sigma(noise.sigma, c.contrast);
    return out;
  }
  Window w(lines, line, c.at, std::max(4, static_cast<int>(std::ceil(4 * c.width))));
  if (w.clipped > 0 && !flanks(w, out.centre, c.width)) out.reason = LineReason::kSaturated;
  set_shape(lines, w, out.centre, c.background, c.contrast, noise.sigma, out);
  return out;
}

}  // namespace sgrt
