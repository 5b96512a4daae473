// Residuals and normal equations, see calibration/laser_problem.hpp.
#include "calibration/laser_problem.hpp"

#include <cmath>
#include <limits>

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
constexpr int kAll = -1;  // placements

std::vector<LightPlane> planes_of(const LaserProblem& p, const LaserUnit& unit) {
  std::vector<LightPlane> planes(p.readings.size());
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i] = light_plane(unit, p.readings[i]);
  return planes;
}

LaserNormal empty_normal(const LaserProblem& p, Eigen::Index free) {
  const Eigen::Index size = free + 6 * static_cast<Eigen::Index>(p.views.size());
  return {Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0};
}

// A row of the stripes touches the unit and one pose only.
void add_stripes(const LaserProblem& p, const LaserState& s, const LaserBasis& basis, int placement, LaserNormal& q) {
  const std::vector<LightPlane> planes = planes_of(p, s.unit);
  std::vector<Eigen::Matrix<double, 4, Eigen::Dynamic>> slopes(planes.size());
  for (std::size_t i = 0; i < slopes.size(); ++i) slopes[i] = light_plane_jacobian(s.unit, p.readings[i]) * basis;
  const Eigen::Index free = basis.cols();
  Eigen::VectorXd J(free + 6);
  for (std::size_t i = 0; i < p.sights.size(); ++i) {
    const StripeSight& sight = p.sights[i];
    if (placement != kAll && sight.placement != placement) continue;
    const auto k = static_cast<std::size_t>(p.reading_of[i]);
    const Pose& board = s.poses[static_cast<std::size_t>(sight.placement)];
    const Cut c = cut_of(p.camera, board, planes[k], sight.pixel);
    const double scale = std::sqrt(p.weight[i]) / (c.by_pixel * sight.sigma), r = scale * c.error;
    if (!std::isfinite(r)) {
      q.cost = kInfinity;
      return;
    }
    const Vec3 n = board.R.col(2);
    // B exp(w, v): the board's normal turns by R (w x z), its origin moves by R v.
    const double along = planes[k].n.dot(c.ray) / n.dot(c.ray);
    const Vec3 lever = board.R.transpose() * (board.t - c.x);
    J.head(free) = scale * (slopes[k].topRows<3>().transpose() * c.x - slopes[k].row(3).transpose());
    J.segment<3>(free) = scale * along * Vec3::UnitZ().cross(lever);
    J.tail<3>() = scale * along * Vec3::UnitZ();
    const Eigen::Index at = free + 6 * sight.placement;
    q.H.topLeftCorner(free, free) += J.head(free) * J.head(free).transpose();
    q.H.block(at, 0, 6, free) += J.tail<6>() * J.head(free).transpose();
    q.H.block<6, 6>(at, at) += J.tail<6>() * J.tail<6>().transpose();
    q.g.head(free) -= r * J.head(free);
    q.g.segment<6>(at) -= r * J.tail<6>();
    q.cost += r * r;
  }
}

void add_corners(const LaserProblem& p, const LaserState& s, Eigen::Index free, LaserNormal& q) {
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    const View& view = p.views[v];
    const Pose& board = s.poses[v];
    const Eigen::Index at = free + 6 * static_cast<Eigen::Index>(v);
    for (std::size_t i = 0; i < view.index.size(); ++i) {
      const Vec3 point = p.target.points.row(view.index[i]).transpose();
      Mat23 by_point;
      const Vec2 pixel = project(p.camera, board * point, &by_point);
      const double scale = 1 / (p.corner_noise * view.sigma[i]);
      const Vec2 r = scale * (view.pixel[i] - pixel);
      if (!r.allFinite()) {
        q.cost = kInfinity;
        return;
      }
      Eigen::Matrix<double, 2, 6> J;
      J << -by_point * board.R * skew(point), by_point * board.R;
      J *= scale;
      q.H.block<6, 6>(at, at) += J.transpose() * J;
      q.g.segment<6>(at) += J.transpose() * r;
      q.cost += r.squaredNorm();
    }
  }
}

}  // namespace

