// A fit at every point, and from its covariance that of what is reported. docs/theory/curvature.md eq. 11-18.
#include "shape/curvature.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "shape/jet.hpp"
#include "shape/scale.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;
constexpr double kStraight = 0.993;  // cosine of the frame with the fit, below which it is done again in a better frame
constexpr double kOff = 0.05;        // as is one whose middle lies further from the fit, over the radius
constexpr double kShrink = 0.7;      // of the disc at a border
constexpr int kShrinks = 2;
constexpr double kAgree = 0.5;      // of normals: below it they disagree, as where a quarter is flipped
constexpr double kOpposite = -0.2;  // cosine of two normals
constexpr double kExact = 1e-9;     // curvature over the disc's radius that is rounding
constexpr std::int64_t kBlock = 256;

void check(const CurvatureOptions& o) {
  if (o.degree < 2 || o.degree > 4)
    fail(Status::kInvalidArgument, "degree: " + std::to_string(o.degree) + ", expected 2 to 4");
  require(o.radius >= 0 && o.radius <= kMaxCoordinate, "radius_mm: expected 0 (chosen) or a positive number");
  require(o.max_radius > 0, "max_radius_mm: expected a positive number");
  require(o.noise >= 0 && o.noise <= kMaxCoordinate, "noise_mm: expected 0 (measured) or a positive number");
  require(o.max_sigma > 0, "max_sigma_per_mm: expected a positive number");
}

void make_room(CurvatureField& f, const Surface& surface) {
  const std::int64_t n = surface.size();
  f.height = surface.height, f.width = surface.width;
  for (const auto number : kCurvatureNumbers) (f.*number).setConstant(n, kNan);
  for (const auto vector : kCurvatureVectors) (f.*vector).setConstant(n, 3, kNan);
  f.reason.assign(static_cast<std::size_t>(n), static_cast<std::uint8_t>(CurvatureReason::kAbsent));
  f.hk.assign(static_cast<std::size_t>(n), 0);
}

// Sigmas by the delta method about the tensor's principal axes, bias added (eq. 17-18).
void spread(const Jet& jet, const Curvature& c, double variance, const Node& node, CurvatureField& f,
            std::int64_t row) {
  // The tensor in (H, p, q): a = H + p, c = H - p, b = q; the difference D = |(p, q)| lies along (p, q).
  const double p = 0.5 * (jet.a - jet.c), q = jet.b, D = std::hypot(p, q);
  const Vec3 h(0.5, 0, 0.5);
  const double cosine = D > 0 ? p / D : 1, sine = D > 0 ? q / D : 0;
  const Vec3 d(0.5 * cosine, sine, -0.5 * cosine);
  const Mat3 C = variance * jet.covariance;
  const double hh = h.dot(C * h) + node.bias2_mean;
  double dd = d.dot(C * d);
  // At an umbilic D is the length of a noisy vector: both components err, and err one way.
  if (dd > 0) dd *= 1 + std::exp(-D * D / dd / 4);
  dd += 0.5 * std::max(0.0, 0.5 * node.bias2_tensor - node.bias2_mean);  // half of it turns the axes only
  const double hd = h.dot(C * d);
  const double H = c.mean;
  f.sigma_mean[row] = std::sqrt(hh);
  f.sigma_k1[row] = std::sqrt(std::max(hh + 2 * hd + dd, 0.0));
  f.sigma_k2[row] = std::sqrt(std::max(hh - 2 * hd + dd, 0.0));
  f.sigma_gauss[row] = 2 * std::sqrt(std::max(H * H * hh - 2 * H * D * hd + D * D * dd, 0.0));
  const double length2 = H * H + D * D;
  if (length2 > 0)
    f.sigma_shape_index[row] = 2 / kPi * std::sqrt(std::max(D * D * hh - 2 * H * D * hd + H * H * dd, 0.0)) / length2;
}

class Field {
 public:
  Field(const Run& run, const Surface& surface, const Grain& grain, const CurvatureOptions& o, CurvatureField& out)
      : run_(run), surface_(surface), grain_(grain), o_(o), f_(out) {}

