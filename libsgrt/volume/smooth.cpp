// Moving least squares over a mesh. docs/theory/volume.md eq. 5-6.
#include "volume/smooth.hpp"

#include <cmath>
#include <limits>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;
constexpr double kBlur = 1.0 / 12 + 1.0 / 6;  // variance of a voxel's box and of linear interpolation, in spacings
constexpr double kWider = 1.6;
constexpr int kFewest = 10;  // neighbours of a quadric
constexpr std::int64_t kBlock = 8192;

// The neighbours of each vertex. In a closed mesh each is the end of exactly one half edge.
struct Neighbours {
  std::vector<std::int32_t> first, of;
  Neighbours(const Faces& faces, std::int64_t vertices) : first(static_cast<std::size_t>(vertices) + 1, 0) {
    const std::int32_t* f = faces.data();
    const auto n = static_cast<std::size_t>(faces.size());
    for (std::size_t i = 0; i < n; ++i) ++first[static_cast<std::size_t>(f[i]) + 1];
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    of.resize(n);
    std::vector<std::int32_t> next(first.begin(), first.end() - 1);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t end = i % 3 == 2 ? i - 2 : i + 1;
      of[static_cast<std::size_t>(next[static_cast<std::size_t>(f[i])]++)] = f[end];
    }
  }
};

// Vertices within a radius of one, reached over the mesh; those that face away are not passed.
class Disc {
 public:
  Disc(const Points& points, const Points& normals, const Neighbours& mesh, const std::vector<std::uint8_t>& use)
      : points_(points),
        normals_(normals),
        mesh_(mesh),
        use_(use),
        seen_(static_cast<std::size_t>(points.rows()), -1) {}
  const std::vector<std::int32_t>& around(std::int32_t centre, double radius) {
    found_.assign(1, centre);
    ++stamp_;
    seen_[static_cast<std::size_t>(centre)] = stamp_;
    for (std::size_t i = 0; i < found_.size(); ++i) {
      const auto v = static_cast<std::size_t>(found_[i]);
      for (std::int32_t j = mesh_.first[v]; j < mesh_.first[v + 1]; ++j) {
        const std::int32_t w = mesh_.of[static_cast<std::size_t>(j)];
        if (seen_[static_cast<std::size_t>(w)] == stamp_ || !use_[static_cast<std::size_t>(w)]) continue;
        seen_[static_cast<std::size_t>(w)] = stamp_;
        if ((points_.row(w) - points_.row(centre)).squaredNorm() > radius * radius) continue;
        if (normals_.row(w).dot(normals_.row(centre)) > 0.3) found_.push_back(w);
      }
    }
    return found_;
  }

 private:
  const Points &points_, &normals_;
  const Neighbours& mesh_;
  const std::vector<std::uint8_t>& use_;
  std::vector<std::int32_t> seen_, found_;
  std::int32_t stamp_ = -1;
};

// w = a0 + a1 u + a2 v + a3 u^2 + a4 u v + a5 v^2 over the tangent plane (eq. 5), in units of the radius.
struct Quadric {
  bool ok = false;
  Vec6 a = Vec6::Zero();
  double variance = 0, leverage = 0;
};

Quadric fit_quadric(const Points& points, const std::vector<std::int32_t>& disc, const Mat3& axes, double radius) {
  const Vec3 x = points.row(disc[0]).transpose();
  Mat6 m = Mat6::Zero(), m2 = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  double hh = 0, ww = 0;
  for (const std::int32_t i : disc) {
    const Vec3 d = axes.transpose() * (points.row(i).transpose() - x) / radius;
    const double r2 = d.squaredNorm(), weight = (1 - r2) * (1 - r2);
    Vec6 row;
    row << 1, d[0], d[1], d[0] * d[0], d[0] * d[1], d[1] * d[1];
    m.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    m2.selfadjointView<Eigen::Lower>().rankUpdate(row, weight * weight);
    g += weight * d[2] * row;
    hh += weight * d[2] * d[2];
    ww += weight;
  }
  Quadric q;
  const Eigen::LDLT<Mat6> solver(m);
  const Vec6 pivots = solver.vectorD();
  if (!(pivots.minCoeff() > 1e-6 * pivots.maxCoeff())) return q;
  q.a = solver.solve(g);
  const Vec6 e0 = solver.solve(Vec6::Unit(0));
  q.leverage = e0.dot(m2.selfadjointView<Eigen::Lower>() * e0);
  const auto n = static_cast<double>(disc.size());
  q.variance = std::max(0.0, hh - q.a.dot(g)) / ww * n / (n - 6) * radius * radius;
  q.ok = std::hypot(q.a[1], q.a[2]) < 1 && std::abs(q.a[0]) < 0.5;
  return q;
}

