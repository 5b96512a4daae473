// Shape-based interpolation of a stack of contours. docs/theory/volume.md, "Contours".
#include "volume/contours.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "volume/isosurface.hpp"
#include "volume/smooth.hpp"

namespace sgrt {
namespace {

constexpr double kFlat = 0.05;        // mm that a point may lie off its contour's plane
constexpr double kMargin = 2;         // pixels round the contours
constexpr double kMostNumbers = 5e8;  // of all distance maps together

struct Segment {
  Vec2 a, b;
  double distance2(const Vec2& p) const {
    const Vec2 d = b - a;
    const double length2 = d.squaredNorm();
    const double t = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0;
    return (p - a - t * d).squaredNorm();
  }
};

struct Slice {
  double height;
  std::vector<Segment> segments;
};

// The stack: slices in ascending height along axes.col(2), their contours in pixels of one grid.
struct Stack {
  Mat3 axes;  // columns u, v, n
  Vec2 origin;
  double pixel;
  int nx, ny;
  std::vector<Slice> slices;
};

Vec3 area_vector(const Points& c) {  // Newell
  Vec3 sum = Vec3::Zero();
  for (Eigen::Index i = 0; i < c.rows(); ++i) {
    const Vec3 a = c.row(i) - c.row(0), b = c.row((i + 1) % c.rows()) - c.row(0);
    sum += a.cross(b);
  }
  return sum / 2;
}

// The planes' common normal, from the contour with the largest area; its largest component is positive.
Vec3 common_normal(const std::vector<Points>& contours) {
  Vec3 largest = Vec3::Zero();
  for (const Points& c : contours) {
    const Vec3 area = area_vector(c);
    if (area.norm() > largest.norm()) largest = area;
  }
  if (!(largest.norm() > 1)) fail(Status::kInsufficientData, "contours: none has an area above 1 mm2");
  Eigen::Index k;
  largest.cwiseAbs().maxCoeff(&k);
  return (largest[k] > 0 ? largest : -largest).normalized();
}

double height_of(const Points& contour, std::size_t number, const Vec3& n) {
  const Eigen::VectorXd h = contour * n;
  const double mean = h.mean(), off = (h.array() - mean).abs().maxCoeff();
  if (off > kFlat)
    fail(Status::kInvalidArgument, "contours[" + std::to_string(number) + "]: leaves the plane of the others by " +
                                       text_of(off) + " mm, expected planar contours on parallel planes");
  return mean;
}

Stack stack_of(const std::vector<Points>& contours, double pixel) {
  Stack s;
  const Vec3 n = common_normal(contours);
  Eigen::Index k;
  n.cwiseAbs().maxCoeff(&k);
  s.axes.col(0) = n.cross(Vec3(Vec3::Unit((k + 1) % 3)).cross(n)).norm() > 0 ? Vec3(Vec3::Unit((k + 1) % 3))
                                                                             : Vec3(Vec3::Unit((k + 2) % 3));
  s.axes.col(0) = (s.axes.col(0) - n * n.dot(s.axes.col(0))).normalized();
  s.axes.col(1) = n.cross(s.axes.col(0));
  s.axes.col(2) = n;

  std::vector<double> heights(contours.size());
  Vec2 low = Vec2::Constant(1e300), high = -low;
  for (std::size_t i = 0; i < contours.size(); ++i) {
    heights[i] = height_of(contours[i], i, n);
    const Eigen::Matrix<double, Eigen::Dynamic, 2> flat = contours[i] * s.axes.leftCols<2>();
    low = low.cwiseMin(flat.colwise().minCoeff().transpose());
    high = high.cwiseMax(flat.colwise().maxCoeff().transpose());
  }
  s.pixel = pixel;
  s.origin = low - Vec2::Constant(kMargin * pixel);
  const Vec2 size = (high - low) / pixel + Vec2::Constant(2 * kMargin + 1);
  std::vector<std::size_t> order(contours.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return heights[a] < heights[b]; });
  for (const std::size_t i : order) {
    if (s.slices.empty() || heights[i] - s.slices.back().height > 2 * kFlat) s.slices.push_back({heights[i], {}});
    const Points& c = contours[i];
    for (Eigen::Index j = 0; j < c.rows(); ++j) {
      const auto flat = [&](Eigen::Index r) -> Vec2 {
        return (s.axes.leftCols<2>().transpose() * c.row(r % c.rows()).transpose() - s.origin) / pixel;
      };
      s.slices.back().segments.push_back({flat(j), flat(j + 1)});
    }
  }
  if (s.slices.size() < 2) fail(Status::kInsufficientData, "contours: all on one slice, expected 2 slices or more");
  if (size.prod() * static_cast<double>(s.slices.size()) > kMostNumbers)
    fail(Status::kLimit, "contours: " + text_of(std::ceil(size.x())) + " x " + text_of(std::ceil(size.y())) + " x " +
                             std::to_string(s.slices.size()) + " pixels of " + text_of(pixel) +
                             " mm; expected at most 5e8, choose a larger pixel_mm");
  s.nx = static_cast<int>(size.x()) + 1;
  s.ny = static_cast<int>(size.y()) + 1;
  return s;
}

// Inside by even-odd, row by row: the pixels between the 1st and 2nd, 3rd and 4th ... crossing of the row's line.
std::vector<char> fill_even_odd(const Slice& slice, int nx, int ny) {
  std::vector<std::vector<double>> crossings(static_cast<std::size_t>(ny));
  for (const Segment& s : slice.segments) {
    const Vec2 &a = s.a.y() < s.b.y() ? s.a : s.b, &b = s.a.y() < s.b.y() ? s.b : s.a;
    for (int y = static_cast<int>(std::ceil(a.y())); y < b.y(); ++y)
      crossings[static_cast<std::size_t>(y)].push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
  }
  std::vector<char> inside(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny), 0);
  for (int y = 0; y < ny; ++y) {
    auto& c = crossings[static_cast<std::size_t>(y)];
    std::sort(c.begin(), c.end());
    for (std::size_t i = 0; i + 1 < c.size(); i += 2) {
      for (int x = static_cast<int>(std::ceil(c[i])); x < c[i + 1]; ++x)
        inside[static_cast<std::size_t>(y) * nx + x] = 1;
    }
  }
  return inside;
}

