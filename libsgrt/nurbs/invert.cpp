// Branch and bound for the closest point. A piece is bounded from below by its box and by the slab of its control
// points across the line of sight; the second closes in with the square of the piece's size, so that near the foot the
// number of pieces stays bounded.
#include "nurbs/invert.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "nurbs/homogeneous.hpp"
#include "nurbs/knots.hpp"

namespace sgrt {
namespace {

using Piece = std::vector<Vec4>;  // homogeneous Bezier points, (p + 1) x (q + 1), v fastest

struct Node {
  Piece points;
  double u0, u1, v0, v1;
  int depth;
};

struct Entry {
  double bound;
  int node;
  bool operator<(const Entry& other) const {  // for a heap with the lowest bound on top
    return bound > other.bound || (bound == other.bound && node > other.node);
  }
};

double box_distance(const Vec3& low, const Vec3& high, const Vec3& x) {
  return (low - x).cwiseMax(x - high).cwiseMax(0).norm();
}

double lower_bound_of(const Piece& points, const Vec3& x) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low, mean = Vec3::Zero();
  for (const Vec4& h : points) {
    const Vec3 p = h.head<3>() / h[3];
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    mean += p;
  }
  const Vec3 sight = mean / static_cast<double>(points.size()) - x;
  const double length = sight.norm(), box = box_distance(low, high, x);
  if (!(length > 0)) return box;
  double slab = std::numeric_limits<double>::infinity();
  for (const Vec4& h : points) slab = std::min(slab, sight.dot(h.head<3>() / h[3] - x) / length);
  return std::max(box, slab);
}

// How long the control polygons along u, or along v, are in all, over their number.
double length_along(const Piece& points, int p, int q, bool in_u) {
  double sum = 0;
  for (int i = 0; i + (in_u ? 1 : 0) <= p; ++i) {
    for (int j = 0; j + (in_u ? 0 : 1) <= q; ++j) {
      const Vec4& a = points[static_cast<std::size_t>(i * (q + 1) + j)];
      const Vec4& b = points[static_cast<std::size_t>((i + (in_u ? 1 : 0)) * (q + 1) + j + (in_u ? 0 : 1))];
      sum += (a.head<3>() / a[3] - b.head<3>() / b[3]).norm();
    }
  }
  return sum / (in_u ? q + 1 : p + 1);
}

// De Casteljau at the middle along one direction: `points` becomes the first half, the second is returned.
Piece halve(Piece& points, int degree, std::size_t stride, std::size_t lines, std::size_t line_step) {
  Piece second = points;
  for (std::size_t line = 0; line < lines; ++line) {
    Vec4* a = points.data() + line * line_step;
    Vec4* b = second.data() + line * line_step;
    const auto p = static_cast<std::size_t>(degree);
    for (std::size_t r = 1; r <= p; ++r) {  // b holds the triangle's last row, from its end
      for (std::size_t i = p; i >= r; --i) a[i * stride] = 0.5 * (a[(i - 1) * stride] + a[i * stride]);
    }
    Vec4 triangle[kMaxDegree + 1];
    for (std::size_t i = 0; i <= p; ++i) triangle[i] = b[i * stride];
    for (std::size_t r = 0; r <= p; ++r) {
      b[(p - r) * stride] = triangle[p - r];
      for (std::size_t i = 0; i + 1 + r <= p; ++i) triangle[i] = 0.5 * (triangle[i] + triangle[i + 1]);
    }
  }
  return second;
}

}  // namespace

struct ClosestFinder::Data {
  std::unique_ptr<SurfaceEvaluator> evaluator;
  bool curve;
  int p, q;
  double size;
  std::vector<Node> roots;
  std::vector<Vec3> low, high, corner;

  void newton(const Vec3& x, double u, double v, ClosestPoint& best) const;
};

