// The fit from start to end: chart, cells, trend, weights and smoothing in turn, result.
#include "nurbs/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "nurbs/fit_data.hpp"
#include "nurbs/fit_result.hpp"
#include "nurbs/fit_smoothing.hpp"
#include "nurbs/fit_weights.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kMinPoints = 16;
constexpr int kHuberSteps = 4, kTukeySteps = 8, kAdaptSteps = 2;
constexpr double kSettled = 1e-3;             // relative change of the scale
constexpr double kLambdaStep = 0.05;          // relative, of the derivative that splits noise from bias
constexpr double kWide = 2.0, kNarrow = 0.7;  // steps in log lambda
constexpr double kFar = 1e3;                  // times the first lambda: look there again
constexpr double kLeastScale = 1e-9;          // of the residuals, over that of the first solution
constexpr double kLeastCount = 4;             // independent points: one more than a plane needs
constexpr double kMostFollowed = 0.95;        // effective parameters over points that count

struct State {
  std::vector<double> stiffness;
  Band energy;
  FitPoints points;
  Trend trend;
  Residuals residuals;
  std::vector<double> robust, scales;  // a point, a cell
  Solution solution;
  double count = 0, scale = 0;
  int iterations = 0;
};

// Weights from the residuals in turn with solutions; lambda, and where it weighs less, from each state of the weights.
class Iteration {
 public:
  Iteration(const Run& run, const Chart& chart, const FitGrid& grid, const NurbsFitOptions& o, double correlation,
            State& s)
      : chart_(chart), o_(o), correlation_(correlation), s_(s), smoother_{run, grid, s.energy, o.smoothing, o.lambda} {}

  void plain() {
    step(Robust::kNone, 0);
    adaptively(Robust::kNone, kWide);
  }

  void robust() {
    lonely_ = lonely(smoother_.grid, s_.points);
    step(Robust::kNone, 0);
    for (int i = 0; i + 1 < kHuberSteps; ++i) step(Robust::kHuber, 0);
    step(Robust::kHuber, kWide);
    for (int i = 0; i < kTukeySteps; ++i) {
      const double before = s_.scale;
      step(Robust::kTukey, 0);
      if (i >= 2 && std::abs(s_.scale - before) < kSettled * before) break;
    }
    adaptively(Robust::kTukey, kNarrow);
  }

  // What the posterior is made of: the covariance of the coefficients and its noise, for noise of the variance 1.
  struct Posterior {
    Band inverse, stiffer;
    double share, inflation;
  };
  Posterior posterior(double variance) {
    Response response;
    if (o_.robust) {
      response = tukey_response(s_.points, s_.residuals, s_.scale, s_.scales, o_.tukey, s_.robust);
      normal_ = normal_equations(smoother_.run, smoother_.grid, s_.points);
    }
    Smoother given = smoother_;
    given.method = FitSmoothing::kGiven;
    const double lambda = s_.solution.lambda, inflation = response.square / response.slope;
    const Solution now = solve_at(given, normal_, s_.count, lambda);
    const Solution stiffer = solve_at(given, normal_, s_.count, lambda * (1 + kLambdaStep));
    const double share = bias_share(given, normal_, now.factor, lambda, s_.solution.c, variance * inflation);
    return {inverse_band(smoother_.run, now.factor), inverse_band(smoother_.run, stiffer.factor), share, inflation};
  }