  void operator()() {
    make_room(f_, surface_);
    for (std::int64_t i = 0; i < surface_.size(); ++i) {
      if (!surface_.present(i)) continue;
      say(i, oriented(surface_, i) ? CurvatureReason::kTooFew : CurvatureReason::kNoNormal);
    }
    f_.spacing = grain_.spacing;
    f_.noise = grain_.noise;
    if (f_.spacing > 0) fill();
    for (const std::uint8_t r : f_.reason) ++f_.count[r];
    f_.known = f_.count[0];
  }

 private:
  void say(std::int64_t row, CurvatureReason reason) {
    f_.reason[static_cast<std::size_t>(row)] = static_cast<std::uint8_t>(reason);
  }

  void fill() {
    const SkinCells& cells = grain_.pyramid.levels[0];
    f_.duplicates = cells.duplicates;
    const Scales scales = choose_scales(run_, grain_, o_);
    parallel_for(
        run_, cells.size_of(), kBlock,
        [&](std::int64_t begin, std::int64_t end) {
          JetFitter fitter(run_, grain_.pyramid, o_.degree);
          for (std::int64_t i = begin; i < end; ++i) at_point(fitter, cells, scales, i);
        },
        "curvature");
    if (cells.duplicates > 0) copy_to_duplicates(cells);
  }

  void at_point(JetFitter& fitter, const SkinCells& cells, const Scales& scales, std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    const std::int32_t row = cells.row[at];
    const Vec3 x(cells.x[at], cells.y[at], cells.z[at]), own(cells.nx[at], cells.ny[at], cells.nz[at]);
    const Node& node = scales.nodes[static_cast<std::size_t>(scales.node[static_cast<std::size_t>(cells.cell_of(x))])];
    Vec3 normal = own, centre = x;
    double radius = o_.radius > 0 ? o_.radius : node.radius;
    if (node.found) {
      // The frame as the cell's node foresees it: the disc's middle has to lie on the skin, not on a noisy point.
      const Vec3 d = x - node.foot;
      const Vec3 n = (node.normal + node.tensor * d).normalized();
      const double height = node.normal.dot(d) + 0.5 * d.dot(node.tensor * d);
      if (n.dot(own) > 0.3 && std::abs(height) < 0.5 * radius) {
        normal = n;
        centre = x - height * n;
      }
    }
    Jet jet;
    bool border = false;  // of a disc that was tried: a smaller one may have too few points to tell
    for (int k = 0;; ++k) {
      jet = fitter.fit(centre, normal, radius);
      const bool off = jet.fault == JetFault::kNone &&
                       (jet.normal.dot(normal) < kStraight || (jet.foot - centre).norm() > kOff * radius);
      if (off) {
        const Jet again = fitter.fit(jet.foot, jet.normal, radius);
        if (again.fault == JetFault::kNone) jet = again;
      }
      border = border || jet.fault == JetFault::kBorder;
      if (jet.fault != JetFault::kBorder || o_.radius > 0 || k == kShrinks) break;
      radius *= kShrink;
    }
    f_.radius[row] = radius;
    const bool doubtful = jet.fault == JetFault::kTooFew || jet.fault == JetFault::kNotASheet || node.mixed;
    if (doubtful && fitter.agreement(x, own, std::min(radius, cells.size)) < kAgree)
      return say(row, CurvatureReason::kDisagree);
    if (jet.fault != JetFault::kNone) {
      return say(row, border                           ? CurvatureReason::kBorder
                      : jet.fault == JetFault::kTooFew ? CurvatureReason::kTooFew
                                                       : CurvatureReason::kNotASheet);
    }
    if (own.dot(jet.normal) < kOpposite) return say(row, CurvatureReason::kDisagree);
    const Mat3 bias = std::pow(radius, scales.order) * node.rate;
    jet.a -= jet.e1.dot(bias * jet.e1);
    jet.b -= jet.e1.dot(bias * jet.e2);
    jet.c -= jet.e2.dot(bias * jet.e2);
    write(jet, node, node.inflate * grain_.heights.of(row), radius, row);
  }