namespace {

struct Foot {
  double u, v, f;
  Vec3 d[6];
};

void look(const SurfaceEvaluator& evaluator, const Vec3& x, Foot& foot) {
  const double uv[2] = {foot.u, foot.v};
  kernels::points_baseline(evaluator.patch(), uv, 1, 2, foot.d[0].data());
  foot.f = (foot.d[0] - x).squaredNorm();
}

// The step of Newton's method on f / 2 within the domain; Gauss-Newton where the Hessian is not positive.
Vec2 newton_step(const Foot& foot, const Vec3& x, const SplineBasis* basis, bool curve) {
  const Vec3 r = foot.d[0] - x, &Su = foot.d[1], &Sv = foot.d[2];
  double gu = r.dot(Su), gv = curve ? 0 : r.dot(Sv);
  const bool hold_u = (foot.u <= basis[0].begin() && gu > 0) || (foot.u >= basis[0].end() && gu < 0);
  const bool hold_v = curve || (foot.v <= basis[1].begin() && gv > 0) || (foot.v >= basis[1].end() && gv < 0);
  double huu = Su.squaredNorm() + r.dot(foot.d[3]), huv = Su.dot(Sv) + r.dot(foot.d[4]);
  double hvv = Sv.squaredNorm() + r.dot(foot.d[5]);
  if (hold_u || hold_v) huv = 0;
  const bool positive =
      (hold_u || huu > 0) && (hold_v || hvv > 0) && (hold_u || hold_v || huu * hvv - huv * huv > 1e-12 * huu * hvv);
  if (!positive) {
    huu = Su.squaredNorm();
    hvv = Sv.squaredNorm();
    huv = hold_u || hold_v ? 0 : Su.dot(Sv) * (1 - 1e-6);
  }
  if (hold_u || !(huu > 0)) gu = 0, huu = 1, huv = 0;
  if (hold_v || !(hvv > 0)) gv = 0, hvv = 1, huv = 0;
  const double det = huu * hvv - huv * huv;
  return Vec2(-(hvv * gu - huv * gv) / det, -(huu * gv - huv * gu) / det);
}

}  // namespace

void ClosestFinder::Data::newton(const Vec3& x, double u, double v, ClosestPoint& best) const {
  const SplineBasis* basis = evaluator->surface().basis;
  Foot now{u, v, 0, {}};
  look(*evaluator, x, now);
  for (int iteration = 0; iteration < 30; ++iteration) {
    const Vec2 step = newton_step(now, x, basis, curve);
    bool better = false;
    double moved = 0;
    for (double share = 1; share > 1e-6 && !better; share *= 0.25) {
      Foot next{std::clamp(now.u + share * step[0], basis[0].begin(), basis[0].end()),
                std::clamp(now.v + share * step[1], basis[1].begin(), basis[1].end()),
                0,
                {}};
      moved = now.d[1].norm() * std::abs(next.u - now.u) + now.d[2].norm() * std::abs(next.v - now.v);
      if (!(moved > 1e-15 * size)) break;
      look(*evaluator, x, next);
      better = next.f < now.f || (share == 1 && moved < 1e-7 * size && next.f <= now.f * (1 + 1e-14));
      if (better) now = next;
    }
    if (!better || moved < 1e-14 * size) break;
  }
  const double distance = std::sqrt(now.f);
  if (distance < best.distance) best = {now.u, curve ? 0 : now.v, now.d[0], distance, 0};
}

namespace {

NurbsSurface ribbon(const NurbsCurve& curve) {  // the same point for every v
  NurbsSurface s{{curve.basis, uniform_basis(1, 2)}, Points(2 * curve.points.rows(), 3), {}};
  if (curve.rational()) s.weights.resize(s.points.rows());
  for (Eigen::Index i = 0; i < s.points.rows(); ++i) {
    s.points.row(i) = curve.points.row(i / 2);
    if (curve.rational()) s.weights[i] = curve.weights[i / 2];
  }
  return s;
}

}  // namespace

ClosestFinder::ClosestFinder(const NurbsCurve& curve) : ClosestFinder(ribbon(curve)) {
  const_cast<Data&>(*data_).curve = true;
}

