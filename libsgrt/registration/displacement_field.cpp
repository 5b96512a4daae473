// Embedded deformation by Gauss-Newton. docs/theory/nonrigid.md section 5.
#include "registration/displacement_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr int kBlend = 5;         // nodes that move a point
constexpr double kModel2 = 0.01;  // mm2: what a field of so few nodes cannot follow
constexpr int kRounds = 8;
constexpr double kRest = 1e-3;     // mm
constexpr double kSlope = 0.25;    // mm: by which neighbouring nodes' displacements differ, one sigma, at stiffness 1
constexpr double kAway = 20;       // mm: by which a node moves at all; holds what nothing else does
constexpr double kTukeyEnd = 6;    // sigmas, and at least
constexpr double kNoOutlier = 10;  // mm: the field is there for what does not fit at first

struct Blend {
  std::int32_t node[kBlend];
  double weight[kBlend];
};

// Weights that fall to 0 at the next node, so that the field is continuous.
Blend blend_at(const Nearest& nodes, const Vec3& x) {
  Nearest::Hit hits[kBlend + 1];
  const int n = nodes.neighbours(x, kBlend + 1, std::numeric_limits<double>::infinity(), hits);
  const double reach = std::sqrt(hits[n - 1].distance2) + 1e-9;
  Blend b{};
  double sum = 0;
  for (int k = 0; k < kBlend; ++k) {
    const bool used = k < std::max(1, n - 1);
    const double t = used ? 1 - std::sqrt(hits[k].distance2) / reach : 0;
    b.node[k] = used ? static_cast<std::int32_t>(hits[k].index) : 0;
    b.weight[k] = used ? t * t + 1e-12 : 0;
    sum += b.weight[k];
  }
  for (double& w : b.weight) w /= sum;
  return b;
}

Vec3 value(const Blend& b, const Eigen::VectorXd& d) {
  Vec3 u = Vec3::Zero();
  for (int k = 0; k < kBlend; ++k) u += b.weight[k] * d.segment<3>(3 * b.node[k]);
  return u;
}

// Adds sum w (r + n . sum_k b_k delta_k)^2 / (noise^2 v + model^2).
void add_data(const std::vector<Contact>& contacts, const std::vector<Blend>& blends, Eigen::MatrixXd& A,
              Eigen::VectorXd& g) {
  const double noise = std::max(1.0, robust_sigma(contacts));
  for (const Contact& c : contacts) {
    const double variance = noise * noise * c.variance + kModel2;
    const double u = c.r / std::max(kNoOutlier, kTukeyEnd * std::sqrt(variance));
    const double w = u * u < 1 ? (1 - u * u) * (1 - u * u) / variance : 0;
    if (!(w > 0)) continue;
    const Blend& b = blends[static_cast<std::size_t>(c.live)];
    const Mat3 nn = w * c.n * c.n.transpose();
    for (int k = 0; k < kBlend; ++k) {
      if (!(b.weight[k] > 0)) continue;
      g.segment<3>(3 * b.node[k]) += w * c.r * b.weight[k] * c.n;
      for (int l = 0; l < kBlend; ++l) {
        A.block<3, 3>(3 * b.node[k], 3 * b.node[l]) += b.weight[k] * b.weight[l] * nn;
      }
    }
  }
}

// Adds sum |d_k - d_l|^2 stiffness / slope^2 over neighbours, and a weak pull to the rigid motion.
void add_stiffness(const Patches& patches, double stiffness, const Eigen::VectorXd& d, Eigen::MatrixXd& A,
                   Eigen::VectorXd& g) {
  const double s = stiffness / (kSlope * kSlope), a = 1 / (kAway * kAway);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(3 * k);
    A.block<3, 3>(i, i).diagonal().array() += a;
    g.segment<3>(i) += a * d.segment<3>(i);
    for (const std::int32_t q : patches.next[k]) {
      if (static_cast<std::size_t>(q) < k) continue;
      const Eigen::Index j = 3 * q;
      const Vec3 difference = d.segment<3>(i) - d.segment<3>(j);
      A.block<3, 3>(i, i).diagonal().array() += s;
      A.block<3, 3>(j, j).diagonal().array() += s;
      A.block<3, 3>(i, j).diagonal().array() -= s;
      A.block<3, 3>(j, i).diagonal().array() -= s;
      g.segment<3>(i) += s * difference;
      g.segment<3>(j) -= s * difference;
    }
  }
}

}  // namespace

Points displacement_field(const Run& run, const Field& field, const Patches& patches, const Surface& live,
                          const Pose& pose, double live_roughness, const FieldOptions& options) {
  Points nodes(static_cast<Eigen::Index>(patches.size()), 3);
  for (std::size_t k = 0; k < patches.size(); ++k) nodes.row(static_cast<Eigen::Index>(k)) = patches.centre[k];
  const Nearest tree(run, nodes);
  const Surface start = moved(live, pose);
  std::vector<Blend> blends(static_cast<std::size_t>(live.size()));
  parallel_for(
      run, live.size(), 1024,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          if (start.present(i)) blends[static_cast<std::size_t>(i)] = blend_at(tree, start.point(i));
        }
      },
      "displacement field");

  const Eigen::Index unknowns = 3 * nodes.rows();
  Eigen::VectorXd d = Eigen::VectorXd::Zero(unknowns);
  Surface warped = start;
  Points out = Points::Constant(live.size(), 3, std::numeric_limits<double>::quiet_NaN());
  for (int round = 0; round <= kRounds; ++round) {
    run.poll(static_cast<double>(round) / kRounds, "displacement field");
    const auto contacts =
        contacts_at(run, field, patches, warped, Pose{}, options.max_distance, options.min_cos, live_roughness);
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(unknowns);
    add_data(contacts, blends, A, g);
    add_stiffness(patches, options.stiffness, d, A, g);
    const Eigen::VectorXd step = -A.llt().solve(g);
    d += step;
    for (std::int64_t i = 0; i < live.size(); ++i) {
      if (start.present(i))
        warped.points.row(i) = (start.point(i) + value(blends[static_cast<std::size_t>(i)], d)).transpose();
    }
    if (round < kRounds && step.cwiseAbs().maxCoeff() > kRest) continue;
    for (const Contact& c : contacts) out.row(c.live) = value(blends[static_cast<std::size_t>(c.live)], d).transpose();
    break;
  }
  return out;
}

}  // namespace sgrt
