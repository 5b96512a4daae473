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

// The scale by which each cell's residuals are judged: the global one, or that of the cell and its neighbours where it
// is clearly larger. There the surface does not follow the points, and a point that its neighbours confirm is no
// outlier.
std::vector<double> local_scales(const FitGrid& grid, const FitPoints& points, const Residuals& residuals,
                                 double scale);

enum class Robust { kNone, kHuber, kTukey };

// robust[k] from z, and points.weight = precision x cosine^2 x robust. scales: a number a cell. Returns the number of
// samples that count.
double reweigh(FitPoints& points, const Residuals& residuals, Robust how, const std::vector<double>& scales,
               double tukey, double correlation, std::vector<double>& robust);

// How Tukey's estimate answers to the noise of its inliers: the means of psi' and of psi^2, in units of the scale.
// points.weight becomes precision x cosine^2 x psi' (its mean), less where the local scale is larger.
struct Response {
  double slope = 1, square = 1;
};
Response tukey_response(FitPoints& points, const Residuals& residuals, double scale, const std::vector<double>& scales,
                        double tukey, const std::vector<double>& robust);

}  // namespace sgrt