ClosestFinder::ClosestFinder(const NurbsSurface& surface) {
  auto data = std::make_unique<Data>();
  const NurbsSurface bezier = to_bezier(to_bezier(surface, 0), 1);
  data->curve = false;
  data->p = bezier.basis[0].degree;
  data->q = bezier.basis[1].degree;
  data->size = (surface.points.colwise().maxCoeff() - surface.points.colwise().minCoeff()).norm();
  const std::vector<double> us = breaks(bezier.basis[0]), vs = breaks(bezier.basis[1]);
  for (std::size_t a = 0; a + 1 < us.size(); ++a) {
    for (std::size_t b = 0; b + 1 < vs.size(); ++b) {
      Node node{{}, us[a], us[a + 1], vs[b], vs[b + 1], 0};
      Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
      for (int i = 0; i <= data->p; ++i) {
        for (int j = 0; j <= data->q; ++j) {
          const Eigen::Index k =
              (static_cast<Eigen::Index>(a) * data->p + i) * bezier.nv() + static_cast<Eigen::Index>(b) * data->q + j;
          node.points.push_back(homogeneous(bezier.points, bezier.weights, k));
          low = low.cwiseMin(bezier.points.row(k).transpose());
          high = high.cwiseMax(bezier.points.row(k).transpose());
        }
      }
      data->corner.push_back(node.points[0].head<3>() / node.points[0][3]);
      data->low.push_back(low);
      data->high.push_back(high);
      data->roots.push_back(std::move(node));
    }
  }
  data->evaluator = std::make_unique<SurfaceEvaluator>(surface);
  data_ = std::move(data);
}

ClosestFinder::~ClosestFinder() = default;

ClosestPoint ClosestFinder::operator()(const Vec3& x) const {
  constexpr int kMost = 20000;  // nodes beyond the pieces, of one query
  const Data& d = *data_;
  ClosestPoint best{0, 0, Vec3::Zero(), std::numeric_limits<double>::infinity(), 0};
  std::size_t start = 0;  // the piece whose corner is nearest
  for (std::size_t i = 1; i < d.corner.size(); ++i) {
    if ((d.corner[i] - x).squaredNorm() < (d.corner[start] - x).squaredNorm()) start = i;
  }
  d.newton(x, d.roots[start].u0, d.roots[start].v0, best);
  const double tolerance = 1e-8 * d.size;
  const auto across = static_cast<std::size_t>(d.q + 1), along = static_cast<std::size_t>(d.p + 1);
  std::vector<Entry> heap;
  std::vector<Node> nodes;
  const auto count = static_cast<int>(d.roots.size());
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double bound = box_distance(d.low[k], d.high[k], x);
    if (bound < best.distance - tolerance) heap.push_back({bound, i});
  }
  std::make_heap(heap.begin(), heap.end());
  const auto push = [&](Node&& node) {
    const double bound = lower_bound_of(node.points, x);
    if (bound >= best.distance - tolerance) return;
    heap.push_back({bound, count + static_cast<int>(nodes.size())});
    std::push_heap(heap.begin(), heap.end());
    nodes.push_back(std::move(node));
  };
  double proved = best.distance;  // nothing is nearer than this
  while (!heap.empty()) {
    std::pop_heap(heap.begin(), heap.end());
    const Entry top = heap.back();
    heap.pop_back();
    if (top.bound >= best.distance - tolerance) break;
    if (nodes.size() > kMost) {
      proved = top.bound;
      break;
    }
    Node node;
    if (top.node < count) {
      node = d.roots[static_cast<std::size_t>(top.node)];
      if (lower_bound_of(node.points, x) >= best.distance - tolerance) continue;
    } else {
      node = std::move(nodes[static_cast<std::size_t>(top.node - count)]);
    }
    const double u = 0.5 * (node.u0 + node.u1), v = 0.5 * (node.v0 + node.v1);
    Foot centre{u, v, 0, {}};
    look(*d.evaluator, x, centre);
    if (node.depth % 4 == 0 || centre.f < best.distance * best.distance) d.newton(x, u, v, best);
    ++node.depth;
    Node second = node;
    if (d.curve || length_along(node.points, d.p, d.q, true) >= length_along(node.points, d.p, d.q, false)) {
      second.points = halve(node.points, d.p, across, across, 1);
      node.u1 = second.u0 = u;
    } else {
      second.points = halve(node.points, d.q, 1, along, across);
      node.v1 = second.v0 = v;
    }
    push(std::move(node));
    push(std::move(second));
  }
  best.gap = std::max(tolerance, best.distance - proved);
  return best;
}

}  // namespace sgrt
