// From a surface to points of a chart on a grid of cells.
#include "nurbs/fit_data.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"
#include "core/median.hpp"
#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kBlock = 8192;       // points
constexpr double kPointsPerCell = 2;        // where the control points are chosen
constexpr double kMostUneven = 1e12;        // of precisions
constexpr std::int64_t kMaxBand = 1 << 27;  // numbers: 1 GiB

double variance_of(const Surface& s, std::int64_t i, const Vec3& e) {
  if (s.covariance.rows() == 0) return s.sigma.size() > 0 ? s.sigma(i) * s.sigma(i) : 1;
  const bool known = s.has_normals() && s.normal(i).allFinite();
  const double v = s.variance_along(i, known ? s.normal(i) : e);
  if (!(v > 0)) fail(Status::kInvalidArgument, "surface: a covariance that is 0 along the normal, expected > 0");
  return v;
}

// A point that weighs beyond all others would leave nothing of them in the digits of the sums.
void check_precision(const Data& d) {
  const auto sigma = [&](double precision) { return text_of(1 / std::sqrt(precision * d.correlation)) + " mm"; };
  std::vector<double> all = d.precision;
  const double usual = median(all);
  for (std::size_t k = 0; k < d.precision.size(); ++k) {
    if (std::isfinite(d.precision[k]) && d.precision[k] <= kMostUneven * usual) continue;
    fail(Status::kDegenerate, "surface: point " + std::to_string(d.row[k]) + " has a sigma of " +
                                  sigma(d.precision[k]) + ", expected a millionth of the usual one, " + sigma(usual) +
                                  ", or more");
  }
}

// Points in the gap of an open cylinder.
void drop_strays(const Chart& chart, Data& d) {
  std::size_t to = 0;
  for (std::size_t k = 0; k < d.row.size(); ++k) {
    if (!(d.at[k].u >= 0 && d.at[k].u <= chart.length_u)) continue;
    d.row[to] = d.row[k], d.at[to] = d.at[k], d.precision[to] = d.precision[k];
    ++to;
  }
  d.row.resize(to), d.at.resize(to), d.precision.resize(to);
}

// The area that holds points, mm2, by bins of eight points or more on average, at most 64 x 64.
double covered_area(const Chart& chart, const Data& data) {
  const int side = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(data.at.size()) / 8)), 1, 64);
  std::vector<char> full(static_cast<std::size_t>(side) * side, 0);
  for (const ChartPoint& p : data.at) {
    const int i = std::clamp(static_cast<int>(p.u / chart.length_u * side), 0, side - 1);
    const int j = std::clamp(static_cast<int>(p.v / chart.length_v * side), 0, side - 1);
    full[j * side + i] = 1;
  }
  return static_cast<double>(std::count(full.begin(), full.end(), 1)) / (side * side) * chart.length_u * chart.length_v;
}

}  // namespace

void check_options(const NurbsFitOptions& o) {
  const auto refuse = [](const std::string& what) { fail(Status::kInvalidArgument, "options." + what); };
  for (int k = 0; k < 2; ++k) {
    const int n = o.control_points[k];
    if (n != 0 && (n < 4 || n > 2000))
      refuse("control_points[" + std::to_string(k) + "]: " + std::to_string(n) + ", expected 4 to 2000, or 0");
  }
  if (o.max_control_points < 16 || o.max_control_points > 100'000)
    refuse("max_control_points: " + std::to_string(o.max_control_points) + ", expected 16 to 100000");
  if (!(o.lambda >= 0) || o.lambda > 1e30) refuse("lambda: " + text_of(o.lambda) + ", expected 0 to 1e30");
  if (!(o.tukey >= 2 && o.tukey <= 100)) refuse("tukey: " + text_of(o.tukey) + ", expected 2 to 100");
  if (o.axis && !(o.axis->allFinite() && o.axis->norm() > 1e-9))
    refuse("axis: not a direction, expected three finite numbers, not all 0");
}

Data data_of(const Run& run, const Surface& s, const Chart& chart) {
  Data d;
  d.correlation = std::max(1.0, s.correlation_points);
  for (std::int64_t i = 0; i < s.size(); ++i)
    if (s.present(i)) d.row.push_back(i);
  d.at.resize(d.row.size());
  d.precision.resize(d.row.size());
  const bool grid = chart.kind == FitChart::kGrid;
  const auto block = [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t k = begin; k < end; ++k) {
      const std::int64_t i = d.row[k];
      const std::int64_t grid_row = grid ? i / s.width : 0, grid_column = grid ? i % s.width : 0;
      const double column = static_cast<double>(grid_column) * chart.step[0];
      const double row = static_cast<double>(grid_row) * chart.step[1];
      d.at[k] = !grid           ? to_chart(chart, s.point(i))
                : chart.swapped ? ChartPoint{row, column, 0}
                                : ChartPoint{column, row, 0};
      const Vec3 e = grid || s.covariance.rows() == 0 ? Vec3(0, 0, 1) : base_normal(chart, d.at[k].u, d.at[k].v);
      d.precision[k] = 1 / (variance_of(s, i, e) * d.correlation);
    }
  };
  parallel_for(run, static_cast<std::int64_t>(d.row.size()), kBlock, block, "chart");
  check_precision(d);
  if (chart.kind == FitChart::kCylinder && !chart.periodic) drop_strays(chart, d);
  return d;
}

