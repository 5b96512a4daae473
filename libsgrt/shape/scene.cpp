// Curvature at a scale, candidates, and the place of an extremum. docs/theory/landmarks.md eq. 1-5.
#include "shape/scene.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kWanted = 0.006;                 // 1/mm, sigma of H
constexpr double kWidest = 12;                    // mm
constexpr double kStandsOut = 2.5;                // sigmas of persistence
constexpr std::size_t kMostCandidates = 40;       // of each sign
constexpr double kAbout = 0.75;                   // of the quadric through the curvature, over the scale
constexpr double kGradient = 1.25;                // sigma of H's gradient times the scale, over sigma of H (eq. 4)
constexpr double kBendNoise = 3.0;                // of H's second derivative times the scale squared, likewise
constexpr double kRungs[] = {1, 1.35, 1.8, 2.4};  // of the scale
constexpr double kCapBias = 0.05;                 // of C R^2: how far a disc of radius R moves a cap of curvedness C
constexpr double kValleyBias = 0.2;               // the same of a valley, one side of which is steeper
constexpr double kStray = 1;                      // of the scale: a peak further from where it was seen is another
constexpr double kUnlikeLaw = 0.3;                // of the bias: how far it is from growing as said
constexpr double kRest = 0.7;                     // of the bias, that the scales together do not tell
constexpr double kLeastLeft = 0.25;               // of a form's curvature squared in a disc
constexpr double kAgree = 2.5;                    // sigmas between two scales of one extremum
constexpr double kMostBias = 0.2;                 // of R: the most of that

CurvatureField field_at(const Run& run, const Surface& surface, const Grain& grain, double radius) {
  CurvatureOptions o;
  o.degree = kLandmarkDegree;
  o.max_sigma = 1;
  o.radius = radius;
  return surface_curvature(run, surface, grain, o);
}

}  // namespace

LandmarkScene make_landmark_scene(const Run& run, const Surface& surface, const Grain& grain, double scale) {
  if (!(grain.spacing > 0)) fail(Status::kInsufficientData, "the surface has too few points for landmarks");
  LandmarkScene s{&surface, &grain, scale, {}, Nearest(run, surface.points), {}};
  const double sigma = grain.noise > 0 ? grain.noise * std::sqrt(surface.correlation_points) : 0;
  s.scale =
      std::max({scale, 2.6 * grain.spacing, std::min(kWidest, std::cbrt(3.91 * sigma * grain.spacing / kWanted))});
  s.rungs.reserve(std::size(kRungs));
  s.rungs.push_back(field_at(run, surface, grain, s.scale));
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

void widen(const Run& run, LandmarkScene& scene) {
  for (std::size_t k = scene.rungs.size(); k < std::size(kRungs); ++k)
    scene.rungs.push_back(field_at(run, *scene.surface, *scene.grain, kRungs[k] * scene.scale));
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

struct Rung {
  Peak peak;  // covariance: of noise alone
  double radius;
  double bias;  // mm, sigma of what the disc moves the peak by
};

// Along one direction of the skin: rung k sees x0 + bias_k a + noise, a of sigma 1. A wide disc averages the noise of
// the fine ones, so that rungs share the variance of the wider one (Hausman 1978). Returns x0 and its variance.
std::pair<double, double> at_no_scale(const std::vector<Rung>& rungs, const Vec3& origin, const Vec3& axis) {
  const auto n = static_cast<Eigen::Index>(rungs.size());
  Eigen::VectorXd v(n), x(n);
  Eigen::MatrixX2d D(n, 2);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Rung& r = rungs[static_cast<std::size_t>(k)];
    v[k] = axis.dot(r.peak.covariance * axis) + 1e-8;
    x[k] = axis.dot(r.peak.x - origin);
    D.row(k) << 1, r.bias;
  }
  // The gradient's noise falls as R^-4, the bend of H by R^-2 at most; a fine peak that noise made looks better than
  // that.
  for (Eigen::Index k = n - 2; k >= 0; --k) {
    const double wider = rungs[static_cast<std::size_t>(k) + 1].radius / rungs[static_cast<std::size_t>(k)].radius;
    v[k] = std::max(v[k], std::pow(wider, 4) * v[k + 1]);
  }
  Eigen::MatrixXd S(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index k = 0; k < n; ++k) S(j, k) = v[std::max(j, k)];
    S(j, j) += std::pow(kUnlikeLaw * D(j, 1), 2);
  }
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(S);
  Eigen::Matrix2d information = D.transpose() * ldlt.solve(D);
  information(1, 1) += 1;
  const Eigen::Matrix2d covariance = information.inverse();
  return {(covariance * (D.transpose() * ldlt.solve(x)))[0], covariance(0, 0)};
}

