// Batches of points in blocks on the context's threads.
#include "nurbs/evaluate.hpp"

#include <algorithm>

#include "core/parallel.hpp"
#include "nurbs/homogeneous.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kBlock = 16384;  // points, 0.1 to 2 ms

// Row d of a span's 4 x 4: its functions' derivatives at its begin over d!. From A2.3, so that every coefficient has
// its own digits, however uneven the knots are.
std::vector<double> taylor_series(const SplineBasis& basis) {
  std::vector<double> series;
  if (basis.degree != 3) return series;
  series.assign(static_cast<std::size_t>(basis.size()) * 16, 0);
  for (int k = 3; k < basis.size(); ++k) {
    const double begin = basis.knots[static_cast<std::size_t>(k)];
    if (!(begin < basis.knots[static_cast<std::size_t>(k) + 1])) continue;
    double* to = series.data() + 16 * static_cast<std::ptrdiff_t>(k);
    basis_derivatives(basis, k, begin, 3, to);
    for (int a = 0; a < 4; ++a) to[8 + a] /= 2, to[12 + a] /= 6;
  }
  return series;
}

kernels::Spline prepare(const SplineBasis& basis, std::vector<double>& inverse, std::vector<double>& series,
                        std::vector<int>& bucket) {
  const double* U = basis.knots.data();
  const int p = basis.degree, n = basis.size();
  inverse.assign(static_cast<std::size_t>(n) * p * (p + 1) / 2, 0);
  for (int k = p; k < n; ++k) {
    if (!(U[k] < U[k + 1])) continue;
    double* to = inverse.data() + static_cast<std::ptrdiff_t>(k) * p * (p + 1) / 2;
    for (int j = 1; j <= p; ++j) {
      for (int r = 0; r < j; ++r) *to++ = 1 / (U[k + r + 1] - U[k + 1 - j + r]);
    }
  }
  const int count = 4 * static_cast<int>(breaks(basis).size() - 1);  // equal spans: no knot inside a bucket
  const double width = basis.end() - basis.begin();
  for (int b = 0; b < count; ++b)
    bucket.push_back(find_span(basis, std::min(basis.begin() + width * b / count, basis.end())));
  const double scale = count / width;
  series = taylor_series(basis);
  return {p,    n, U, inverse.data(), series.data(), bucket.data(), count, find_span(basis, basis.end()), basis.begin(),
          scale};
}

struct Tabulated {
  std::int64_t width;  // numbers a parameter
  std::vector<int> span;
  std::vector<double> values;

  Tabulated(const kernels::Spline& spline, const double* u, std::int64_t n, int order, bool avx2)
      : width((order + 1) * (spline.degree + 1)),
        span(static_cast<std::size_t>(n)),
        values(static_cast<std::size_t>(n * width)) {
    (avx2 ? kernels::tabulate_avx2 : kernels::tabulate_baseline)(spline, u, n, order, span.data(), values.data());
  }
};

// Without progress: outputs are the caller's memory, and a call that was cancelled must not have touched them.
Run without_progress(const Run& run) {
  Run silent;
  silent.pool = run.pool;
  silent.isa = run.isa;
  return silent;
}

}  // namespace

SurfaceEvaluator::SurfaceEvaluator(NurbsSurface surface) : surface_(std::move(surface)) {
  const NurbsSurface& s = surface_;
  const auto count = static_cast<std::size_t>(s.points.rows());
  points_.resize(count * 4);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec4 h = homogeneous(s.points, s.weights, static_cast<Eigen::Index>(i));
    std::copy_n(h.data(), 4, points_.data() + 4 * i);
  }
  patch_ = {prepare(s.basis[0], inverse_[0], series_[0], bucket_[0]),
            prepare(s.basis[1], inverse_[1], series_[1], bucket_[1]), points_.data(), s.rational()};
}

void evaluate_points(const Run& run, const SurfaceEvaluator& evaluator, const double* uv, std::int64_t n, int order,
                     double* out) {
  const std::int64_t width = 3 * derivative_count(order);
  const auto kernel = run.isa == Isa::kAvx2 ? kernels::points_avx2 : kernels::points_baseline;
  parallel_for(without_progress(run), n, kBlock, [&](std::int64_t begin, std::int64_t end) {
    if (order <= 2) return kernel(evaluator.patch(), uv + 2 * begin, end - begin, order, out + begin * width);
    std::vector<Vec3> ders(static_cast<std::size_t>(derivative_count(order)));
    for (std::int64_t i = begin; i < end; ++i) {
      derivatives(evaluator.surface(), uv[2 * i], uv[2 * i + 1], order, ders.data());
      std::copy_n(ders[0].data(), width, out + i * width);
    }
  });
}

void evaluate_grid(const Run& run, const SurfaceEvaluator& evaluator, const double* u, std::int64_t nu, const double* v,
                   std::int64_t nv, int order, double* out) {
  const std::int64_t width = 3 * derivative_count(order);
  if (order > 2) {
    std::vector<double> uv;
    for (std::int64_t i = 0; i < nu; ++i) {
      uv.clear();
      for (std::int64_t j = 0; j < nv; ++j) uv.insert(uv.end(), {u[i], v[j]});
      evaluate_points(run, evaluator, uv.data(), nv, order, out + i * nv * width);
    }
    return;
  }
  const kernels::Patch& patch = evaluator.patch();
  const bool avx2 = run.isa == Isa::kAvx2;
  const auto kernel = avx2 ? kernels::grid_avx2 : kernels::grid_baseline;
  const Tabulated Nu(patch.u, u, nu, order, avx2), Nv(patch.v, v, nv, order, avx2);
  const std::int64_t block = std::max<std::int64_t>(1, 4 * kBlock / std::max<std::int64_t>(1, nv));
  parallel_for(without_progress(run), nu, block, [&](std::int64_t begin, std::int64_t end) {
    const auto [least, most] = std::minmax_element(Nu.span.begin() + begin, Nu.span.begin() + end);
    kernels::GridChunk c{};
    c.order = order, c.first_row = *least - patch.u.degree, c.last_row = *most;
    c.nu = end - begin, c.span_u = Nu.span.data() + begin, c.Nu = Nu.values.data() + begin * Nu.width;
    const std::int64_t rows = c.last_row - c.first_row + 1;
    std::vector<double> Q(static_cast<std::size_t>(rows * kernels::kChunk * 4 * (order + 1) + kernels::kLanes));
    c.Q = Q.data(), c.stride = nv * width;
    for (std::int64_t j = 0; j < nv; j += kernels::kChunk) {
      c.nv = std::min<std::int64_t>(kernels::kChunk, nv - j);
      c.span_v = Nv.span.data() + j, c.Nv = Nv.values.data() + j * Nv.width;
      c.out = out + begin * c.stride + j * width;
      kernel(patch, c);
    }
  });
}

void evaluate_normals(const Run& run, const SurfaceEvaluator& evaluator, const double* uv, std::int64_t n,
                      double* out) {
  parallel_for(without_progress(run), n, kBlock, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) {
      Eigen::Map<Vec3>(out + 3 * i) = normal(evaluator.surface(), uv[2 * i], uv[2 * i + 1]);
    }
  });
}

}  // namespace sgrt