// Signed distance in pixels, positive inside. Exact beside the contours; further out the nearest segment is passed on
// from pixel to pixel (Danielsson 1980).
void distance_map(const Slice& slice, int nx, int ny, float* out) {
  const auto n = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  std::vector<std::int32_t> nearest(n, -1);
  std::vector<double> best(n, 1e300);
  const auto offer = [&](int x, int y, std::int32_t segment) {
    if (segment < 0) return;
    const std::size_t i = static_cast<std::size_t>(y) * nx + x;
    const double d = slice.segments[static_cast<std::size_t>(segment)].distance2(Vec2(x, y));
    if (d < best[i]) best[i] = d, nearest[i] = segment;
  };
  for (std::size_t k = 0; k < slice.segments.size(); ++k) {
    const Segment& s = slice.segments[k];
    const Vec2 low = s.a.cwiseMin(s.b).array() - 1.5, high = s.a.cwiseMax(s.b).array() + 1.5;
    for (int y = std::max(0, static_cast<int>(std::ceil(low.y()))); y <= std::min(ny - 1.0, high.y()); ++y) {
      for (int x = std::max(0, static_cast<int>(std::ceil(low.x()))); x <= std::min(nx - 1.0, high.x()); ++x)
        offer(x, y, static_cast<std::int32_t>(k));
    }
  }
  const auto pass = [&](int x, int y, int dx, int dy) {
    if (x + dx >= 0 && x + dx < nx && y + dy >= 0 && y + dy < ny)
      offer(x, y, nearest[static_cast<std::size_t>(y + dy) * nx + x + dx]);
  };
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) pass(x, y, -1, 0), pass(x, y, -1, -1), pass(x, y, 0, -1), pass(x, y, 1, -1);
    for (int x = nx - 1; x >= 0; --x) pass(x, y, 1, 0);
  }
  for (int y = ny - 1; y >= 0; --y) {
    for (int x = nx - 1; x >= 0; --x) pass(x, y, 1, 0), pass(x, y, 1, 1), pass(x, y, 0, 1), pass(x, y, -1, 1);
    for (int x = 0; x < nx; ++x) pass(x, y, -1, 0);
  }
  const std::vector<char> inside = fill_even_odd(slice, nx, ny);
  for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<float>(inside[i] ? std::sqrt(best[i]) : -std::sqrt(best[i]));
}

}  // namespace

