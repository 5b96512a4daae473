// Curves and surfaces to nets and back.
#include "nurbs/net.hpp"

#include "core/error.hpp"
#include "nurbs/homogeneous.hpp"

namespace sgrt {
namespace {

using Eigen::Index;

void put(const Net& net, Index row, Index across, Points& points, Eigen::VectorXd& weights, Index to) {
  const double* h = net.rows.row(row).data() + net.width * across;
  const double w = net.rational() ? h[3] : 1;
  points.row(to) << h[0] / w, h[1] / w, h[2] / w;
  if (net.rational()) weights[to] = w;
}

}  // namespace

Net net_of(const NurbsCurve& curve) {
  Net net{curve.basis, {}, curve.rational() ? 4 : 3};
  net.rows.resize(curve.points.rows(), net.width);
  for (Index i = 0; i < curve.points.rows(); ++i) {
    net.rows.row(i) = homogeneous(curve.points, curve.weights, i).head(net.width).transpose();
  }
  return net;
}

Net net_of(const NurbsSurface& surface, int direction) {
  require(direction == 0 || direction == 1, "direction: expected 0 (u) or 1 (v)");
  const Index nu = surface.nu(), nv = surface.nv();
  Net net{surface.basis[direction], {}, surface.rational() ? 4 : 3};
  net.rows.resize(direction == 0 ? nu : nv, net.width * (direction == 0 ? nv : nu));
  for (Index i = 0; i < nu; ++i) {
    for (Index j = 0; j < nv; ++j) {
      net.rows.row(direction == 0 ? i : j).segment(net.width * (direction == 0 ? j : i), net.width) =
          homogeneous(surface.points, surface.weights, i * nv + j).head(net.width).transpose();
    }
  }
  return net;
}

NurbsCurve curve_of(const Net& net) {
  NurbsCurve curve{net.basis, Points(net.rows.rows(), 3), Eigen::VectorXd(net.rational() ? net.rows.rows() : 0)};
  for (Index i = 0; i < net.rows.rows(); ++i) put(net, i, 0, curve.points, curve.weights, i);
  return make_nurbs_curve(std::move(curve));
}

NurbsSurface surface_of(const Net& net, const NurbsSurface& like, int direction) {
  NurbsSurface s{{like.basis[0], like.basis[1]}, {}, {}};
  s.basis[direction] = net.basis;
  const Index nu = s.nu(), nv = s.nv();
  s.points.resize(nu * nv, 3);
  if (net.rational()) s.weights.resize(nu * nv);
  for (Index i = 0; i < nu; ++i) {
    for (Index j = 0; j < nv; ++j) {
      put(net, direction == 0 ? i : j, direction == 0 ? j : i, s.points, s.weights, i * nv + j);
    }
  }
  return make_nurbs_surface(std::move(s));
}

}  // namespace sgrt
