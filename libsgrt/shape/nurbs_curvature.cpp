// Derivatives in batches, then the forms. docs/theory/curvature.md eq. 3-7.
#include "shape/nurbs_curvature.hpp"

#include <algorithm>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kBlock = 4096, kBatch = 256;

}  // namespace

void nurbs_curvature(const Run& run, const SurfaceEvaluator& evaluator, const double* uv, std::int64_t n,
                     Curvature* out) {
  Run quiet;  // the batches neither poll nor share out their work
  quiet.isa = run.isa;
  parallel_for(
      run, n, kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        double ders[kBatch * 18];
        for (std::int64_t at = begin; at < end; at += kBatch) {
          const std::int64_t count = std::min(kBatch, end - at);
          evaluate_points(quiet, evaluator, uv + 2 * at, count, 2, ders);
          for (std::int64_t i = 0; i < count; ++i) {
            Vec3 d[5];
            for (int k = 0; k < 5; ++k) d[k] = Eigen::Map<const Vec3>(ders + 18 * i + 3 * (k + 1));
            out[at + i] = curvature_of_forms(d);
          }
        }
      },
      "curvature");
}

}  // namespace sgrt
