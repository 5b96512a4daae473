// How a chart is laid through points of which some are wrong. Only the fit of f has to be robust: a chart that lies a
// little askew is as good.
#include "nurbs/fit_chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::int64_t kSample = 20'000;  // points that decide on a chart
constexpr double kOpenAngle = 15 * kPi / 180;
constexpr double kMaxSphereAngle = 0.9 * kPi;
constexpr double kSteep = 1;  // a height field rises by up to this a mm

struct Sample {
  std::vector<std::int64_t> index;
  Vec3 mean, variance;  // of the principal axes, largest last
  Mat3 axes;
};

std::vector<std::int64_t> sample_of(const Surface& s) {
  std::vector<std::int64_t> present;
  const std::int64_t stride = std::max<std::int64_t>(1, s.size() / kSample);
  for (std::int64_t i = 0; i < s.size(); i += stride)
    if (s.present(i)) present.push_back(i);
  return present;
}

Sample principal_axes(const Surface& s) {
  Sample r;
  r.index = sample_of(s);
  r.mean.setZero();
  for (const auto i : r.index) r.mean += s.point(i);
  r.mean /= static_cast<double>(std::max<std::size_t>(1, r.index.size()));
  Mat3 m = Mat3::Zero();
  for (const auto i : r.index) m += (s.point(i) - r.mean) * (s.point(i) - r.mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(
      Mat3(m / static_cast<double>(std::max<std::size_t>(1, r.index.size()))));
  r.variance = eigen.eigenvalues();
  r.axes = eigen.eigenvectors();
  // A spread of a millionth of the length across a line is rounding.
  if (!(r.variance(1) > 1e-12 * r.variance(2)) || !(r.variance(2) > 0))
    fail(Status::kDegenerate, "surface: its points lie on a line or in one place, expected an area");
  return r;
}

// The sum of the outward normals, or nothing where there are too few.
std::optional<Vec3> mean_normal(const Surface& s, const Sample& sample) {
  if (!s.has_normals()) return {};
  Vec3 sum = Vec3::Zero();
  for (const auto i : sample.index)
    if (s.normal(i).allFinite()) sum += s.normal(i);
  if (!(sum.norm() > 0.2 * static_cast<double>(sample.index.size()))) return {};
  return sum.normalized();
}

// Upwards, above the couch; what lies level turns to its largest coordinate.
Vec3 upwards(const Vec3& e) {
  Vec3::Index k = 2;
  if (std::abs(e(2)) < 1e-6) e.cwiseAbs().maxCoeff(&k);
  return e(k) < 0 ? Vec3(-e) : e;
}

// u, v right-handed with e, so turned that the smallest rectangle holds the points; v along its longer side.
Mat3 frame_about(const Surface& s, const Vec3& e, const Sample& sample) {
  constexpr int kTurns = 36;
  const Vec3 start = Vec3(std::abs(e.x()) < 0.9 ? Vec3(Vec3::UnitX()) : Vec3(Vec3::UnitY())).cross(e).normalized();
  Mat3 best;
  double least = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < kTurns; ++turn) {
    const double angle = 0.5 * kPi * turn / kTurns;
    const Vec3 x = std::cos(angle) * start + std::sin(angle) * e.cross(start), y = e.cross(x);
    double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
    for (const auto i : sample.index) {
      const double p[2] = {x.dot(s.point(i)), y.dot(s.point(i))};
      for (int k = 0; k < 2; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
    }
    const double a = high[0] - low[0], b = high[1] - low[1];
    if (!(a * b < (1 - 1e-9) * least)) continue;
    least = a * b;
    best.col(1) = upwards(a > b ? x : y);
  }
  best.col(2) = e;
  best.col(0) = best.col(1).cross(e);
  return best;
}

Chart plane_chart(const Surface& s, const Sample& sample, const std::optional<Vec3>& axis) {
  const auto normal = mean_normal(s, sample);
  Chart c;
  c.kind = FitChart::kPlane;
  c.origin = sample.mean;
  c.axes = frame_about(s, axis ? *axis : normal ? *normal : upwards(sample.axes.col(0)), sample);
  return c;
}

// Least squares of |x|^2 = 2 c.x + k in the space of the columns of `span` (Kasa 1976).
struct Round {
  Vec3 centre;
  double radius;
  double residual;  // RMS, mm
};
Round fit_round(const Surface& s, const Sample& sample, const Eigen::Matrix<double, 3, Eigen::Dynamic>& span) {
  const Eigen::Index d = span.cols();
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(d + 1, d + 1);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(d + 1), row(d + 1);
  for (const auto i : sample.index) {
    row.head(d) = span.transpose() * (s.point(i) - sample.mean);
    row(d) = 1;
    b += row * row.head(d).squaredNorm();
    m += row * row.transpose();
  }
  const Eigen::VectorXd x = m.ldlt().solve(b);
  Round r;
  r.centre = sample.mean + span * (0.5 * x.head(d));
  r.radius = std::sqrt(std::max(0.0, x(d) + 0.25 * x.head(d).squaredNorm()));
  double sum = 0;
  for (const auto i : sample.index) {
    const double off = (span.transpose() * (s.point(i) - r.centre)).norm() - r.radius;
    sum += off * off;
  }
  r.residual = std::sqrt(sum / static_cast<double>(sample.index.size()));
  return r;
}

void check_round(const Round& r, const Sample& sample, const char* what) {
  if (std::isfinite(r.radius) && r.radius > 0 && r.radius < 5 * std::sqrt(sample.variance.sum())) return;
  fail(Status::kDegenerate, std::string("surface: too flat for a ") + what + ", fit it as a height field");
}

// Columns: two across the axis, and the axis.
Mat3 frame_of_axis(const Vec3& axis) {
  Mat3 m;
  m.col(2) = axis;
  m.col(0) = axis.unitOrthogonal();
  m.col(1) = axis.cross(m.col(0));
  return m;
}

// The direction that the normals avoid; without normals the principal axis about which the points are roundest.
Vec3 cylinder_axis(const Surface& s, const Sample& sample) {
  if (s.has_normals()) {
    Mat3 m = Mat3::Zero();
    for (const auto i : sample.index)
      if (s.normal(i).allFinite()) m += s.normal(i) * s.normal(i).transpose();
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(m);
    if (eigen.eigenvalues()(1) > 2 * eigen.eigenvalues()(0)) return eigen.eigenvectors().col(0);
  }
  Vec3 best = sample.axes.col(2);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 2; k >= 0; --k) {
    const Mat3 m = frame_of_axis(sample.axes.col(k));
    const Round r = fit_round(s, sample, m.leftCols<2>());
    if (std::isfinite(r.residual) && r.residual < 0.8 * least) least = r.residual, best = sample.axes.col(k);
  }
  return best;
}

