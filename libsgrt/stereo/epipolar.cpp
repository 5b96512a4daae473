#include "stereo/epipolar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/eigen.hpp"
#include "core/median.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kAsked = 250;  // windows: the error of their mean is below a thousandth of a pixel

struct Off {
  double value = kNan, variance = kNan;
};

// One least-squares step of (row offset, plane of disparities, gain, offset) at the warp: g = f - e f_y + f_x (d + a i
// + b j), up to brightness.
Off off_row(const kernels::Plane& left, const WarpWork& w, int x0, int y0, int half, float damping) {
  if (x0 < half || y0 < half + 2 || x0 + half >= left.width || y0 + half + 2 >= left.height) return {};
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
  Vec6 rhs = Vec6::Zero();
  double n = 0, gg = 0;
  const double origin_f = left.value[static_cast<std::size_t>(y0) * left.width + x0];
  const double origin_g = w.g[static_cast<std::size_t>(y0) * w.stride + x0];
  for (int j = -half; j <= half; ++j)
    for (int i = -half; i <= half; ++i) {
      const std::size_t at = static_cast<std::size_t>(y0 + j) * left.width + x0 + i;
      const std::size_t to_warp = static_cast<std::size_t>(y0 + j) * w.stride + x0 + i;
      if (w.keep[to_warp] == 0) continue;
      const float* f = left.value + at;
      const std::ptrdiff_t row = left.width;
      const double fy = (8.0 * (f[row] - f[-row]) - (f[2 * row] - f[-2 * row])) / 12, fx = left.gradient[at];
      Vec6 J;
      J << -fy, fx, fx * i, fx * j, f[0] - origin_f, 1;
      const double g = w.g[to_warp] - origin_g;
      H.selfadjointView<Eigen::Lower>().rankUpdate(J);
      rhs += J * g;
      n += 1, gg += g * g;
    }
  if (n < 0.8 * (2 * half + 1) * (2 * half + 1)) return {};
  H = Eigen::Matrix<double, 6, 6>(H.selfadjointView<Eigen::Lower>());
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> solver(H);
  const Vec6 p = solver.solve(rhs);
  const Vec6 unit = solver.solve(Vec6::Unit(0));
  const double gain = p[4], residual = (gg - p.dot(rhs)) / (n - 6);
  if (!(gain > 0) || !(unit[0] > 0) || !(residual >= 0)) return {};
  return {p[0] / gain, residual * unit[0] / (gain * gain * damping)};
}

}  // namespace

EpipolarCheck check_epipolar(const Run& run, const RectifiedImage& left, const WarpWork& warped, const Grid& grid,
                             int window, float damping, const MatchField& field, EpipolarWork& work) {
  // A lattice no finer than the window, so that the answers are independent.
  const double area = static_cast<double>(grid.size()) * grid.stride * grid.stride;
  const int apart = std::max(window, static_cast<int>(std::sqrt(area / kAsked)));
  const int step = std::max(1, apart / grid.stride);
  work.at.clear();
  for (int j = step / 2; j < grid.height; j += step)
    for (int i = step / 2; i < grid.width; i += step) {
      const std::int64_t k = static_cast<std::int64_t>(j) * grid.width + i;
      if (field.reason[k] == Reason::kNone) work.at.push_back(k);
    }
  const auto count = static_cast<std::int64_t>(work.at.size());
  work.off.assign(work.at.size(), kNan), work.variance.assign(work.at.size(), kNan);
  const kernels::Plane plane = left.plane();
  parallel_for(
      run, count, 32,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t k = begin; k < end; ++k) {
          const std::int64_t at = work.at[k];
          const Off off = off_row(plane, warped, grid.x(at), grid.y(at), window / 2, damping);
          work.off[k] = off.value, work.variance[k] = off.variance;
        }
      },
      "checking");
  EpipolarCheck check{0, kNan, kNan, kNan};
  work.sorted.clear();
  for (const double e : work.off)
    if (e == e) work.sorted.push_back(e);
  check.count = static_cast<std::int64_t>(work.sorted.size());
  if (check.count < 20) return check;
  check.median = median(work.sorted);
  // The windows' own scatter, whatever its cause, tells how well the median is known.
  for (double& e : work.sorted) e = std::abs(e - check.median);
  const double scatter = 1.4826 * median(work.sorted);
  check.sigma = 1.2533 * scatter / std::sqrt(static_cast<double>(check.count));
  // Over the image: a turned or bent rig lies off in both directions. Windows beyond 5 scatters are mismatches.
  double sum = 0, n = 0;
  for (std::int64_t k = 0; k < count; ++k) {
    const double e = work.off[k];
    if (!(std::abs(e - check.median) <= 5 * scatter)) continue;
    sum += e * e - work.variance[k], n += 1;
  }
  check.rms = n > 0 ? std::sqrt(std::max(0.0, sum / n)) : kNan;
  return check;
}

}  // namespace sgrt
