// Curvature at a scale, candidates, and the place of an extremum. docs/theory/landmarks.md eq. 1-5.
#include "shape/scene.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kWanted = 0.006;            // 1/mm, sigma of H
constexpr double kWidest = 12;               // mm
constexpr double kStandsOut = 2.5;           // sigmas of persistence
constexpr std::size_t kMostCandidates = 40;  // of each sign
constexpr double kAbout = 0.75;              // of the quadric through the curvature, over the scale
constexpr double kGradient = 1.25;           // sigma of H's gradient times the scale, over sigma of H (eq. 5)
constexpr double kBendNoise = 3.0;           // of H's second derivative times the scale squared, likewise
constexpr double kRungs[] = {1, 1.35, 1.8};  // of the scale
constexpr double kScaleBias = 0.15;          // of the scale: a form narrower than the disc does not show by steps
constexpr double kAgree = 2;                 // chi^2 of two degrees: the expected value

}  // namespace

LandmarkScene make_landmark_scene(const Run& run, const Surface& surface, const Grain& grain, double scale) {
  if (!(grain.spacing > 0)) fail(Status::kInsufficientData, "the surface has too few points for landmarks");
  LandmarkScene s{&surface, &grain, scale, {}, Nearest(surface.points), {}};
  const double sigma = grain.noise > 0 ? grain.noise * std::sqrt(surface.correlation_points) : 0;
  s.scale =
      std::max({scale, 2.6 * grain.spacing, std::min(kWidest, std::cbrt(3.91 * sigma * grain.spacing / kWanted))});
  CurvatureOptions o;
  o.degree = kLandmarkDegree;
  o.max_sigma = 1;
  s.rungs.reserve(std::size(kRungs));
  for (const double rung : kRungs) {
    o.radius = rung * s.scale;
    s.rungs.push_back(surface_curvature(run, surface, grain, o));
  }
  const CurvatureField& f = s.field();
  std::size_t count[2] = {0, 0};
  for (const Extremum& e : extrema(f, beside_in_sheet(run, surface, f), kStandsOut)) {
    if (++count[e.sign > 0] > kMostCandidates) continue;
    const std::int64_t i = e.row;
    s.candidates.push_back({surface.point(i), f.normals.row(i).transpose(), e.sign, f.k1[i], f.k2[i], f.mean[i],
                            f.sigma_mean[i], e.persistence});
  }
  return s;
}

