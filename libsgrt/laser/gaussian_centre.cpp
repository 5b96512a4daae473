// A Gaussian over a linear background by least squares: Gauss and Newton from the peak and its width, two rounds as a
// rule, damped where that does not do. docs/theory/laser.md eq. 6-8.
#include "laser/kernels.hpp"
#include "laser/profile_window.hpp"

namespace sgrt {
namespace {

constexpr int kSize =
    kernels::kGaussSize;  // centre, sigma, amplitude, background, its slope; positions from the candidate's pixel
using Vec = std::array<double, kSize>;
using Equations = kernels::GaussSums;
struct Factor {
  double L[kSize][kSize];
};
// N = L D L^T, the diagonal grown by the damping; L has ones on the diagonal, where 1 / D_jj stands.
Factor factor(const Equations& q, double damping) {
  Factor f{};
  double scaled[kSize][kSize];  // L D
  for (int j = 0; j < kSize; ++j) {
    double d = q.N[j][j] * (1 + damping);
    for (int k = 0; k < j; ++k) d -= scaled[j][k] * f.L[j][k];
    f.L[j][j] = 1 / d;
    for (int i = j + 1; i < kSize; ++i) {
      double v = q.N[i][j];
      for (int k = 0; k < j; ++k) v -= scaled[i][k] * f.L[j][k];
      scaled[i][j] = v;
      f.L[i][j] = v * f.L[j][j];
    }
  }
  return f;
}

Vec solved(const Factor& f, const double* right) {
  Vec y;
  for (int j = 0; j < kSize; ++j) {
    y[j] = right[j];
    for (int k = 0; k < j; ++k) y[j] -= f.L[j][k] * y[k];
  }
  for (int j = kSize; j-- > 0;) {
    y[j] *= f.L[j][j];
    for (int k = j + 1; k < kSize; ++k) y[j] -= f.L[k][j] * y[k];
  }
  return y;
}

bool finite(const Vec& p) {
  return std::all_of(p.begin(), p.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

Centre gaussian_centre(const Run& run, const Lines& lines, int line, const Candidate& c, const ProfileNoise& noise) {
  constexpr int kSteps = 25;
  Centre out;
  const double width = std::max(0.6, static_cast<double>(c.width)), origin = c.at;
  Window w(lines, line, c.at, std::max(4, static_cast<int>(std::ceil(5 * width))));
  if (c.at < 2 * width || c.at > lines.width() - 1 - 2 * width) out.reason = LineReason::kOutOfView;
  if (w.clipped > 0 && !flanks(w, c.at, width)) out.reason = LineReason::kSaturated;
  if (out.reason != LineReason::kNone) return out;
  Vec p = {c.centre - origin, width, c.contrast, c.background, 0};
  const bool avx2 = run.isa == Isa::kAvx2;
  const auto task = [&](const Vec& at) {
    return kernels::GaussTask{w.v,        w.count,        w.from - origin, at.data(), noise.sigma * noise.sigma,
                              noise.gain, Lines::kClipped};
  };
  const auto equations = [&](const Vec& at) {
    Equations q;
    (avx2 ? kernels::gauss_sums_avx2 : kernels::gauss_sums_baseline)(task(at), &q);
    return q;
  };
  Equations q = equations(p);
  Factor L;
  double damping = 1e-4;
  for (int step = 0; step < kSteps; ++step) {
    L = factor(q, damping);
    const Vec move = solved(L, q.g);
    Vec next = p;
    for (int j = 0; j < kSize; ++j) next[j] += move[j];
    // Steps shrink to their squares: what is left after one so small is far below the noise.
    if (damping < 1e-3 && std::abs(move[0]) < 0.02 * p[1] && std::abs(move[1]) < 0.03 * p[1]) {
      p = next;
      for (int j = 0; j < kSize; ++j) q.cost -= q.g[j] * move[j];
      break;
    }
    next[1] = std::clamp(next[1], p[1] / 2, p[1] * 2);
    Equations trial = equations(next);
    if (trial.cost <= q.cost) {
      p = next;
      q = trial;
      damping /= 10;
    } else {
      if (std::abs(move[0]) < 1e-6) break;
      damping *= 10;
    }
  }
  const int count = w.count - w.clipped;
  const bool sane = finite(p) && std::abs(p[0]) <= 2 * width + 1 && p[1] > 0.25 && p[1] < 4 * width + 2 &&
                    p[2] > 0.3 * c.contrast && count > 6;
  if (damping > 1e-3) L = factor(q, 0);  // else the last one will do
  constexpr double kFirst[kSize] = {1};
  const Vec top = solved(L, kFirst);
  if (!sane || !(top[0] > 0)) {
    out.reason = LineReason::kNoMatch;
    return out;
  }
  out.centre = origin + p[0];
  out.variance = out.fit.variance = top[0];
  out.signal = static_cast<float>(p[2]);
  out.width = static_cast<float>(p[1]);
  out.fit.residual = q.cost / (count - kSize);
  if (!(noise.gain > 0)) {
    kernels::GaussShot sums;
    (avx2 ? kernels::gauss_shot_avx2 : kernels::gauss_shot_baseline)(task(p), L.L, top.data(), &sums);
    out.fit.shot = sums.shot, out.fit.excess = sums.excess, out.fit.power = sums.power;
  }
  if (c.sum > 0) {
    out.asymmetry = c.asymmetry;
    out.asymmetry_sigma = asymmetry_sigma(noise.sigma, p[2]);
    return out;
  }
  set_shape(lines, w, out.centre, p[3] + p[4] * p[0], p[2], noise.sigma, out);
  return out;
}

}  // namespace sgrt