LaserBasis basis_of(const LaserUnit& u) {
  const auto tangents = [](const Vec3& v) {
    Mat32 t;
    t.col(0) = v.unitOrthogonal();
    t.col(1) = v.cross(t.col(0));
    return t;
  };
  constexpr double mrad = 1e-3;
  LaserBasis B = LaserBasis::Zero(kLaserParameters, u.mirror ? 11 : 3);
  B.block<3, 2>(0, 0) = mrad * tangents(u.fan_normal);
  B(3, 2) = 1;
  if (!u.mirror) return B;
  const Mat32 across = tangents(u.axis_direction);
  B.block<3, 2>(4, 3) = mrad * across;
  B.block<3, 2>(7, 5) = across;
  B.block<3, 2>(10, 7) = mrad * tangents(u.normal_at_zero);
  B(13, 9) = 1;
  B(14, 10) = mrad;
  return B;
}

Vec3 point_on_board(const Camera& camera, const Pose& board, const Vec2& pixel) {
  const Vec3 ray = unproject(camera, pixel), from = camera.centre_in_room(), n = board.R.col(2);
  return from + n.dot(board.t - from) / n.dot(ray) * ray;
}

Cut cut_of(const Camera& camera, const Pose& board, const LightPlane& plane, const Vec2& pixel) {
  Cut c;
  Mat32 by_pixel;
  c.ray = unproject(camera, pixel, &by_pixel);
  const Vec3 n = board.R.col(2), from = camera.centre_in_room();
  const double t = n.dot(board.t - from) / n.dot(c.ray);
  c.x = from + t * c.ray;
  c.error = plane.n.dot(c.x) - plane.d;
  const Mat32 dx = t * (by_pixel - c.ray * (n.transpose() * by_pixel) / n.dot(c.ray));
  c.by_pixel = (plane.n.transpose() * dx).cwiseAbs().maxCoeff();
  if (!(t > 0)) c.error = kNaN;
  return c;
}

std::vector<double> stripe_residuals(const LaserProblem& p, const LaserState& s) {
  const std::vector<LightPlane> planes = planes_of(p, s.unit);
  std::vector<double> residuals(p.sights.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const StripeSight& sight = p.sights[i];
    const Cut c = cut_of(p.camera, s.poses[static_cast<std::size_t>(sight.placement)],
                         planes[static_cast<std::size_t>(p.reading_of[i])], sight.pixel);
    residuals[i] = c.error / c.by_pixel;
  }
  return residuals;
}

LaserNormal normal_of(const LaserProblem& p, const LaserState& s) {
  const LaserBasis basis = basis_of(s.unit);
  const Eigen::Index free = basis.cols();
  LaserNormal q = empty_normal(p, free);
  add_stripes(p, s, basis, kAll, q);
  add_corners(p, s, free, q);
  // Small turns from the start in the units of the basis.
  for (Eigen::Index i = 0; i < free; ++i) {
    const Eigen::VectorXd b = basis.col(i);
    const double off = b.dot(s.off) / b.squaredNorm();
    q.H(i, i) += 1 / (kLaserPrior * kLaserPrior);
    q.g(i) -= off / (kLaserPrior * kLaserPrior);
    q.cost += off * off / (kLaserPrior * kLaserPrior);
  }
  q.H.triangularView<Eigen::StrictlyUpper>() = q.H.transpose();
  return q;
}

LaserNormal stripes_of_placement(const LaserProblem& p, const LaserState& s, int placement) {
  const LaserBasis basis = basis_of(s.unit);
  LaserNormal q = empty_normal(p, basis.cols());
  add_stripes(p, s, basis, placement, q);
  return q;
}

LaserState stepped(const LaserState& s, const Eigen::VectorXd& step) {
  LaserState next = s;
  const LaserBasis basis = basis_of(s.unit);
  const LaserVector by = basis * step.head(basis.cols());
  next.unit = moved(s.unit, by);
  next.unit.fan_normal.normalize();
  next.unit.axis_direction.normalize();
  next.unit.normal_at_zero.normalize();
  next.off += by;
  for (std::size_t v = 0; v < s.poses.size(); ++v)
    next.poses[v] = s.poses[v] * se3_exp(step.segment<6>(basis.cols() + 6 * static_cast<Eigen::Index>(v)));
  return next;
}

}  // namespace sgrt