namespace {

Peak polish_at(const Run& run, const LandmarkScene& scene, std::size_t rung, const Vec3& x, const Vec3& normal,
               int sign) {
  const CurvatureField& field = scene.rungs[rung];
  const double scale = kRungs[rung] * scene.scale, noise = scene.grain->noise;
  Peak peak;
  const double reach = kAbout * scale;
  const Vec3 e1 = normal.unitOrthogonal(), e2 = normal.cross(e1);
  Vec3 at = x;
  Eigen::Matrix2d Q;
  double sigma = 0;
  std::vector<Nearest::Hit> hits(512);
  JetFitter fitter(run, scene.grain->pyramid, kLandmarkDegree);
  for (int round = 0; round < 4; ++round) {
    const int n = scene.nearest.neighbours(at, static_cast<int>(hits.size()), reach, hits.data());
    Mat6 M = Mat6::Zero();
    Vec6 g = Vec6::Zero();
    int count = 0;
    sigma = 0;
    for (int k = 0; k < n; ++k) {
      const std::int64_t i = hits[static_cast<std::size_t>(k)].index;
      if (field.reason[static_cast<std::size_t>(i)] != 0 || field.normals.row(i).dot(normal) < 0.2) continue;
      const Vec3 d = (scene.surface->point(i) - at) / reach;
      const double u = d.dot(e1), v = d.dot(e2);
      Vec6 row;
      row << 1, u, v, 0.5 * u * u, u * v, 0.5 * v * v;
      const double w = std::max(0.0, 1 - u * u - v * v);
      M.noalias() += w * row * row.transpose();
      g += w * sign * field.mean[i] * row;
      sigma += field.sigma_mean[i];
      ++count;
    }
    if (count < 8) return peak;
    sigma /= count;
    const Eigen::LDLT<Mat6> ldlt(M);
    if (!(ldlt.vectorD().minCoeff() > 1e-6 * ldlt.vectorD().maxCoeff())) return peak;
    const Vec6 c = ldlt.solve(g);
    Q << c[3], c[4], c[4], c[5];
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(Q);
    // Along a valley H hardly changes: no further than where it was found.
    Vec2 step = Vec2::Zero();
    for (int k = 0; k < 2; ++k) {
      const Vec2 axis = eigen.eigenvectors().col(k);
      const double bend = -eigen.eigenvalues()[k], slope = axis.dot(Vec2(c[1], c[2]));
      step += std::clamp(slope / std::max(bend, 0.02 * std::abs(c[0]) + 1e-12), -0.5, 0.5) * axis;
    }
    if (round == 0 && !(eigen.eigenvalues()[0] < 0)) return peak;
    at += reach * (step[0] * e1 + step[1] * e2);
    if ((at - x).norm() > 1.5 * reach) return peak;
    const Jet skin = fitter.fit(at, normal, std::max(0.6 * scene.scale, 2.5 * scene.grain->spacing));
    if (!skin.found()) return peak;
    at = skin.foot;
    peak.covariance = skin.foot_variance * noise * noise * normal * normal.transpose();
    if (step.norm() < 1e-3) break;
  }
  // Position from curvature: covariance Q^-1 s^2 Q^-1 of a gradient with sigma s, none better than the scale allows. A
  // peak that noise helped to choose is bent too much, by about its sigma.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(Q / (reach * reach));
  const double least = kBendNoise * sigma / (scale * scale);
  for (int k = 0; k < 2; ++k) {
    const Vec2 axis = eigen.eigenvectors().col(k);
    const Vec3 direction = axis[0] * e1 + axis[1] * e2;
    const double bend = std::max({-eigen.eigenvalues()[k] - least, 0.5 * least, 1e-6});
    const double s = std::min(kGradient * sigma / scale / bend, 2 * scale);
    peak.covariance += s * s * direction * direction.transpose();
  }
  if (!(noise > 0)) peak.covariance += 1e-12 * Mat3::Identity();
  peak.x = at;
  peak.found = true;
  return peak;
}

}  // namespace

// Lepski: the widest rung that lies within the noise of all finer ones. Bias grows as the square of the scale, so the
// step to the rung beside tells it.
Peak polish(const Run& run, const LandmarkScene& scene, const Vec3& x, const Vec3& normal, int sign) {
  Peak rungs[std::size(kRungs)];
  rungs[0] = polish_at(run, scene, 0, x, normal, sign);
  if (!rungs[0].found) return rungs[0];
  const Eigen::Matrix<double, 2, 3> plane = tangent_plane(normal);
  std::size_t best = 0, last = 0;
  for (std::size_t k = 1; k < std::size(kRungs) && last == best; ++k) {
    rungs[k] = polish_at(run, scene, k, rungs[best].x, normal, sign);
    if (!rungs[k].found) break;
    last = k;
    bool agrees = true;
    for (std::size_t j = 0; j < k; ++j) {
      const Vec2 d = plane * (rungs[k].x - rungs[j].x);
      const Eigen::Matrix2d c = plane * rungs[j].covariance * plane.transpose();
      agrees = agrees && d.dot(c.ldlt().solve(d)) < kAgree;
    }
    if (agrees) best = k;
  }
  Peak out = rungs[best];
  double bias2 = std::pow(kScaleBias * kRungs[best] * scene.scale, 2);
  const std::size_t a = last == best && best > 0 ? best - 1 : best, b = last == best ? best : last;
  if (a < b) {
    const double growth = kRungs[best] * kRungs[best] / (kRungs[b] * kRungs[b] - kRungs[a] * kRungs[a]);
    bias2 += 0.5 * (growth * plane * (rungs[b].x - rungs[a].x)).squaredNorm();
  }
  out.covariance += bias2 * plane.transpose() * plane;
  return out;
}

}  // namespace sgrt