 private:
  // One solution with new weights; searched: lambda anew, in steps of this size.
  void step(Robust how, double searched) {
    if (s_.residuals.z.empty()) {
      s_.robust.assign(s_.points.row.size(), 1.0);
      s_.count = static_cast<double>(s_.points.size()) / correlation_;
    } else {
      s_.count = reweigh(s_.points, s_.residuals, how, s_.scales, o_.tukey, correlation_, s_.robust);
    }
    for (const std::size_t k : lonely_) {
      s_.count -= s_.robust[k] / correlation_;
      s_.robust[k] = s_.points.weight[k] = 0;
    }
    if (!(s_.count >= kLeastCount))
      fail(Status::kInsufficientData, "surface: its points that count are worth " + text_of(s_.count) +
                                          " independent ones (correlation_points " + text_of(correlation_) +
                                          "), expected at least 4");
    normal_ = normal_equations(smoother_.run, smoother_.grid, s_.points);
    search(searched);
    residuals(smoother_.run, chart_, smoother_.grid, s_.points, s_.trend, s_.solution.c, correlation_, s_.residuals);
    // Control points that follow half of the points exactly would drive it to 0 from step to step.
    s_.scale = std::max(mad(s_.residuals, s_.robust), kLeastScale * first_scale_);
    if (first_scale_ == 0) first_scale_ = s_.scale;
    if (o_.robust)
      s_.scales = local_scales(smoother_.grid, s_.points, s_.residuals, s_.scale);
    else
      s_.scales.assign(s_.stiffness.size(), s_.scale);
    ++s_.iterations;
  }

  void search(double width) {
    const bool given = o_.smoothing == FitSmoothing::kGiven;
    const double fresh = 0.1 * balanced_lambda(normal_, s_.energy);
    const double start = given ? o_.lambda : s_.solution.lambda > 0 ? s_.solution.lambda : fresh;
    s_.solution = given || width == 0 ? solve_at(smoother_, normal_, s_.count, start)
                                      : choose(smoother_, normal_, s_.count, start, width);
    // A small ripple on a large plane: outliers may have led to the plane, which is a minimum too.
    if (!given && width > 0 && s_.solution.lambda > kFar * fresh) {
      Solution softer = choose(smoother_, normal_, s_.count, fresh, kWide);
      if (softer.score < s_.solution.score) s_.solution = std::move(softer);
    }
    if (s_.solution.c.size() == 0)
      fail(Status::kDegenerate, "surface: leaves control points free at lambda " + text_of(s_.solution.lambda) +
                                    ", expected more points or more smoothing");
  }

  void adaptively(Robust how, double width) {
    step(how, width);
    for (int i = 0; i < kAdaptSteps && o_.smoothing != FitSmoothing::kGiven; ++i) {
      adapt(smoother_, s_.solution, s_.count, s_.stiffness);
      s_.energy = bending_energy(smoother_.grid, s_.stiffness);
      if (i + 1 < kAdaptSteps) search(0);
    }
    if (o_.smoothing != FitSmoothing::kGiven) step(how, kNarrow);
  }

  const Chart& chart_;
  const NurbsFitOptions& o_;
  double correlation_;
  State& s_;
  Smoother smoother_;
  Normal normal_;
  std::vector<std::size_t> lonely_;
  double first_scale_ = 0;  // of the residuals
};

// Sigma of the data beyond what they claim, from the residuals; the posterior's scale.
double noise_variance(const State& s, const NurbsFitOptions& o, double parameters, double columns) {
  double inliers = 0, sum = 0;
  for (std::size_t k = 0; k < s.robust.size(); ++k)
    if (s.robust[k] > 0) inliers += 1, sum += s.residuals.z[k] * s.residuals.z[k];
  const double left = inliers - parameters;
  if (!(left > 0.2 * inliers)) return s.solution.deviance / (columns * std::max(1.0, s.count - 3));
  if (!o.robust) return sum / left;
  return s.scale * s.scale * inliers / left;
}

// As many free parameters as points that count, others left out: what is an outlier, and the noise, is then anybody's
// guess.
void refuse_guesswork(const NurbsFit& fit, const State& s) {
  const auto inliers = s.robust.size() - static_cast<std::size_t>(std::count(s.robust.begin(), s.robust.end(), 0.0));
  if (inliers == s.robust.size() || fit.effective_parameters < kMostFollowed * static_cast<double>(inliers)) return;
  fail(Status::kDegenerate, "surface: its " + std::to_string(fit.grid.size()) + " control points follow " +
                                std::to_string(inliers) + " points exactly and leave out " +
                                std::to_string(s.robust.size() - inliers) +
                                ", expected more points, fewer control points or robust = 0");
}

