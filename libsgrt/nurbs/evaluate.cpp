// Batches of points in blocks on the context's threads.
#include "nurbs/evaluate.hpp"

#include <algorithm>

#include "core/parallel.hpp"
#include "nurbs/homogeneous.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kBlock = 16384;  // points, 0.1 to 2 ms

kernels::Spline prepare(const SplineBasis& basis, std::vector<double>& inverse, std::vector<int>& bucket) {
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
  const int count = 4 * n;
  const double width = basis.end() - basis.begin();
  for (int b = 0; b < count; ++b)
    bucket.push_back(find_span(basis, std::min(basis.begin() + width * b / count, basis.end())));
  const double scale = count / width;
  return {p, n, U, inverse.data(), bucket.data(), count, find_span(basis, basis.end()), basis.begin(), scale};
}

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
  const auto count = static_cast<std::size_t>(s.points.rows()), nv = static_cast<std::size_t>(s.nv());
  points_.resize(count * 4);
  columns_.resize(count * 4);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec4 h = homogeneous(s.points, s.weights, static_cast<Eigen::Index>(i));
    for (std::size_t c = 0; c < 4; ++c) {
      points_[4 * i + c] = h[static_cast<Eigen::Index>(c)];
      columns_[(4 * (i / nv) + c) * nv + i % nv] = h[static_cast<Eigen::Index>(c)];
    }
  }
  patch_ = {prepare(s.basis[0], inverse_[0], bucket_[0]), prepare(s.basis[1], inverse_[1], bucket_[1]), points_.data(),
            columns_.data(), s.rational()};
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
  const std::int64_t stride = nv + kernels::kLanes;
  std::vector<int> span(static_cast<std::size_t>(nv));
  std::vector<double> N(static_cast<std::size_t>(stride) * (order + 1) * (patch.v.degree + 1));
  kernels::tabulate_baseline(patch.v, v, nv, order, span.data(), N.data(), stride);
  const auto kernel = run.isa == Isa::kAvx2 ? kernels::grid_row_avx2 : kernels::grid_row_baseline;
  const std::int64_t block = std::max<std::int64_t>(1, 4 * kBlock / std::max<std::int64_t>(1, nv));
  parallel_for(without_progress(run), nu, block, [&](std::int64_t begin, std::int64_t end) {
    std::vector<double> columns(static_cast<std::size_t>(patch.v.size) * 12);
    std::vector<double> line(6 * 4 * (kernels::kChunk + kernels::kLanes));
    for (std::int64_t i = begin; i < end; ++i) {
      kernel(patch,
             {u[i], span.data(), N.data(), nv, stride, order, columns.data(), line.data(), out + i * nv * width});
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