// Turns angle 0 to the middle of the points and decides whether they go all round. Outliers stray into the gap, so a
// bin with few points is empty.
void cut_open(Chart& c, const Surface& s, const Sample& sample) {
  constexpr int kBins = 144;
  std::array<int, kBins> count{};
  for (const auto i : sample.index) {
    const Vec3 p = c.axes.transpose() * (s.point(i) - c.origin);
    ++count[std::min(kBins - 1, static_cast<int>((std::atan2(p.y(), p.x()) + kPi) / (2 * kPi) * kBins))];
  }
  const int few = static_cast<int>(sample.index.size()) / (10 * kBins);
  int gap = 0, gap_end = 0, run = 0;  // the longest run of empty bins
  for (int k = 0; k < 2 * kBins; ++k) {
    run = count[k % kBins] <= few ? std::min(run + 1, kBins) : 0;
    if (run > gap) gap = run, gap_end = k % kBins;
  }
  const double open = 2 * kPi * gap / kBins;
  c.periodic = open < kOpenAngle;
  const double middle = c.periodic ? 0 : 2 * kPi * (gap_end + 1 - 0.5 * gap) / kBins;  // opposite the gap
  const Vec3 x = std::cos(middle) * c.axes.col(0) + std::sin(middle) * c.axes.col(1);
  c.axes.col(0) = x;
  c.axes.col(1) = c.axes.col(2).cross(x);
  c.length_u = c.radius * (2 * kPi - (c.periodic ? 0 : open));
  c.u0 = -0.5 * c.length_u;
}

Chart cylinder_chart(const Surface& s, const Sample& sample, const std::optional<Vec3>& axis) {
  Chart c;
  c.kind = FitChart::kCylinder;
  c.axes = frame_of_axis(axis ? *axis : upwards(cylinder_axis(s, sample)));
  const Round r = fit_round(s, sample, c.axes.leftCols<2>());
  check_round(r, sample, "cylinder");
  c.origin = r.centre;
  c.radius = r.radius;
  cut_open(c, s, sample);
  return c;
}