// The curvature tensor of a fit on the axes of its tangent plane.
Eigen::Matrix2d bend_of(const Jet& skin, const Eigen::Matrix<double, 2, 3>& plane) {
  return plane * tensor_of(skin) * plane.transpose();
}

double square(double x) {
  return x * x;
}

}  // namespace

// Noise, which a wider disc lessens, against the disc, which draws a form of curvedness C off by about C R^2 of its
// radius R: the rungs together tell where the extremum would be at no scale. Found from the wide ones down, so that
// noise does not choose the place.
Peak polish(const Run& run, const LandmarkScene& scene, const Vec3& x, const Vec3& outward, int sign) {
  const double about = std::max(0.6 * scene.scale, 2.5 * scene.grain->spacing);
  const Jet first = JetFitter(run, scene.grain->pyramid, kLandmarkDegree).fit(x, outward, about);
  const Vec3 normal = first.found() ? first.normal : outward;
  const Eigen::Matrix<double, 2, 3> plane = tangent_plane(normal);
  const auto hit = scene.nearest.nearest(x, scene.scale);
  const double seen = hit.index < 0 ? 0 : curvedness(scene.field().k1[hit.index], scene.field().k2[hit.index]);
  // What a disc of radius R leaves of a form of curvedness C, C / sqrt(1 + C^2 R^2), taken back.
  const double C = seen / std::sqrt(std::max(1 - square(seen * scene.scale), kLeastLeft));
  const double form = sign > 0 ? kCapBias : kValleyBias;
  std::vector<Rung> rungs;
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = scene.rungs.size(); k-- > 0;) {
    const double R = kRungs[k] * scene.scale;
    const Peak peak = polish_at(run, scene, k, rungs.empty() ? x : rungs[best].peak.x, normal, sign);
    if (!peak.found || (peak.x - x).norm() > kStray * scene.scale) continue;
    rungs.push_back({peak, R, std::min(form * (C > 0 ? C : 1) * R * R, kMostBias * R)});
    const double error = (plane * peak.covariance * plane.transpose()).trace() + std::pow(rungs.back().bias, 2);
    if (error < least) least = error, best = rungs.size() - 1;
  }
  if (rungs.empty()) return {};
  const Peak found = rungs[best].peak;
  const double radius = rungs[best].radius;
  const double slack = std::pow(kAgree, 2) * least;
  rungs.erase(std::remove_if(rungs.begin(), rungs.end(),
                             [&](const Rung& r) {
                               const double far2 = (plane * (r.peak.x - found.x)).squaredNorm();
                               return far2 > slack + std::pow(kAgree * r.bias, 2) +
                                                 std::pow(kAgree, 2) * r.peak.covariance.trace();
                             }),
              rungs.end());
  std::reverse(rungs.begin(), rungs.end());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(plane * found.covariance * plane.transpose());
  const double rest = 0.5 * square(kRest * kValleyBias * std::min(C * square(radius), radius));
  Peak out = found;
  out.covariance = normal.dot(found.covariance * normal) * normal * normal.transpose();
  for (int k = 0; k < 2; ++k) {
    const Vec3 axis = plane.transpose() * eigen.eigenvectors().col(k);
    const auto [step, variance] = at_no_scale(rungs, found.x, axis);
    out.x += step * axis;
    out.covariance += (variance + rest) * axis * axis.transpose();
  }
  const Jet skin = JetFitter(run, scene.grain->pyramid, kLandmarkDegree).fit(out.x, normal, about);
  if (!skin.found()) return out;
  out.x = skin.foot;
  // The ellipsoid lies in the skin's own tangent plane, and the skin bends away from that: a place off by s along a
  // direction of curvature k lies k s^2 / 2 deeper.
  const Eigen::Matrix<double, 2, 3> own = tangent_plane(skin.normal);
  const Eigen::Matrix2d flat = own * out.covariance * own.transpose();
  const Eigen::Matrix2d sag = bend_of(skin, own) * flat;
  const double depth =
      skin.foot_variance * square(scene.grain->noise) + 0.25 * (2 * (sag * sag).trace() + square(sag.trace()));
  out.covariance = own.transpose() * flat * own + std::max(depth, 1e-12) * skin.normal * skin.normal.transpose();
  return out;
}

}  // namespace sgrt