ClosedContours close_contours(const Run& run, const std::vector<Points>& contours, const ContoursOptions& options) {
  for (std::size_t i = 0; i < contours.size(); ++i) {
    if (contours[i].rows() < 3)
      fail(Status::kInvalidArgument, "contours[" + std::to_string(i) + "]: " + std::to_string(contours[i].rows()) +
                                         " points, expected 3 or more");
  }
  const Stack s = stack_of(contours, options.pixel);
  const int nz = static_cast<int>(s.slices.size());
  const std::size_t plane = static_cast<std::size_t>(s.nx) * static_cast<std::size_t>(s.ny);
  std::vector<float> distance(plane * s.slices.size());
  parallel_for(
      run, nz, 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t z = begin; z < end; ++z)
          distance_map(s.slices[static_cast<std::size_t>(z)], s.nx, s.ny,
                       &distance[static_cast<std::size_t>(z) * plane]);
      },
      "measuring the contours");
  const auto at = [&](int x, int y, int z) {
    return static_cast<double>(distance[static_cast<std::size_t>(z) * plane + static_cast<std::size_t>(y) * s.nx + x]);
  };

  ClosedContours out;
  LatticeMesh lattice = mesh_of_lattice(run, s.nx, s.ny, nz, [&](int z, std::uint8_t* inside) {
    for (std::size_t i = 0; i < plane; ++i) inside[i] = distance[static_cast<std::size_t>(z) * plane + i] > 0;
  });
  Surface& mesh = out.skin.mesh;
  mesh.points.resize(static_cast<Eigen::Index>(lattice.cuts.size()), 3);
  out.skin.flags.assign(lattice.cuts.size(), 0);
  for (std::size_t i = 0; i < lattice.cuts.size(); ++i) {
    const CutEdge& e = lattice.cuts[i];
    int to[3] = {e.x, e.y, e.z};
    to[e.axis] += e.step;
    double t = 0;
    if (to[2] < 0 || to[2] >= nz) {
      out.skin.flags[i] = kSkinCut;
    } else {
      const double a = at(e.x, e.y, e.z), b = at(to[0], to[1], to[2]);
      t = a / (a - b);
    }
    const double from = s.slices[static_cast<std::size_t>(e.z)].height;
    const double height =
        e.axis == 2 && t > 0 ? from + t * (s.slices[static_cast<std::size_t>(to[2])].height - from) : from;
    const Vec2 flat = s.origin + s.pixel * (Vec2(e.x, e.y) + t * e.step * Vec2(e.axis == 0, e.axis == 1));
    mesh.points.row(static_cast<Eigen::Index>(i)) = (s.axes * Vec3(flat.x(), flat.y(), height)).transpose();
  }
  mesh.faces = std::move(lattice.faces);

  std::vector<double> gaps;
  for (int z = 1; z < nz; ++z)
    gaps.push_back(s.slices[static_cast<std::size_t>(z)].height - s.slices[static_cast<std::size_t>(z) - 1].height);
  std::sort(gaps.begin(), gaps.end());
  out.slices = nz;
  out.spacing = gaps[gaps.size() / 2];
  out.largest_gap = gaps.back();

  std::vector<std::uint8_t> use(out.skin.flags.size());
  std::transform(out.skin.flags.begin(), out.skin.flags.end(), use.begin(), [](std::uint8_t f) { return f == 0; });
  mesh.normals = soft_normals(run, mesh.points, mesh.faces);
  const double radius = options.smoothing > 0 ? options.smoothing : 1.5 * std::max(out.spacing, options.pixel);
  Smoothed smooth = smooth_mesh(run, mesh.points, mesh.normals, mesh.faces, use, radius, Mat3::Zero());
  mesh.normals = std::move(smooth.normals);
  if (options.smoothing > 0) mesh.points = std::move(smooth.points);
  out.skin.bias = Eigen::VectorXd::Zero(mesh.size());
  out.skin.contrast = std::numeric_limits<double>::quiet_NaN();
  out.skin.volume = volume_of(mesh.points, mesh.faces);
  return out;
}

}  // namespace sgrt