Chart sphere_chart(const Surface& s, const Sample& sample) {
  Chart c;
  c.kind = FitChart::kSphere;
  const Round r = fit_round(s, sample, Mat3::Identity());
  check_round(r, sample, "sphere");
  c.origin = r.centre;
  c.radius = r.radius;
  Vec3 sum = Vec3::Zero();
  for (const auto i : sample.index) sum += (s.point(i) - c.origin).normalized();
  c.axes = frame_about(s, sum.norm() > 0 ? Vec3(sum.normalized()) : Vec3(Vec3::UnitZ()), sample);
  return c;
}

// u0, v0 and the lengths from all points.
void set_domain(Chart& c, const Surface& s) {
  double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
  const bool round = c.kind == FitChart::kCylinder;  // which has its angles
  Chart from_zero = c;
  from_zero.u0 = from_zero.v0 = 0, from_zero.periodic = false;
  for (std::int64_t i = 0; i < s.size(); ++i) {
    if (!s.present(i)) continue;
    const ChartPoint p = to_chart(from_zero, s.point(i));
    low[0] = std::min(low[0], p.u), high[0] = std::max(high[0], p.u);
    low[1] = std::min(low[1], p.v), high[1] = std::max(high[1], p.v);
  }
  if (!round) c.u0 = low[0], c.length_u = high[0] - low[0];
  c.v0 = low[1];
  c.length_v = high[1] - low[1];
  if (!(c.length_u > 1e-6 * c.length_v) || !(c.length_v > 1e-6 * c.length_u))
    fail(Status::kDegenerate, "surface: seen along the chart's axis its points lie on a line, expected an area");
  if (c.kind == FitChart::kSphere && std::max({-low[0], -low[1], high[0], high[1]}) > kMaxSphereAngle * c.radius)
    fail(Status::kDegenerate, "surface: closed all round, expected a part of a sphere; fit it as a cylinder");
}

// How steep f is in a chart: 90 % of the bins rise by less than this a mm. Where the body folds over, bins hold both of
// its sides. A bin holds about twenty points, of which a fifth at either end may be outliers.
double steepness(const Chart& c, const Surface& s, const Sample& sample) {
  const int side = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(sample.index.size()) / 20)), 6, 32);
  const double cell = std::max(c.length_u, c.length_v) / side * 1.0001;
  std::vector<std::vector<double>> bins(static_cast<std::size_t>(side) * side);
  for (const auto i : sample.index) {
    const ChartPoint p = to_chart(c, s.point(i));
    if (!(p.u >= 0 && p.u <= c.length_u)) continue;
    bins[static_cast<int>(p.v / cell) * side + static_cast<int>(p.u / cell)].push_back(p.f);
  }
  std::vector<double> rises;
  for (auto& f : bins) {
    if (f.size() < 8) continue;
    std::sort(f.begin(), f.end());
    rises.push_back((f[f.size() * 4 / 5] - f[f.size() / 5]) / (0.6 * cell));
  }
  if (rises.empty()) return 0;
  std::sort(rises.begin(), rises.end());
  return rises[rises.size() * 9 / 10];
}

Chart best_chart(const Surface& s, const Sample& sample, const std::optional<Vec3>& axis) {
  Chart best = plane_chart(s, sample, axis);
  set_domain(best, s);
  double least = steepness(best, s, sample);
  if (least < kSteep) return best;
  for (const FitChart kind : {FitChart::kCylinder, FitChart::kSphere}) {
    try {
      Chart c = kind == FitChart::kCylinder ? cylinder_chart(s, sample, axis) : sphere_chart(s, sample);
      set_domain(c, s);
      const double steep = steepness(c, s, sample);
      if (steep < least) least = steep, best = c;
    } catch (const Error& error) {
      if (error.status() != Status::kDegenerate) throw;
    }
  }
  return best;
}

}  // namespace

Chart make_chart(const Run& run, const Surface& s, FitChart kind, const std::optional<Vec3>& axis) {
  run.poll(0, "chart");
  const Sample sample = principal_axes(s);
  if (kind == FitChart::kGrid) return grid_chart(s);
  if (kind == FitChart::kAuto) return best_chart(s, sample, axis);
  Chart c = kind == FitChart::kPlane      ? plane_chart(s, sample, axis)
            : kind == FitChart::kCylinder ? cylinder_chart(s, sample, axis)
                                          : sphere_chart(s, sample);
  set_domain(c, s);
  return c;
}

}  // namespace sgrt
