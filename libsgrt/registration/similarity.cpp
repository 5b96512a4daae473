// Gauss-Newton on motion and scale. docs/theory/nonrigid.md section 4.
#include "registration/similarity.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kRounds = 60;
constexpr double kMost = 2;           // a patient does not grow by more
constexpr double kDegenerate = 0.02;  // one sigma of the scale beyond which the size is not told
constexpr double kTukeyEnd = 4.685;

using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;

}  // namespace

Surface scaled_about(Surface s, const Vec3& isocentre, double scale) {
  for (Eigen::Index i = 0; i < s.points.rows(); ++i) {
    s.points.row(i) = (isocentre + scale * (s.point(i) - isocentre)).transpose();
  }
  s.sigma *= scale;
  s.covariance *= scale * scale;
  for (Points& mode : s.modes) mode *= scale;
  return s;
}

Similarity fit_similarity(const Run& run, const Field& field, const Patches& patches, const Surface& live,
                          const Vec3& isocentre, const Pose& start, double live_roughness, const IcpOptions& options) {
  Similarity s;
  s.pose = start;
  const double min_cos = std::cos(options.max_angle_deg * kPi / 180), lever = patches.lever;
  for (int round = 0; round < kRounds; ++round) {
    run.poll(static_cast<double>(round) / kRounds, "similarity");
    const auto contacts = contacts_at(run, field, patches, scaled_about(live, isocentre, s.scale), s.pose,
                                      options.max_distance, min_cos, live_roughness);
    if (contacts.size() < 7) fail(Status::kNotFound, "the surfaces do not overlap: fewer than 7 pairs");
    const double noise = std::max(1e-3, robust_sigma(contacts));
    const Vec3 centre = s.pose * isocentre;
    Mat7 A = Mat7::Zero();
    Vec7 g = Vec7::Zero();
    double sum = 0, weight = 0;
    for (const Contact& c : contacts) {
      const double u = c.r / (kTukeyEnd * noise * std::sqrt(c.variance));
      const double w = u * u < 1 ? (1 - u * u) * (1 - u * u) / c.variance : 0;
      Vec7 j;
      j << (c.y - patches.pivot).cross(c.n) / lever, c.n, c.n.dot(c.y - centre) / (s.scale * lever);
      A.noalias() += w * j * j.transpose();
      g += w * c.r * j;
      sum += w * c.r * c.r;
      weight += w * c.variance;
    }
    const Eigen::SelfAdjointEigenSolver<Mat7> eigen(A);
    if (!(eigen.eigenvalues()[0] > 1e-9 * eigen.eigenvalues()[6])) {
      fail(Status::kDegenerate, "the surfaces do not tell the size, or leave a motion free");
    }
    const Mat7 inverse =
        eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
    const Vec7 step = -inverse * g;
    s.scale += step[6] / lever;
    if (!(s.scale < kMost && s.scale > 1 / kMost)) {
      fail(Status::kNotFound, "the scale ran to " + text_of(s.scale) + ", expected 0.5 to 2");
    }
    const Mat3 R = so3_exp(step.head<3>() / lever);
    s.pose = Pose{R, step.segment<3>(3) + patches.pivot - R * patches.pivot} * s.pose;
    s.sigma = std::sqrt(inverse(6, 6) * std::max(1.0, sum / weight)) / lever;
    const Mat6 rigid = A.topLeftCorner<6, 6>();
    const Vec6 mixed = A.topRightCorner<6, 1>();
    Vec6 about_pivot = -rigid.ldlt().solve(mixed) * lever;
    about_pivot.head<3>() /= lever;
    s.lever = adjoint(Pose{Mat3::Identity(), patches.pivot - isocentre}) * about_pivot;
    if (step.norm() < options.step_tolerance) {
      if (s.sigma > kDegenerate) {
        fail(Status::kDegenerate, "the surfaces do not tell the size: one sigma of the scale is " + text_of(s.sigma));
      }
      return s;
    }
  }
  fail(Status::kNotConverged, "still moving after " + std::to_string(kRounds) + " iterations");
}

}  // namespace sgrt