  void write(const Jet& jet, const Node& node, double variance, double radius, std::int32_t row) {
    const Curvature c = curvature_of_tensor(jet.a, jet.b, jet.c, jet.normal, jet.e1, jet.e2);
    spread(jet, c, variance, node, f_, row);
    if (!(f_.sigma_mean[row] <= o_.max_sigma)) {
      for (auto* v : {&f_.sigma_k1, &f_.sigma_k2, &f_.sigma_mean, &f_.sigma_gauss, &f_.sigma_shape_index})
        (*v)[row] = kNan;
      return say(row, CurvatureReason::kTooNoisy);
    }
    f_.k1[row] = c.k1, f_.k2[row] = c.k2, f_.mean[row] = c.mean, f_.gauss[row] = c.gauss;
    f_.curvedness[row] = c.curvedness;
    // A plane to rounding has no shape.
    const bool plane = c.curvedness * radius < kExact;
    f_.shape_index[row] = plane ? kNan : c.shape_index;
    if (plane) f_.sigma_shape_index[row] = kNan;
    f_.normals.row(row) = c.normal.transpose();
    f_.d1.row(row) = c.d1.transpose();
    f_.d2.row(row) = c.d2.transpose();
    const double zero = kExact / radius;
    f_.hk[static_cast<std::size_t>(row)] = static_cast<std::uint8_t>(hk_class(
        c.mean, c.gauss, 2 * f_.sigma_mean[row] + zero, 2 * f_.sigma_gauss[row] + zero * (zero + c.curvedness)));
    say(row, CurvatureReason::kNone);
  }

  void forget(std::int32_t row, CurvatureReason reason) {
    for (const auto number : kCurvatureNumbers) (f_.*number)[row] = kNan;
    for (const auto vector : kCurvatureVectors) (f_.*vector).row(row).setConstant(kNan);
    f_.hk[static_cast<std::size_t>(row)] = 0;
    say(row, reason);
  }

  // Second points at a place get what the first one has, unless one of them looks the other way: then none has
  // anything.
  void copy_to_duplicates(const SkinCells& cells) {
    std::vector<std::pair<std::int32_t, std::int64_t>> pairs;  // first, second
    pairs.reserve(static_cast<std::size_t>(cells.duplicates));
    std::vector<std::uint8_t> kept(static_cast<std::size_t>(surface_.size()), 0);
    for (const std::int32_t row : cells.row) kept[static_cast<std::size_t>(row)] = 1;
    for (std::int64_t i = 0; i < surface_.size(); ++i) {
      if (kept[static_cast<std::size_t>(i)] || !oriented(surface_, i)) continue;
      const auto cell = static_cast<std::size_t>(cells.cell_of(surface_.point(i)));
      for (std::int64_t k = cells.begin[cell]; k < cells.begin[cell + 1]; ++k) {
        const std::int32_t from = cells.row[static_cast<std::size_t>(k)];
        if (surface_.points.row(from) != surface_.points.row(i)) continue;
        pairs.emplace_back(from, i);
        break;
      }
    }
    for (const auto& [from, i] : pairs)
      if (surface_.normal(from).dot(surface_.normal(i)) < kOpposite) forget(from, CurvatureReason::kDisagree);
    for (const auto& [from, i] : pairs) {
      for (const auto number : kCurvatureNumbers) (f_.*number)[i] = (f_.*number)[from];
      for (const auto vector : kCurvatureVectors) (f_.*vector).row(i) = (f_.*vector).row(from);
      f_.reason[static_cast<std::size_t>(i)] = f_.reason[static_cast<std::size_t>(from)];
      f_.hk[static_cast<std::size_t>(i)] = f_.hk[static_cast<std::size_t>(from)];
    }
  }

  const Run& run_;
  const Surface& surface_;
  const Grain& grain_;
  const CurvatureOptions& o_;
  CurvatureField& f_;
};

}  // namespace

CurvatureField surface_curvature(const Run& run, const Surface& surface, const CurvatureOptions& options) {
  check(options);
  return surface_curvature(run, surface, grain_of(run, surface, options.degree, options.noise), options);
}

CurvatureField surface_curvature(const Run& run, const Surface& surface, const Grain& grain,
                                 const CurvatureOptions& options) {
  check(options);
  CurvatureField out;
  Field(run, surface, grain, options, out)();
  return out;
}

}  // namespace sgrt
