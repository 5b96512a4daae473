// See laser/profile_fit.hpp; symbols of docs/theory/laser.md.
#include "laser/profile_fit.hpp"

#include <algorithm>
#include <cmath>

#include "core/eigen.hpp"

namespace sgrt {
namespace {

constexpr int kMostPixels = 401;

// The grey levels of a window round a candidate, cut at the image's border.
struct Window {
  float v[kMostPixels];
  int from, count, clipped = 0;

  Window(const Lines& lines, int line, int at, int half) {
    half = std::min(half, (kMostPixels - 1) / 2);
    from = std::max(0, at - half);
    count = std::min(lines.width(), at + half + 1) - from;
    lines.read(line, from, count, v);
    for (int i = 0; i < count; ++i) clipped += v[i] >= Lines::kClipped ? 1 : 0;
  }
  bool good(int i) const { return v[i] < Lines::kClipped; }
  // Clipped pixels as the level of the clip.
  void level(float clip) {
    float top = clip;
    if (!(clip < Lines::kClipped)) {
      top = 0;
      for (int i = 0; i < count; ++i) top = good(i) ? std::max(top, v[i]) : top;
    }
    for (int i = 0; i < count; ++i) v[i] = std::min(v[i], top);
  }
};

// Of a Gaussian: a crossing moves by the noise over the slope there, both middles together over the width.
float asymmetry_sigma(double sigma, double contrast) {
  return static_cast<float>(1.35 * sigma / contrast);
}

void set_shape(const Lines& lines, Window& w, double centre, double background, double contrast, double sigma,
               Centre& out) {
  w.level(lines.clip);
  const auto low = static_cast<float>(background);
  const float high = std::min(static_cast<float>(contrast), lines.clip - low);
  out.asymmetry = asymmetry_of(w.v, w.count, static_cast<float>(centre - w.from), out.width, low, high);
  out.asymmetry_sigma = asymmetry_sigma(sigma, contrast);
}

// Enough that is not clipped on both sides to tell the centre.
bool flanks(const Window& w, double centre, double width) {
  int left = 0, right = 0;
  for (int i = 0; i < w.count; ++i) {
    const double d = w.from + i - centre;
    if (!w.good(i) || std::abs(d) > 3.5 * width + 1) continue;
    (d < 0 ? left : right) += 1;
  }
  return left >= 2 && right >= 2;
}

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;

struct Equations {
  Mat5 N;
  Vec5 g;
  double cost;
  int count;
};

// exp(-(x - c)^2 / 2 t^2) at the pixels of the window one by one, by a recurrence of second order: three exponentials a
// window instead of one a pixel.
struct Bell {
  double value, ratio, step;
  Bell(double x, double c, double t)
      : value(std::exp(-(x - c) * (x - c) / (2 * t * t))),
        ratio(std::exp(-(2 * (x - c) + 1) / (2 * t * t))),
        step(std::exp(-1 / (t * t))) {}
  void next() {
    value *= ratio;
    ratio *= step;
  }
};

// p: centre, sigma, amplitude, background, its slope; positions relative to `origin` (eq. 6-7).
Equations equations(const Window& w, double origin, const Vec5& p, const ProfileNoise& noise) {
  Equations q{Mat5::Zero(), Vec5::Zero(), 0, 0};
  const double floor = noise.sigma * noise.sigma, per_t = 1 / p(1);
  double N[15] = {0}, g[5] = {0};
  Bell bell(w.from - origin, p(0), p(1));
  for (int i = 0; i < w.count; ++i, bell.next()) {
    if (!w.good(i)) continue;
    const double x = w.from + i - origin, u = (x - p(0)) * per_t, e = bell.value, a = p(2) * e;
    const double r = w.v[i] - (a + p(3) + p(4) * x);
    const double weight = 1 / (floor + noise.gain * std::max(a, 0.0));
    const double J[5] = {a * u * per_t, a * u * u * per_t, e, 1, x};
    for (int j = 0, at = 0; j < 5; ++j) {
      const double wj = weight * J[j];
      g[j] += wj * r;
      for (int k = j; k < 5; ++k) N[at++] += wj * J[k];
    }
    q.cost += weight * r * r;
    ++q.count;
  }
  for (int j = 0, at = 0; j < 5; ++j) {
    q.g(j) = g[j];
    for (int k = j; k < 5; ++k) q.N(j, k) = q.N(k, j) = N[at++];
  }
  return q;
}

// What noise that grows with the signal does to the centre: k_i of d centre / d v_i, and the residuals beside it, of
// which the fit leaves the share 1 - h_i, h the leverage.
void add_shot(const Window& w, double origin, const Vec5& p, const Mat5& inverse, const ProfileNoise& noise,
              Centre& out) {
  const double floor = noise.sigma * noise.sigma;
  for (int i = 0; i < w.count; ++i) {
    if (!w.good(i)) continue;
    const double x = w.from + i - origin, u = (x - p(0)) / p(1), e = std::exp(-u * u / 2), a = p(2) * e;
    Vec5 J;
    J << a * u / p(1), a * u * u / p(1), e, 1, x;
    const double r = w.v[i] - (a + p(3) + p(4) * x), weight = 1 / (floor + noise.gain * std::max(a, 0.0));
    const Vec5 effect = weight * (inverse * J);
    const double left = 1 - effect.dot(J);
    out.shot += effect(0) * effect(0) * a;
    out.excess += (r * r - left * floor) * a;
    out.power += left * a * a;
  }
}

}  // namespace

Centre centroid_centre(const Lines& lines, int line, const Candidate& c, int half, const ProfileNoise& noise) {
  Centre out;
  if (c.sum > 0) {  // the kernel has it already
    const double n = 2 * half + 1, spread = n * n * n / 12, slope = 2.0 / half / ((n + half) * (n + half));
    out.centre = c.centre;
    out.variance =
        (noise.sigma * noise.sigma * (spread + spread * spread * slope) + noise.gain * c.sum * c.width * c.width) /
        (static_cast<double>(c.sum) * c.sum);
    out.signal = c.contrast;
    out.width = c.width;
    out.asymmetry = c.asymmetry;
    out.asymmetry_sigma = asymmetry_sigma(noise.sigma, c.contrast);
    return out;
  }
  Window w(lines, line, c.at, 3 * half);
  if (c.at - 2 * half < 0 || c.at + 2 * half >= lines.width()) {
    out.reason = LineReason::kOutOfView;
    return out;
  }
  if (w.clipped > 0 && !flanks(w, c.centre, c.width)) {
    out.reason = LineReason::kSaturated;
    return out;
  }
  w.level(lines.clip);
  const auto mean = [&](int from) {
    double sum = 0;
    for (int i = 0; i < half; ++i) sum += w.v[from + i - w.from];
    return sum / half;
  };
  const double before = mean(c.at - 2 * half), after = mean(c.at + half + 1);
  const double b = (before + after) / 2, slope = (after - before) / (3 * half + 1);
  double centre = c.at, s0 = 0, v2 = 0, shot = 0, spread = 0;
  for (int pass = 0; pass < 4; ++pass) {
    const double low = centre - half - 0.5, high = centre + half + 0.5;
    double s1 = 0;
    s0 = v2 = shot = spread = 0;
    for (int i = std::max(w.from, static_cast<int>(std::floor(low + 0.5))); i < w.from + w.count && i - 0.5 < high;
         ++i) {
      const double share = std::min(high, i + 0.5) - std::max(low, i - 0.5), d = i - c.at;
      if (share <= 0) continue;
      const double v = w.v[i - w.from] - b - slope * d, off = i - centre;
      s0 += share * v;
      s1 += share * v * d;
      v2 += share * share * off * off;
      spread += share * off * off;
      shot += share * share * off * off * std::max(v, 0.0);
    }
    if (!(s0 > 0)) break;
    centre = c.at + s1 / s0;
    if (!(std::abs(centre - c.at) < half)) break;
  }
  if (!(s0 > 0 && std::abs(centre - c.at) < half)) {
    out.reason = LineReason::kNoMatch;
    return out;
  }
  const double slope_variance = 2.0 / half / ((3.0 * half + 1) * (3.0 * half + 1));
  out.centre = centre;
  out.variance = (noise.sigma * noise.sigma * (v2 + spread * spread * slope_variance) + noise.gain * shot) / (s0 * s0);
  out.signal = c.contrast;
  out.width = c.width;
  set_shape(lines, w, centre, b + slope * (centre - c.at), c.contrast, noise.sigma, out);
  return out;
}

Centre gaussian_centre(const Lines& lines, int line, const Candidate& c, const ProfileNoise& noise) {
  constexpr int kSteps = 25;
  Centre out;
  const double width = std::max(0.6, static_cast<double>(c.width)), origin = c.at;
  Window w(lines, line, c.at, std::max(4, static_cast<int>(std::ceil(5 * width))));
  if (c.at < 2 * width || c.at > lines.width() - 1 - 2 * width) out.reason = LineReason::kOutOfView;
  if (w.clipped > 0 && !flanks(w, c.at, width)) out.reason = LineReason::kSaturated;
  if (out.reason != LineReason::kNone) return out;
  Vec5 p;
  p << c.centre - origin, width, c.contrast, c.background, 0;
  Equations q = equations(w, origin, p, noise);
  double damping = 1e-4;
  bool done = false;
  for (int step = 0; step < kSteps && !done; ++step) {
    Mat5 N = q.N;
    N.diagonal() *= 1 + damping;
    const Vec5 move = N.llt().solve(q.g);
    Vec5 next = p + move;
    next(1) = std::clamp(next(1), p(1) / 2, p(1) * 2);
    Equations trial = equations(w, origin, next, noise);
    if (trial.cost <= q.cost) {
      done = std::abs(next(0) - p(0)) < 1e-3 && std::abs(next(1) - p(1)) < 1e-2 * p(1);
      p = next;
      q = std::move(trial);
      damping /= 10;
    } else {
      done = move.cwiseAbs()(0) < 1e-6;
      damping *= 10;
    }
  }
  const bool sane = p.allFinite() && std::abs(p(0)) <= 2 * width + 1 && p(1) > 0.25 && p(1) < 4 * width + 2 &&
                    p(2) > 0.3 * c.contrast && q.count > 6;
  const Mat5 inverse = q.N.llt().solve(Mat5(Mat5::Identity()));
  const double variance = sane ? inverse(0, 0) : 0;
  if (!sane || !(variance > 0)) {
    out.reason = LineReason::kNoMatch;
    return out;
  }
  out.centre = origin + p(0);
  out.variance = variance;
  out.signal = static_cast<float>(p(2));
  out.width = static_cast<float>(p(1));
  out.residual = q.cost / (q.count - 5);
  if (!(noise.gain > 0)) add_shot(w, origin, p, inverse, noise, out);
  set_shape(lines, w, out.centre, p(3) + p(4) * p(0), p(2), noise.sigma, out);
  return out;
}

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
  Window w(lines, line, c.at, std::max(4, static_cast<int>(std::ceil(4 * c.width))));
  if (w.clipped > 0 && !flanks(w, out.centre, c.width)) out.reason = LineReason::kSaturated;
  out.signal = c.contrast;
  out.width = c.width;
  set_shape(lines, w, out.centre, c.background, c.contrast, noise.sigma, out);
  return out;
}

}  // namespace sgrt
