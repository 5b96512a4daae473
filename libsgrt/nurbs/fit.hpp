// A smooth surface through scattered points with noise, holes and outliers: tensor-product cubic B-splines by penalised
// robust least squares, with the posterior covariance of the surface everywhere and a measure of what supports it.
// Eilers and Marx (1996); Wahba (1983); Nychka (1988); Wood, Generalized Additive Models (2017).
// docs/theory/nurbs_fit.md.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"
#include "nurbs/fit_chart.hpp"
#include "nurbs/surface.hpp"

namespace sgrt {

enum class FitSmoothing : std::int32_t { kReml = 0, kGcv = 1, kGiven = 2 };

struct NurbsFitOptions {
  FitChart chart = FitChart::kAuto;
  FitSmoothing smoothing = FitSmoothing::kReml;
  bool robust = true;
  std::optional<Vec3> axis;        // of the height field or the cylinder; need not be unit
  int control_points[2] = {0, 0};  // in u and v; 0: from the density of the points
  int max_control_points = 10000;  // in all, where they are chosen
  double lambda = 1;               // weight of the bending energy where it is given
  double tukey = 4.685;            // residuals beyond this many sigma do not count
};

// The coefficients' grid: cubic B-splines on equal cells, c[index(i, j)] for B_i(u) B_j(v). The shorter side is the
// inner one, so that the band is narrow; round a closed body u is.
struct FitGrid {
  int cells_u = 0, cells_v = 0;
  bool periodic = false;
  double hu = 1, hv = 1;  // mm, side of a cell

  int nu() const { return periodic ? cells_u : cells_u + 3; }
  int nv() const { return cells_v + 3; }
  int size() const { return nu() * nv(); }
  int index(int i, int j) const {
    if (periodic) return j * nu() + (i >= cells_u ? i - cells_u : i);
    return nu() <= nv() ? j * nu() + i : i * nv() + j;
  }
  int band_width() const { return periodic ? 4 * nu() - 1 : 3 * std::min(nu(), nv()) + 3; }
};

constexpr int kNeighbourSlots = 28;  // couplings kept of each control point: 7 in u by 4 in v

struct NurbsFit {
  Chart chart;
  FitGrid grid;
  Eigen::MatrixXd coefficients;    // grid.size() x chart.columns(), mm
  std::vector<double> covariance;  // of neighbouring coefficients, mm2: grid.size() x kNeighbourSlots
  std::vector<double> occupied;    // grid.size(): share of each basis function's weight that has points
  NurbsSurface surface;            // clamped, on [0, 1] x [0, 1]
  double conversion_error = 0;     // mm, largest found between surface and chart

  std::int64_t point_count = 0, inlier_count = 0;
  double lambda = 0;                // sum w r^2 + lambda * bending energy
  double effective_parameters = 0;  // trace of the smoother
  double noise = 0;                 // estimated sigma: mm, or in units of the points' own sigma where they have one
  double rms = 0;                   // mm along the normal, of the inliers
  bool has_sigma = false;
  int iterations = 0;

  // Beside the points of the fitted surface; NaN for absent ones.
  std::int64_t height = 0, width = 0;
  Eigen::VectorXd residual;                                              // mm along the normal, positive outside
  Eigen::VectorXd weight;                                                // robust weight, 0 to 1
  Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> parameters;  // u, v in [0, 1]
};

// Throws kInsufficientData below 16 points, kDegenerate where they do not span an area or lambda = 0 leaves control
// points free, kInvalidArgument, kLimit, kCancelled.
NurbsFit fit_nurbs(const Run& run, const Surface& surface, const NurbsFitOptions& options);

// What is known of the surface at one (u, v) of [0, 1] x [0, 1]. Derivatives in the order S_u S_v S_uu S_uv S_vv.
struct FitSample {
  Vec3 point, normal;
  Vec3 derivatives[5];
  double sigma;  // along the normal, mm
  Mat3 covariance, normal_covariance;
  Mat3 derivative_covariance[5];
  double support;  // 0: no point near; 1: points all round
};
constexpr double kSupported = 0.5;  // below: extrapolated

FitSample sample_fit(const NurbsFit& fit, double u, double v);

// Parameters of the surface point nearest to x: Gauss-Newton from x's foot in the chart.
Vec2 nearest_parameters(const NurbsFit& fit, const Vec3& x);

}  // namespace sgrt
