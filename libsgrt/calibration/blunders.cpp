// See calibration/blunders.hpp: the least median of residuals over homographies of four corners each (Rousseeuw 1984).
#include "calibration/blunders.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/initial.hpp"
#include "core/median.hpp"
#include "core/sequence.hpp"

namespace sgrt {
namespace {

constexpr int kTries = 60;           // with a quarter of the corners wrong all of them miss once in 1e10
constexpr double kHarmless = 0.03;   // of the view's size: a start that follows so little is near enough
constexpr double kSmallest = 0.1;    // of the view's size: less may be the lens's distortion
constexpr double kOfMedian = 8;      // times the median residual
constexpr double kMostShare = 0.25;  // of the corners: more are no blunders, the view is another board's or none

std::vector<double> residuals(const Target& target, const Mat3& H, const View& view) {
  std::vector<double> lengths;
  lengths.reserve(view.index.size());
  for (std::size_t i = 0; i < view.index.size(); ++i) {
    const Vec2 at = (H * Vec2(target.points.row(view.index[i]).head<2>()).homogeneous()).hnormalized();
    const double length = (view.pixel[i] - at).norm();
    lengths.push_back(std::isfinite(length) ? length : std::numeric_limits<double>::max());
  }
  return lengths;
}

double median_of(std::vector<double> values) {
  return median(values);
}

// Half the corners lie within it of the middle, which a few blunders do not move far.
double size_of(const View& view) {
  std::vector<double> x, y, far;
  for (const Vec2& p : view.pixel) {
    x.push_back(p.x());
    y.push_back(p.y());
  }
  const Vec2 middle(median(x), median(y));
  for (const Vec2& p : view.pixel) far.push_back((p - middle).norm());
  return median(far);
}

// Four different corners; the same ones for the same try and count.
View four_of(const View& view, Sequence& sequence) {
  View four{view.camera, view.placement, {}, {}, {}, {}};
  while (four.index.size() < 4) {
    const auto i = static_cast<std::size_t>((sequence.next() >> 33) % view.index.size());
    if (std::count(four.index.begin(), four.index.end(), view.index[i]) > 0) continue;
    four.index.push_back(view.index[i]);
    four.pixel.push_back(view.pixel[i]);
    four.weight.push_back(1);
  }
  return four;
}

}  // namespace

View without_blunders(const Target& target, View view) {
  const std::optional<Mat3> of_all = homography_of(target, view);
  if (!of_all) return view;
  std::vector<double> best = residuals(target, *of_all, view);
  const double size = size_of(view);
  if (*std::max_element(best.begin(), best.end()) <= kHarmless * size) return view;
  Sequence sequence;
  for (int i = 0; i < kTries; ++i) {
    const std::optional<Mat3> H = homography_of(target, four_of(view, sequence));
    if (!H) continue;
    std::vector<double> lengths = residuals(target, *H, view);
    if (median_of(lengths) < median_of(best)) best = std::move(lengths);
  }
  const double limit = std::max(kSmallest * size, kOfMedian * median_of(best));
  const auto bad = std::count_if(best.begin(), best.end(), [&](double length) { return length > limit; });
  if (static_cast<double>(bad) > kMostShare * static_cast<double>(best.size())) return view;
  for (std::size_t i = 0; i < best.size(); ++i) view.weight[i] = best[i] > limit ? 0 : view.weight[i];
  return view;
}

}  // namespace sgrt
