// See registration/pass.hpp.
#include "registration/pass.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kUnseen = 4e-6;       // a relief of 2e-3 rad: steps along such a motion would wander off
constexpr std::int64_t kBlock = 1024;  // points whose sums may stay in single precision
constexpr std::int64_t kAlone = 3 * kBlock;

Sums widen(const kernels::PassSums& s, double lever) {
  Sums out;
  int at = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) out.A(a, b) = out.A(b, a) = static_cast<double>(s.a[at++]);
    out.g[a] = static_cast<double>(s.g[a]);
  }
  out.A.topRows<3>() *= lever;
  out.A.leftCols<3>() *= lever;
  out.g.head<3>() *= lever;
  out.cost = static_cast<double>(s.cost);
  out.chi = static_cast<double>(s.chi);
  out.weight = static_cast<double>(s.weight);
  out.square = static_cast<double>(s.square);
  out.pairs = static_cast<double>(s.pairs);
  out.candidates = static_cast<double>(s.candidates);
  out.flipped = static_cast<double>(s.flipped);
  return out;
}

void set_pose(const Pose& T, const Vec3& from, const Vec3& to, kernels::Pass& pass) {
  const Vec3 t = T * from - to;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) pass.R[3 * a + b] = static_cast<float>(T.R(a, b));
    pass.t[a] = static_cast<float>(t[a]);
  }
}

void set_field(const SurfelField& field, int level, int levels, kernels::Pass& pass) {
  const int top = static_cast<int>(field.levels.size());
  pass.first = std::clamp(level, 0, top - 1);
  pass.level_count = std::clamp(levels, 1, top - pass.first);
  for (int k = 0; k < pass.level_count; ++k) {
    const SurfelLevel& from = field.levels[static_cast<std::size_t>(pass.first + k)];
    pass.level[k] = {from.slots.data(), from.surfels.data(), from.mask, from.shift};
  }
  for (int k = 0; k < 3; ++k) pass.low[k] = static_cast<float>(field.low[k]);
  pass.inverse_cell = static_cast<float>(1 / field.cell);
}

}  // namespace

Sums& Sums::operator+=(const Sums& o) {
  A += o.A;
  g += o.g;
  cost += o.cost;
  chi += o.chi;
  weight += o.weight;
  square += o.square;
  pairs += o.pairs;
  candidates += o.candidates;
  flipped += o.flipped;
  return *this;
}

Sums do_pass(const Run& run, const SurfelField& field, const LivePoints& live, const Pose& T, const PassOptions& o) {
  kernels::Pass pass{};
  pass.x = live.x.data();
  pass.y = live.y.data();
  pass.z = live.z.data();
  const bool normals = !live.nx.empty();
  pass.nx = normals ? live.nx.data() : nullptr;
  pass.ny = normals ? live.ny.data() : nullptr;
  pass.nz = normals ? live.nz.data() : nullptr;
  pass.v = live.v.empty() || o.unit_noise ? nullptr : live.v.data();
  pass.v_all = o.unit_noise ? 1 : live.v_all;
  pass.given = o.given;
  set_pose(T, live.centre, field.centre, pass);
  set_field(field, o.level, o.levels, pass);
  pass.limit = static_cast<float>(o.limit);
  pass.min_cos = static_cast<float>(o.min_cos);
  pass.signs_unsure = o.signs_unsure ? 1 : 0;
  pass.inverse_scale2 = o.scale > 0 ? static_cast<float>(1 / (o.scale * o.scale)) : 0;
  pass.flat = static_cast<float>(o.taper.flat);
  pass.inverse_width = static_cast<float>(1 / (o.taper.end - o.taper.flat));
  pass.score = o.score ? 1 : 0;
  pass.inverse_lever = static_cast<float>(1 / field.lever);
  pass.r_out = o.r;
  pass.w_out = o.w;
  pass.surfel_out = o.surfel;
  const auto kernel = run.isa == Isa::kAvx2 ? kernels::pass_avx2 : kernels::pass_baseline;
  const auto padded = static_cast<std::int64_t>(live.x.size());
  Run alone = run;  // a few blocks are done before another thread would wake
  if (padded <= kAlone) alone.pool = nullptr;
  return parallel_sum(
      alone, padded, kBlock, Sums{},
      [&](std::int64_t begin, std::int64_t end) {
        kernels::PassSums sums;
        kernel(pass, begin, end, &sums);
        return widen(sums, field.lever);
      },
      "registration");
}

Vec6 step_of(const Sums& sums, double lever) {
  Vec6 unit;
  unit << Vec3::Constant(1 / lever), Vec3::Ones();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(Mat6(unit.asDiagonal() * sums.A * unit.asDiagonal()));
  const Vec6 g = unit.cwiseProduct(sums.g);
  Vec6 step = Vec6::Zero();
  for (int i = 0; i < 6; ++i) {
    const double lambda = eigen.eigenvalues()[i];
    if (!(lambda > kUnseen * eigen.eigenvalues()[5])) continue;
    step -= eigen.eigenvectors().col(i).dot(g) / lambda * eigen.eigenvectors().col(i);
  }
  return unit.cwiseProduct(step);
}

Pose motion_about(const Vec6& twist, const Vec3& pivot) {
  const Mat3 R = so3_exp(twist.head<3>());
  return {R, twist.tail<3>() + pivot - R * pivot};
}

double farthest(const SurfelField& field, const Vec6& twist) {
  double most2 = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 x((corner & 1) != 0 ? field.box_max[0] : field.box_min[0],
                 (corner & 2) != 0 ? field.box_max[1] : field.box_min[1],
                 (corner & 4) != 0 ? field.box_max[2] : field.box_min[2]);
    most2 = std::max(most2, (twist.head<3>().cross(x) + twist.tail<3>()).squaredNorm());
  }
  return std::sqrt(most2);
}

}  // namespace sgrt