FitGrid make_grid(const Chart& chart, const Data& data, const NurbsFitOptions& o) {
  FitGrid g;
  g.periodic = chart.periodic;
  const int more = g.periodic ? 0 : 3, least = g.periodic ? 8 : 1;
  if (g.periodic && o.control_points[0] != 0 && o.control_points[0] < 8)
    fail(Status::kInvalidArgument, "options.control_points[0]: " + std::to_string(o.control_points[0]) +
                                       ", expected at least 8 round a closed body");
  double side = std::sqrt(kPointsPerCell * covered_area(chart, data) / static_cast<double>(data.row.size()));
  for (;; side *= 1.02) {
    g.cells_u = o.control_points[0]
                    ? o.control_points[0] - more
                    : std::max(least, static_cast<int>(std::min(1e4, std::ceil(chart.length_u / side))));
    g.cells_v = o.control_points[1] ? o.control_points[1] - 3
                                    : std::max(1, static_cast<int>(std::min(1e4, std::ceil(chart.length_v / side))));
    if (o.control_points[0] && o.control_points[1]) break;
    if (static_cast<std::int64_t>(g.nu()) * g.nv() <= o.max_control_points) break;
    if (side > chart.length_u && side > chart.length_v) break;
  }
  if (static_cast<std::int64_t>(g.nu()) * g.nv() * (g.band_width() + 4) > kMaxBand)
    fail(Status::kLimit, "options.control_points: " + std::to_string(g.nu()) + " x " + std::to_string(g.nv()) +
                             ", expected a band matrix of at most 1 GiB");
  g.hu = chart.length_u / g.cells_u;
  g.hv = chart.length_v / g.cells_v;
  return g;
}

Trend remove_trend(const FitGrid& g, FitPoints& p) {
  Mat3 m = Mat3::Zero();
  Trend t = Trend::Zero(3, p.columns);
  const auto row_of = [&](std::int64_t cell, std::int64_t k) {
    const auto column = cell % g.cells_u, row = cell / g.cells_u;
    return Vec3(1, g.periodic ? 0 : (static_cast<double>(column) + p.tu[k]) * g.hu,
                (static_cast<double>(row) + p.tv[k]) * g.hv);
  };
  const auto each = [&](auto&& body) {
    for (std::int64_t cell = 0; cell + 1 < static_cast<std::int64_t>(p.cell_begin.size()); ++cell)
      for (std::int64_t k = p.cell_begin[cell]; k < p.cell_begin[cell + 1]; ++k) body(k, row_of(cell, k));
  };
  each([&](std::int64_t k, const Vec3& x) {
    m += p.precision[k] * x * x.transpose();
    for (int d = 0; d < p.columns; ++d) t.col(d) += p.precision[k] * p.y[d][k] * x;
  });
  if (g.periodic) m(1, 1) = 1;
  t = m.ldlt().solve(t).eval();
  each([&](std::int64_t k, const Vec3& x) {
    for (int d = 0; d < p.columns; ++d) p.y[d][k] -= x.dot(t.col(d));
  });
  return t;
}

}  // namespace sgrt
