// A laser unit to start from, see calibration/laser.hpp; docs/theory/laser.md eq. 21-22.
#include <algorithm>
#include <cmath>
#include <set>

#include "calibration/laser.hpp"
#include "calibration/text.hpp"

namespace sgrt {
namespace {

// Light planes that change smoothly with the reading: n(a), d(a) = sum of c_k a^k, the smallest eigenvector of the
// points' equations n(a).x = d(a).
struct Family {
  Eigen::Matrix<double, 4, Eigen::Dynamic> c;
  double middle, half;  // of the readings
  Vec3 centre;
  double scale;

  LightPlane at(double reading) const {
    const double a = (reading - middle) / half;
    Eigen::Vector4d p = Eigen::Vector4d::Zero();
    for (Eigen::Index k = c.cols(); k-- > 0;) p = p * a + c.col(k);
    const double length = p.head<3>().norm();
    const Vec3 n = p.head<3>() / length;
    return {n, n.dot(centre) - scale * p(3) / length};
  }
};

Family fit_family(const std::vector<Vec3>& x, const std::vector<double>& reading, int terms) {
  Family f;
  const auto [low, high] = std::minmax_element(reading.begin(), reading.end());
  f.middle = (*low + *high) / 2;
  f.half = std::max((*high - *low) / 2, 1e-12);
  f.centre.setZero();
  for (const Vec3& p : x) f.centre += p / static_cast<double>(x.size());
  double square = 0;
  for (const Vec3& p : x) square += (p - f.centre).squaredNorm() / static_cast<double>(x.size());
  f.scale = std::sqrt(square);
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(4 * terms, 4 * terms);
  Eigen::VectorXd row(4 * terms);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double a = (reading[i] - f.middle) / f.half;
    Eigen::Vector4d h;
    h << (x[i] - f.centre) / f.scale, 1;
    for (int k = 0; k < terms; ++k) row.segment<4>(4 * k) = std::pow(a, k) * h;
    N += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(N);
  // A second vector as good as the first: the points lie on lines, not on planes.
  const Eigen::VectorXd& e = solver.eigenvalues();
  if (!(e(1) > 1e-8 * e(e.size() - 1) && e(1) > 2 * e(0)))
    fail(Status::kDegenerate,
         "the stripe's points do not tell the light plane: expected the board at two distances or tilts or more");
  f.c = Eigen::Map<const Eigen::Matrix<double, 4, Eigen::Dynamic>>(solver.eigenvectors().col(0).data(), 4, terms);
  return f;
}

}  // namespace

LaserUnit first_unit(const std::vector<Vec3>& x, const std::vector<double>& reading, bool fixed, const Vec3& camera) {
  constexpr double kLeastTurn = 2e-3;  // rad
  LaserUnit u;
  const std::set<double> distinct(reading.begin(), reading.end());
  u.mirror = !fixed;
  if (fixed) {
    const LightPlane p = fit_family(x, reading, 1).at(reading.front());
    u.fan_normal = p.n;
    u.fan_point = camera + (p.d - p.n.dot(camera)) * p.n;
    return u;
  }
  const Family f = fit_family(x, reading, 2);  // linear in the angle: enough to start from
  const double a1 = *distinct.begin(), a2 = *distinct.rbegin();
  const LightPlane p1 = f.at(a1), p2 = f.at(a2), middle = f.at((a1 + a2) / 2);
  const Vec3 axis = p1.n.cross(p2.n);
  if (!(axis.norm() > kLeastTurn))
    fail(Status::kDegenerate, "the light plane turns by " + rounded(axis.norm(), 5) +
                                  " rad over the sweep, expected at least " + text_of(kLeastTurn));
  u.axis_direction = axis.normalized();
  u.angle_scale = std::asin(std::min(1.0, axis.norm())) / (2 * (a2 - a1));
  Mat3 A;  // the line that both planes share, nearest to the camera
  A << p1.n.transpose(), p2.n.transpose(), u.axis_direction.transpose();
  u.axis_point = A.inverse() * Vec3(p1.d, p2.d, u.axis_direction.dot(camera));
  // A mirror at 45 degrees in the middle of the sweep: with light that meets the axis any other would do as well.
  u.fan_normal = u.axis_direction.cross(middle.n).normalized();
  u.fan_point = u.axis_point;
  const Vec3 n = (u.fan_normal - middle.n).normalized();
  u.normal_at_zero = so3_exp(-u.angle_scale * (a1 + a2) / 2 * u.axis_direction) * n;
  return u;
}

}  // namespace sgrt
