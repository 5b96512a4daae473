// Residuals along the skin's normal and robust weights from them: Huber's, which are convex, then Tukey's, which let an
// outlier go altogether; the scale is the median absolute deviation. Huber and Ronchetti, Robust Statistics (2009).
// docs/theory/nurbs_fit.md eq. 14-17.
#pragma once

#include <vector>

#include "nurbs/fit_system.hpp"

namespace sgrt {

// What is fitted is y less trend(0) + trend(1) u + trend(2) v, a column each.
using Trend = Eigen::Matrix<double, 3, Eigen::Dynamic>;

struct Residuals {
  std::vector<double> z;       // along the normal, in the points' own sigma (mm without)
  std::vector<double> cosine;  // between the normal and what is fitted
};

void residuals(const Run& run, const Chart& chart, const FitGrid& grid, const FitPoints& points, const Trend& trend,
               const Eigen::MatrixXd& c, double correlation, Residuals& out);

// 1.4826 x the median of |z| over the points with robust[k] > 0.
double mad(const Residuals& residuals, const std::vector<double>& robust);

// Points of cells about which (3 x 3 cells) there are less than a seventh as many as about the median point: strays
// that no good point contradicts, in a hole or beyond the border. Rows of `points`.
std::vector<std::size_t> lonely(const FitGrid& grid, const FitPoints& points);

enum class Robust { kNone, kHuber, kTukey };

// robust[k] from z, and points.weight = precision x cosine^2 x robust. Returns the number of samples that count.
double reweigh(FitPoints& points, const Residuals& residuals, Robust how, double scale, double tukey,
               double correlation, std::vector<double>& robust);

// By how much the variance of a Tukey estimate exceeds what its weights say: E psi^2 E w / (E psi')^2.
double tukey_inflation(const Residuals& residuals, double scale, double tukey);

}  // namespace sgrt