Mat3 frame_of(const Vec3& n) {
  const Vec3 other = std::abs(n.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
  Mat3 axes;
  axes.col(0) = n.cross(other).normalized();
  axes.col(1) = n.cross(axes.col(0));
  axes.col(2) = n;
  return axes;
}

// How many vertices share the noise of one cell, from their density on the surface: linear interpolation between voxels
// spreads a voxel's noise over 2.25 times the area that its cell covers of a surface (eq. 6).
double shared(const Mat3& cell, const Vec3& n, double density) {
  const double volume = std::abs(cell.determinant());
  if (!(volume > 0)) return 1;
  return std::max(1.0, 2.25 * volume * (cell.inverse() * n).norm() * density);
}

}  // namespace

Smoothed smooth_mesh(const Run& run, const Points& points, const Points& normals, const Faces& faces,
                     const std::vector<std::uint8_t>& use, double radius, const Mat3& cell) {
  const Neighbours mesh(faces, points.rows());
  const Mat3 blur = cell * cell.transpose() * kBlur;
  const auto n = points.rows();
  Smoothed out{points, normals, Eigen::VectorXd::Constant(n, kNan), Eigen::VectorXd::Zero(n),
               Eigen::VectorXd::Constant(n, kNan)};
  parallel_for(
      run, n, kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        Disc disc(points, normals, mesh, use);
        for (std::int64_t i = begin; i < end; ++i) {
          if (!use[static_cast<std::size_t>(i)]) continue;
          const Mat3 axes = frame_of(normals.row(i).transpose());
          Quadric q;
          double reach = radius;
          std::size_t count = 0;
          for (int attempt = 0; attempt < 2 && !q.ok; ++attempt) {  // a coarse lattice may need the second, wider one
            if (attempt > 0) reach *= kWider;
            const auto& found = disc.around(static_cast<std::int32_t>(i), reach);
            if (found.size() >= kFewest) q = fit_quadric(points, found, axes, reach);
            count = found.size();
          }
          if (!q.ok) continue;
          const Vec3 normal = axes.col(2);
          out.points.row(i) += reach * q.a[0] * normal.transpose();
          out.normals.row(i) = (normal - q.a[1] * axes.col(0) - q.a[2] * axes.col(1)).normalized().transpose();
          const double density = static_cast<double>(count) / (kPi * reach * reach);
          out.sigma[i] = std::sqrt(q.variance * std::min(1.0, q.leverage * shared(cell, normal, density)));
          out.leverage[i] = q.leverage;
          const auto tangent = axes.leftCols<2>();
          const Eigen::Matrix2d b = tangent.transpose() * blur * tangent;
          out.bias[i] = (q.a[3] * b(0, 0) + q.a[4] * b(0, 1) + q.a[5] * b(1, 1)) / reach;
        }
      },
      "smoothing the skin");
  return out;
}

Points soft_normals(const Run& run, const Points& points, const Faces& faces) {
  const Neighbours mesh(faces, points.rows());
  Points normals = vertex_normals(points, faces), next(points.rows(), 3);
  normals = normals.array().isNaN().select(0, normals);  // a vertex whose triangles have no area
  for (int pass = 0; pass < 2; ++pass) {
    parallel_for(run, points.rows(), kBlock, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t i = begin; i < end; ++i) {
        Vec3 sum = normals.row(i).transpose();
        const auto v = static_cast<std::size_t>(i);
        for (std::int32_t j = mesh.first[v]; j < mesh.first[v + 1]; ++j)
          sum += normals.row(mesh.of[static_cast<std::size_t>(j)]).transpose();
        const double length = sum.norm();
        next.row(i) = length > 0 ? (sum / length).transpose().eval() : normals.row(i).eval();
      }
    });
    std::swap(normals, next);
  }
  return normals;
}

}  // namespace sgrt