void keep_points(NurbsFit& fit, const Surface& surface, const State& s, const Data& data) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  fit.height = surface.height, fit.width = surface.width;
  fit.residual.setConstant(surface.size(), nan);
  fit.weight.setConstant(surface.size(), nan);
  fit.parameters.setConstant(surface.size(), 2, nan);
  double sum = 0;
  for (std::size_t k = 0; k < s.robust.size(); ++k) {
    const std::int64_t i = s.points.row[k];
    const double mm = s.residuals.z[k] / std::sqrt(s.points.precision[k] * data.correlation);
    fit.residual(i) = mm;
    fit.weight(i) = s.robust[k];
    if (s.robust[k] > 0) ++fit.inlier_count, sum += mm * mm;
  }
  for (std::size_t k = 0; k < data.row.size(); ++k)
    fit.parameters.row(data.row[k]) << std::clamp(data.at[k].u / fit.chart.length_u, 0.0, 1.0),
        std::clamp(data.at[k].v / fit.chart.length_v, 0.0, 1.0);
  fit.rms = fit.inlier_count > 0 ? std::sqrt(sum / static_cast<double>(fit.inlier_count)) : nan;
}

}  // namespace

NurbsFit fit_nurbs(const Run& run, const Surface& surface, const NurbsFitOptions& options) {
  check_options(options);
  std::int64_t present = 0;
  for (std::int64_t i = 0; i < surface.size(); ++i) present += surface.present(i);
  if (present < kMinPoints)
    fail(Status::kInsufficientData, "surface: " + std::to_string(present) + " points, expected at least 16 for a fit");
  NurbsFit fit;
  std::optional<Vec3> axis;
  if (options.axis) axis = options.axis->normalized();
  fit.chart = make_chart(run, surface, options.chart, axis);
  const Data data = data_of(run, surface, fit.chart);
  fit.grid = make_grid(fit.chart, data, options);
  State s;
  s.points = sort_points(run, fit.grid, fit.chart.columns(), data.row, data.at, &surface.points, data.precision);
  s.trend = remove_trend(fit.grid, s.points);
  s.stiffness.assign(static_cast<std::size_t>(fit.grid.cells_u) * fit.grid.cells_v, 1.0);
  s.energy = bending_energy(fit.grid, s.stiffness);
  Iteration iteration(run, fit.chart, fit.grid, options, data.correlation, s);
  options.robust ? iteration.robust() : iteration.plain();

  const Band inverse = inverse_band(run, s.solution.factor);
  fit.lambda = s.solution.lambda;
  fit.effective_parameters = fit.grid.size() - fit.lambda * trace_product(inverse, s.energy);
  if (options.robust) refuse_guesswork(fit, s);
  fit.point_count = present;
  fit.iterations = s.iterations;
  fit.has_sigma = surface.sigma.size() > 0 || surface.covariance.rows() > 0;
  const double variance = noise_variance(s, options, fit.effective_parameters, fit.chart.columns());
  fit.noise = std::sqrt(variance);
  mark_occupied(fit, s.points, s.robust);
  const Iteration::Posterior p = iteration.posterior(variance);
  keep_covariance(fit, p.inverse, p.stiffer, kLambdaStep, p.share,
                  p.inflation * (fit.has_sigma ? std::max(1.0, variance) : variance));
  fit.coefficients = s.solution.c;
  for (int j = 0; j < fit.grid.nv(); ++j)
    for (int i = 0; i < fit.grid.nu(); ++i)
      fit.coefficients.row(fit.grid.index(i, j)) +=
          Vec3(1, (i - 1) * fit.grid.hu, (j - 1) * fit.grid.hv).transpose() * s.trend;
  keep_points(fit, surface, s, data);
  make_surface_of(fit);
  return fit;
}

}  // namespace sgrt
