// The fit: a smooth surface from scattered points, and its posterior.
#include "nurbs/fit.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "capi/capi.hpp"
#include "nurbs/fit_state.hpp"

namespace sgrt {
namespace {

static_assert(static_cast<int>(FitChart::kAuto) == SGRT_NURBS_CHART_AUTO &&
              static_cast<int>(FitChart::kPlane) == SGRT_NURBS_CHART_PLANE &&
              static_cast<int>(FitChart::kCylinder) == SGRT_NURBS_CHART_CYLINDER &&
              static_cast<int>(FitChart::kSphere) == SGRT_NURBS_CHART_SPHERE &&
              static_cast<int>(FitChart::kGrid) == SGRT_NURBS_CHART_GRID);
static_assert(static_cast<int>(FitSmoothing::kReml) == SGRT_NURBS_SMOOTHING_REML &&
              static_cast<int>(FitSmoothing::kGcv) == SGRT_NURBS_SMOOTHING_GCV &&
              static_cast<int>(FitSmoothing::kGiven) == SGRT_NURBS_SMOOTHING_GIVEN);

constexpr std::int64_t kBlock = 512;  // samples

sgrt_nurbs_fit_options to_c(const NurbsFitOptions& o) {
  sgrt_nurbs_fit_options c{};
  c.struct_size = sizeof c;
  c.chart = static_cast<std::int32_t>(o.chart);
  c.smoothing = static_cast<std::int32_t>(o.smoothing);
  c.robust = o.robust;
  std::copy_n(o.control_points, 2, c.control_points);
  c.max_control_points = o.max_control_points;
  c.lambda = o.lambda;
  c.tukey = o.tukey;
  return c;
}

// The fit checks the other values.
NurbsFitOptions from_c(const sgrt_nurbs_fit_options& c) {
  NurbsFitOptions o;
  check_range(c.chart, SGRT_NURBS_CHART_AUTO, SGRT_NURBS_CHART_GRID, "options.chart");
  check_range(c.smoothing, SGRT_NURBS_SMOOTHING_REML, SGRT_NURBS_SMOOTHING_GIVEN, "options.smoothing");
  check_range(c.robust, 0, 1, "options.robust");
  check_reserved(c.reserved, "options.reserved");
  check_finite(c.axis, 3, "options.axis");
  o.chart = static_cast<FitChart>(c.chart);
  o.smoothing = static_cast<FitSmoothing>(c.smoothing);
  o.robust = c.robust != 0;
  std::copy_n(c.control_points, 2, o.control_points);
  o.max_control_points = c.max_control_points;
  const Vec3 axis = Eigen::Map<const Vec3>(c.axis);
  if (!axis.isZero(0)) o.axis = axis;
  o.lambda = c.lambda;
  o.tukey = c.tukey;
  return o;
}

sgrt_nurbs_fit_info summary_of(const NurbsFit& f) {
  sgrt_nurbs_fit_info info{};
  info.chart = static_cast<std::int32_t>(f.chart.kind);
  info.control_points[0] = f.surface.nu();
  info.control_points[1] = f.surface.nv();
  info.closed = f.grid.periodic;
  info.iterations = f.iterations;
  info.point_count = f.point_count;
  info.inlier_count = f.inlier_count;
  info.lambda = f.lambda;
  info.effective_parameters = f.effective_parameters;
  info.noise = f.noise;
  info.rms_mm = f.rms;
  info.conversion_error_mm = f.conversion_error;
  return info;
}

sgrt_view array_of(const NurbsFit& f, std::int32_t field) {
  const auto beside = [&f](const Eigen::VectorXd& v) {
    return f.height > 0 ? lend(v.data(), SGRT_F64, {f.height, f.width}) : lend(v.data(), SGRT_F64, {v.size()});
  };
  switch (field) {
    case SGRT_NURBS_FIT_RESIDUAL:
      return beside(f.residual);
    case SGRT_NURBS_FIT_WEIGHT:
      return beside(f.weight);
    case SGRT_NURBS_FIT_PARAMETERS:
      return f.height > 0 ? lend(f.parameters.data(), SGRT_F64, {f.height, f.width, 2})
                          : lend(f.parameters.data(), SGRT_F64, {f.parameters.rows(), 2});
    default:
      refuse("field", std::to_string(field), "SGRT_NURBS_FIT_RESIDUAL (1) to SGRT_NURBS_FIT_PARAMETERS (3)");
  }
}

void pack(const Mat3& m, double* out) {
  const double six[6] = {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
  std::copy_n(six, 6, out);
}

// One wanted output: its view, its numbers a sample, and how a sample fills them.
struct Wanted {
  sgrt_mut_view sgrt_nurbs_fit_samples::*view;
  const char* name;
  std::int64_t rows, numbers;  // rows 0: `numbers` a sample, or one where that is 1
  void (*fill)(const FitSample& s, double* out);
};
constexpr Wanted kWanted[] = {
    {&sgrt_nurbs_fit_samples::points, "samples.points", 0, 3,
     [](const FitSample& s, double* out) { std::copy_n(s.point.data(), 3, out); }},
    {&sgrt_nurbs_fit_samples::normals, "samples.normals", 0, 3,
     [](const FitSample& s, double* out) { std::copy_n(s.normal.data(), 3, out); }},
    {&sgrt_nurbs_fit_samples::sigma_mm, "samples.sigma_mm", 0, 1,
     [](const FitSample& s, double* out) { *out = s.sigma; }},
    {&sgrt_nurbs_fit_samples::support, "samples.support", 0, 1,
     [](const FitSample& s, double* out) { *out = s.support; }},
    {&sgrt_nurbs_fit_samples::covariance, "samples.covariance", 0, 6,
     [](const FitSample& s, double* out) { pack(s.covariance, out); }},
    {&sgrt_nurbs_fit_samples::normal_covariance, "samples.normal_covariance", 0, 6,
     [](const FitSample& s, double* out) { pack(s.normal_covariance, out); }},
    {&sgrt_nurbs_fit_samples::derivatives, "samples.derivatives", 5, 3,
     [](const FitSample& s, double* out) {
       for (int k = 0; k < 5; ++k) std::copy_n(s.derivatives[k].data(), 3, out + 3 * k);
     }},
    {&sgrt_nurbs_fit_samples::derivative_covariance, "samples.derivative_covariance", 5, 6,
     [](const FitSample& s, double* out) {
       for (int k = 0; k < 5; ++k) pack(s.derivative_covariance[k], out + 6 * k);
     }},
};

void check_wanted(const sgrt_nurbs_fit_samples& samples, std::int64_t n, const sgrt_view* uv) {
  for (const Wanted& w : kWanted) {
    const sgrt_mut_view* view = &(samples.*w.view);
    if (absent(view)) continue;
    if (w.rows > 0)
      check_output(view, w.name, SGRT_F64, {n, w.rows, w.numbers});
    else if (w.numbers > 1)
      check_output(view, w.name, SGRT_F64, {n, w.numbers});
    else
      check_output(view, w.name, SGRT_F64, {n});
    check_apart(view, w.name, uv, "uv");
    for (const Wanted* other = kWanted; other != &w; ++other)
      if (!absent(&(samples.*other->view))) check_apart(view, w.name, &(samples.*other->view), other->name);
  }
}

std::vector<double> read_parameters(const sgrt_view* uv) {
  need(uv, "uv");
  check_view(uv, "uv", Kind::kReal, {kAny, 2});
  check_limit(uv->shape[0], kMaxPoints, "uv");
  std::vector<double> at(static_cast<std::size_t>(2 * uv->shape[0]));
  read_view(*uv, at.data());
  for (const double x : at)
    if (!(x >= 0 && x <= 1)) refuse("uv", text_of(x), "parameters from 0 to 1");
  return at;
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_nurbs_fit_options_init(sgrt_nurbs_fit_options* options, size_t size) {
  return guard([&] { init_struct(options, size, to_c(NurbsFitOptions{}), "options"); });
}

sgrt_status sgrt_nurbs_fit_create(sgrt_context* context, const sgrt_surface* surface,
                                  const sgrt_nurbs_fit_options* options, sgrt_nurbs_fit** fit) {
  return guard([&] {
    need(surface, "surface");
    need(fit, "fit");
    const NurbsFitOptions o = from_c(read_struct(options, to_c(NurbsFitOptions{}), "options.struct_size"));
    auto handle = std::make_unique<sgrt_nurbs_fit>();
    handle->fit = fit_nurbs(run_of(context), *surface->surface, o);
    *fit = handle.release();
  });
}

void sgrt_nurbs_fit_free(sgrt_nurbs_fit* fit) {
  guard([&] { delete fit; });
}

sgrt_status sgrt_nurbs_fit_summary(const sgrt_nurbs_fit* fit, sgrt_nurbs_fit_info* info) {
  return guard([&] {
    need(fit, "fit");
    need(info, "info");
    check_result(info, "info.struct_size");
    write_struct(info, summary_of(fit->fit));
  });
}

sgrt_status sgrt_nurbs_fit_array(const sgrt_nurbs_fit* fit, int32_t field, sgrt_view* view) {
  return guard([&] {
    need(fit, "fit");
    need(view, "view");
    *view = array_of(fit->fit, field);
  });
}

sgrt_status sgrt_nurbs_fit_surface(const sgrt_nurbs_fit* fit, sgrt_nurbs_surface** surface) {
  return guard([&] {
    need(fit, "fit");
    need(surface, "surface");
    *surface = new sgrt_nurbs_surface(fit->fit.surface);
  });
}

sgrt_status sgrt_nurbs_fit_samples_init(sgrt_nurbs_fit_samples* samples, size_t size) {
  return guard([&] { init_struct(samples, size, sgrt_nurbs_fit_samples{}, "samples"); });
}

sgrt_status sgrt_nurbs_fit_evaluate(sgrt_context* context, const sgrt_nurbs_fit* fit, const sgrt_view* uv,
                                    const sgrt_nurbs_fit_samples* samples) {
  return guard([&] {
    need(fit, "fit");
    need(samples, "samples");
    const std::vector<double> at = read_parameters(uv);
    const auto n = static_cast<std::int64_t>(at.size() / 2);
    const sgrt_nurbs_fit_samples wanted = read_struct(samples, sgrt_nurbs_fit_samples{}, "samples.struct_size");
    check_reserved(wanted.reserved, "samples.reserved");
    check_wanted(wanted, n, uv);
    constexpr std::size_t kCount = std::size(kWanted);
    std::vector<double> values[kCount];
    const auto numbers = [](const Wanted& w) {
      return static_cast<std::size_t>(std::max<std::int64_t>(1, w.rows) * w.numbers);
    };
    for (std::size_t k = 0; k < kCount; ++k)
      if (!absent(&(wanted.*kWanted[k].view))) values[k].resize(static_cast<std::size_t>(n) * numbers(kWanted[k]));
    parallel_for(
        run_of(context), n, kBlock,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t i = begin; i < end; ++i) {
            const FitSample s = sample_fit(fit->fit, at[2 * i], at[2 * i + 1]);
            for (std::size_t k = 0; k < kCount; ++k)
              if (!values[k].empty())
                kWanted[k].fill(s, values[k].data() + static_cast<std::size_t>(i) * numbers(kWanted[k]));
          }
        },
        "evaluating");
    for (std::size_t k = 0; k < kCount; ++k)
      if (!values[k].empty()) write_view(wanted.*kWanted[k].view, values[k].data());
  });
}

sgrt_status sgrt_nurbs_fit_state(const sgrt_nurbs_fit* fit, const sgrt_mut_view* numbers, int64_t* count) {
  return guard([&] {
    need(fit, "fit");
    if (absent(numbers)) need(count, "count");
    const std::vector<double> state = state_of(fit->fit);
    if (!absent(numbers)) {
      check_output(numbers, "numbers", SGRT_F64, {static_cast<std::int64_t>(state.size())});
      write_view(*numbers, state.data());
    }
    if (count) *count = static_cast<std::int64_t>(state.size());
  });
}

sgrt_status sgrt_nurbs_fit_from_state(const sgrt_view* numbers, sgrt_nurbs_fit** fit) {
  return guard([&] {
    need(fit, "fit");
    check_view(numbers, "numbers", Kind::kReal, {kAny});
    check_limit(numbers->shape[0], 8 * kMaxPoints, "numbers");
    std::vector<double> state(static_cast<std::size_t>(numbers->shape[0]));
    read_view(*numbers, state.data());
    *fit = new sgrt_nurbs_fit{fit_from_state(state.data(), numbers->shape[0])};
  });
}

sgrt_status sgrt_nurbs_fit_nearest(sgrt_context* context, const sgrt_nurbs_fit* fit, const sgrt_view* points,
                                   const sgrt_mut_view* uv) {
  return guard([&] {
    need(fit, "fit");
    const Points x = read_points(points, "points");
    if (!x.allFinite()) refuse("points", "a NaN or infinity", "finite numbers");
    need(uv, "uv");
    check_output(uv, "uv", SGRT_F64, {x.rows(), 2});
    check_apart(uv, "uv", points, "points");
    std::vector<double> at(static_cast<std::size_t>(2 * x.rows()));
    parallel_for(
        run_of(context), x.rows(), kBlock,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t i = begin; i < end; ++i) {
            const Vec2 p = nearest_parameters(fit->fit, x.row(i).transpose());
            at[2 * i] = p(0), at[2 * i + 1] = p(1);
          }
        },
        "nearest");
    write_view(*uv, at.data());
  });
}
