// What the fit starts from: the points that are there with their place in the chart, the grid of cells, and the plane
// that is taken off first. docs/theory/nurbs_fit.md, "Least squares".
#pragma once

#include <cstdint>
#include <vector>

#include "nurbs/fit_weights.hpp"

namespace sgrt {

// Throws kInvalidArgument.
void check_options(const NurbsFitOptions& options);

// Points that are there, in the chart.
struct Data {
  std::vector<std::int64_t> row;
  std::vector<ChartPoint> at;
  std::vector<double> precision;
  double correlation = 1;
};

Data data_of(const Run& run, const Surface& surface, const Chart& chart);

// About two points a cell unless given. Throws kInvalidArgument, kLimit beyond a band of 1 GiB.
FitGrid make_grid(const Chart& chart, const Data& data, const NurbsFitOptions& options);

// The weighted plane through what is fitted, taken off so that planes come back to the last digits.
Trend remove_trend(const FitGrid& grid, FitPoints& points);

}  // namespace sgrt
