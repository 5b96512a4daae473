// Candidates for corners, see calibration/saddle.hpp: the ring response of Bennett and Lasenby, "ChESS - quick and
// robust detection of chess-board features" (2014), its maxima, and at each the four changes between dark and bright
// along the ring.
#include "calibration/saddle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kRing = 16, kFine = 64;

struct Offset {
  int x, y;
};

std::array<Offset, kRing> ring_of(double radius) {
  std::array<Offset, kRing> ring;
  for (int i = 0; i < kRing; ++i) {
    const double a = 2 * kPi * i / kRing;
    ring[i] = {static_cast<int>(std::lround(radius * std::cos(a))),
               static_cast<int>(std::lround(radius * std::sin(a)))};
  }
  return ring;
}

// The ChESS response: opposite points of the ring are alike, points at right angles are not, and the middle is their
// mean.
Image response_of(const Image& image, double radius) {
  const std::array<Offset, kRing> ring = ring_of(radius);
  const int border = static_cast<int>(std::ceil(radius)) + 1;
  Image out;
  out.resize(image.height, image.width);
  std::fill(out.pixels.begin(), out.pixels.end(), 0.0F);
  std::array<std::ptrdiff_t, kRing> step;
  for (int i = 0; i < kRing; ++i) step[i] = static_cast<std::ptrdiff_t>(ring[i].y) * image.width + ring[i].x;
  for (int y = border; y < image.height - border; ++y) {
    const float* in = image.row(y);
    float* to = out.row(y);
    for (int x = border; x < image.width - border; ++x) {
      std::array<float, kRing> v;
      float sum = 0;
      for (int i = 0; i < kRing; ++i) sum += v[i] = in[x + step[i]];
      float sums = 0, differences = 0;
      for (int i = 0; i < 4; ++i) sums += std::abs(v[i] + v[i + 8] - v[i + 4] - v[i + 12]);
      for (int i = 0; i < 8; ++i) differences += std::abs(v[i] - v[i + 8]);
      const float local = (in[x] + in[x - 1] + in[x + 1] + in[x - image.width] + in[x + image.width]) / 5;
      to[x] = sums - differences - 16 * std::abs(local - sum / kRing);
    }
  }
  return out;
}

bool is_maximum(const Image& r, int x, int y, int reach) {
  const float here = r.row(y)[x];
  for (int j = -reach; j <= reach; ++j) {
    const float* row = r.row(y + j) + x;
    for (int i = -reach; i <= reach; ++i) {
      if (row[i] > here || (row[i] == here && (j < 0 || (j == 0 && i < 0)))) return false;
    }
  }
  return true;
}

// The four changes along a fine ring give both edges; nothing where there are not four, or opposite ones are not.
bool set_edges(const Image& image, double radius, Saddle& saddle) {
  constexpr double kBent = 0.45;  // rad between an edge and its continuation
  std::array<double, kFine> v;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (int i = 0; i < kFine; ++i) {
    const double a = 2 * kPi * i / kFine;
    v[i] = sample(image, saddle.at + radius * Vec2(std::cos(a), std::sin(a)));
    if (!std::isfinite(v[i])) return false;
    low = std::min(low, v[i]);
    high = std::max(high, v[i]);
  }
  const double middle = (low + high) / 2;
  std::vector<double> falls, rises;
  for (int i = 0; i < kFine; ++i) {
    const double a = v[i] - middle, b = v[(i + 1) % kFine] - middle;
    if ((a > 0) == (b > 0)) continue;
    (a > 0 ? falls : rises).push_back(2 * kPi * (i + a / (a - b)) / kFine);
  }
  if (falls.size() != 2 || rises.size() != 2) return false;
  const auto edge = [&](const std::vector<double>& pair, double& angle) {
    const double bend = pair[1] - pair[0] - kPi;
    angle = std::fmod(pair[0] + bend / 2 + kPi, kPi);
    return std::abs(bend) < kBent;
  };
  saddle.strength = high - low;
  return edge(falls, saddle.angle[0]) && edge(rises, saddle.angle[1]);
}

// The stationary point of the quadric through the 5 x 5 neighbours: the saddle of a blurred corner.
Vec2 quadric_saddle(const Image& image, int x, int y) {
  double gx = 0, gy = 0, xx = 0, xy = 0, yy = 0;
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) {
      const double v = image.row(y + j)[x + i];
      gx += v * i / 50;
      gy += v * j / 50;
      xx += v * (i * i - 2) / 35;
      yy += v * (j * j - 2) / 35;
      xy += v * i * j / 100;
    }
  }
  const double det = xx * yy - xy * xy;
  if (!(det < 0)) return {x, y};
  const Vec2 off(-(yy * gx - xy * gy) / det, -(xx * gy - xy * gx) / det);
  return off.norm() < 2 ? Vec2(x + off.x(), y + off.y()) : Vec2(x, y);
}

}  // namespace

double sample(const Image& image, const Vec2& at) {
  const double fx = std::floor(at.x()), fy = std::floor(at.y());
  if (!(fx >= 0 && fy >= 0 && fx < image.width - 1 && fy < image.height - 1))
    return std::numeric_limits<double>::quiet_NaN();
  const int x = static_cast<int>(fx), y = static_cast<int>(fy);
  const double a = at.x() - fx, b = at.y() - fy;
  const float *r = image.row(y) + x, *s = image.row(y + 1) + x;
  return (1 - b) * ((1 - a) * r[0] + a * r[1]) + b * ((1 - a) * s[0] + a * s[1]);
}

std::vector<Saddle> find_saddles(const Image& image, double radius, std::size_t most) {
  constexpr float kOfBest = 0.06F;
  const int reach = std::max(2, static_cast<int>(radius / 2)), border = static_cast<int>(std::ceil(radius)) + 3 + reach;
  if (image.height <= 2 * border || image.width <= 2 * border) return {};
  const Image response = response_of(image, radius);
  struct Peak {
    float value;
    int x, y;
  };
  std::vector<Peak> peaks;
  for (int y = border; y < image.height - border; ++y) {
    for (int x = border; x < image.width - border; ++x) {
      if (response.row(y)[x] > 0 && is_maximum(response, x, y, reach)) peaks.push_back({response.row(y)[x], x, y});
    }
  }
  std::sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) {
    return a.value != b.value ? a.value > b.value : a.y != b.y ? a.y < b.y : a.x < b.x;
  });
  std::vector<Saddle> saddles;
  for (const Peak& peak : peaks) {
    // Some of the strongest may be reflections: the tenth sets the scale.
    if (saddles.size() >= most || peak.value < kOfBest * peaks[std::min<std::size_t>(9, peaks.size() - 1)].value) break;
    Saddle saddle{quadric_saddle(image, peak.x, peak.y), {}, 0};
    if (set_edges(image, radius, saddle)) saddles.push_back(saddle);
  }
  return saddles;
}

}  // namespace sgrt
