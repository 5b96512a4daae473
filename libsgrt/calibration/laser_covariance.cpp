// The covariance of a laser unit, see calibration/laser_problem.hpp; docs/theory/laser.md eq. 19.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "calibration/laser_problem.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

// The unit's information, the boards eliminated.
Eigen::MatrixXd unit_information(const LaserNormal& q, Eigen::Index free) {
  const Eigen::Index rest = q.H.rows() - free;
  return q.H.topLeftCorner(free, free) -
         q.H.topRightCorner(free, rest) * Eigen::MatrixXd(q.H.bottomRightCorner(rest, rest))
                                              .ldlt()
                                              .solve(Eigen::MatrixXd(q.H.bottomLeftCorner(rest, free)));
}

// Directions that the prior alone holds, in words.
void name_unfixed(const Eigen::MatrixXd& covariance, LaserCalibration& r) {
  static constexpr std::array<const char*, 11> kWords = {"turn of the fan",   "turn of the fan",  "the fan's distance",
                                                         "tilt of the axis",  "tilt of the axis", "place of the axis",
                                                         "place of the axis", "mirror's normal",  "mirror's normal",
                                                         "mirror's offset",   "angle scale"};
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  for (Eigen::Index i = 0; i < covariance.cols(); ++i) {
    const double sigma = std::sqrt(std::max(solver.eigenvalues()(i), 0.0));
    if (sigma < 0.3 * kLaserPrior) continue;
    std::string words;
    std::set<std::string> said;
    for (Eigen::Index k = 0; k < covariance.cols(); ++k) {
      if (std::abs(solver.eigenvectors()(k, i)) < 0.3 || !said.insert(kWords[static_cast<std::size_t>(k)]).second)
        continue;
      words += (words.empty() ? "" : ", ") + std::string(kWords[static_cast<std::size_t>(k)]);
    }
    r.unfixed.push_back(words + (said.size() > 1 ? " together" : ""));
  }
}

// Errors that the points of a stripe have in common (the board's flatness, its pose, the lens) do not average out along
// it: how much further than independent noise the means of the stripes' quarters lie from 0, over the placements (eq.
// 19).
double common_scale(const LaserCalibration& r) {
  std::map<std::pair<int, double>, std::vector<std::pair<Vec2, double>>> stripes;
  for (std::size_t i = 0; i < r.sights.size(); ++i) {
    const StripeSight& sight = r.sights[i];
    if (r.counts[i]) stripes[{sight.placement, sight.reading}].push_back({sight.pixel, r.residuals[i] / sight.sigma});
  }
  double sum = 0;
  int count = 0;
  for (auto& [key, points] : stripes) {
    std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.first.sum() < b.first.sum(); });
    const std::size_t n = points.size() / 4;
    for (std::size_t quarter = 0; quarter < 4 && n >= 4; ++quarter, ++count) {
      double mean = 0;
      for (std::size_t i = quarter * n; i < (quarter + 1) * n; ++i) mean += points[i].second / static_cast<double>(n);
      sum += mean * mean * static_cast<double>(n);
    }
  }
  constexpr int kFew = 8;
  return count > kFew ? std::sqrt(sum / (count - kFew)) : 1;
}

// Errors that all stripes on the board in one place have in common (its pose, the lens there): the gradients g_v of the
// places, which are 0 in sum, over what independent noise lets expect of them, Cov g_v = H_v - H_v H^-1 H_v, H_v the
// place's own information (eq. 19).
double place_scale(const LaserProblem& p, const LaserState& s, const LaserNormal& whole,
                   const Eigen::MatrixXd& information) {
  const Eigen::Index free = information.rows();
  const Eigen::LDLT<Eigen::MatrixXd> solver(information);
  double sum = 0, expected = static_cast<double>(free);
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    const LaserNormal own = stripes_of_placement(p, s, static_cast<int>(v));
    const Eigen::Index at = free + 6 * static_cast<Eigen::Index>(v);
    const Eigen::MatrixXd H =
        own.H.topLeftCorner(free, free) -
        whole.H.block(0, at, free, 6) * Mat6(whole.H.block<6, 6>(at, at)).ldlt().solve(whole.H.block(at, 0, 6, free));
    const Eigen::MatrixXd share = solver.solve(H);
    sum += own.g.head(free).dot(solver.solve(own.g.head(free)));
    expected -= (share * share).trace();
  }
  return expected > 0.5 ? std::sqrt(sum / expected) : 1;
}

}  // namespace

void set_covariance(const LaserProblem& p, const LaserState& s, LaserCalibration& r) {
  const LaserBasis basis = basis_of(s.unit);
  const LaserNormal whole = normal_of(p, s);
  const Eigen::MatrixXd information = unit_information(whole, basis.cols());
  const double scale = std::max({r.noise_scale, common_scale(r), place_scale(p, s, whole, information)});
  const Eigen::MatrixXd own = scale * scale * information.inverse();
  if (!own.allFinite()) fail(Status::kDegenerate, "the stripes leave the laser unit free");
  name_unfixed(information.inverse(), r);
  r.parameters = parameter_names(s.unit);
  r.covariance = basis * own * basis.transpose();
  std::vector<double> effect;
  effect.reserve(p.sights.size());
  for (std::size_t i = 0; i < p.sights.size(); i += 7) {
    const StripeSight& sight = p.sights[i];
    const LightPlane plane = light_plane(s.unit, sight.reading);
    const Cut c = cut_of(p.camera, s.poses[static_cast<std::size_t>(sight.placement)], plane, sight.pixel);
    const PlaneJacobian J = light_plane_jacobian(s.unit, sight.reading);
    const LaserVector e = J.topRows<3>().transpose() * c.x - J.row(3).transpose();
    effect.push_back(std::sqrt(e.dot(r.covariance * e)) / std::abs(plane.n.dot(c.ray)));
  }
  r.sigma_mm = median(effect);
}

RigUncertainty joined(const RigUncertainty& before, const LaserCalibration& r) {
  RigUncertainty u;
  u.residual_px = before.residual_px;
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < before.parameters.size(); ++i) {
    if (std::find(r.parameters.begin(), r.parameters.end(), before.parameters[i]) != r.parameters.end()) continue;
    u.parameters.push_back(before.parameters[i]);
    kept.push_back(static_cast<Eigen::Index>(i));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(r.covariance);
  std::vector<Eigen::Index> own;
  for (Eigen::Index i = r.covariance.cols(); i-- > 0;) {
    if (solver.eigenvalues()(i) > 1e-14 * solver.eigenvalues().maxCoeff()) own.push_back(i);
  }
  const auto rows = static_cast<Eigen::Index>(kept.size()), columns = before.modes.cols();
  u.modes = Eigen::MatrixXd::Zero(rows + r.covariance.rows(), columns + static_cast<Eigen::Index>(own.size()));
  for (Eigen::Index i = 0; i < rows; ++i)
    u.modes.row(i).head(columns) = before.modes.row(kept[static_cast<std::size_t>(i)]);
  for (std::size_t i = 0; i < own.size(); ++i)
    u.modes.col(columns + static_cast<Eigen::Index>(i)).tail(r.covariance.rows()) =
        std::sqrt(solver.eigenvalues()(own[i])) * solver.eigenvectors().col(own[i]);
  u.parameters.insert(u.parameters.end(), r.parameters.begin(), r.parameters.end());
  return u;
}

}  // namespace sgrt
