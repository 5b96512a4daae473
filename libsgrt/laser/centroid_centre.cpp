// The grey centroid over a local background, where the kernel has not found it already. docs/theory/laser.md eq. 1-3.
#include "laser/profile_window.hpp"

namespace sgrt {

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
  level(w.v, w.count, lines.clip);
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

}  // namespace sgrt
