// From voxels to skin: body, mesh, edge by profile, smoothing. docs/theory/volume.md.
#include "volume/skin.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/median.hpp"
#include "core/parallel.hpp"
#include "volume/body.hpp"
#include "volume/isosurface.hpp"
#include "volume/profile.hpp"
#include "volume/smooth.hpp"

namespace sgrt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kContrast = 200;     // HU between air and tissue below which there is no edge
constexpr double kContactMargin = 4;  // mm over the couch in which its blur reaches the skin
constexpr double kUnscanned = -1100;  // HU: less than air
constexpr std::int64_t kBlock = 8192;

struct Scan {
  const Voxels& voxels;
  const SkinOptions& options;
  Mat3 voxel_from_frame;
  Body body;
  double radius = kNan;  // voxels, of a round field of view; NaN: none seen
};

Vec3 index_of(const CutEdge& e, double t) {
  Vec3 index(e.x, e.y, e.z);
  index[e.axis] += t * e.step;
  return index;
}

// The corners of a slice all hold one value and the body comes up to the circle between them: a round field of view.
double round_field(const Voxels& v) {
  const double cx = (v.nx - 1) / 2.0, cy = (v.ny - 1) / 2.0, r = std::min(v.nx, v.ny) / 2.0;
  const double corner = v.at(0, 0, 0);
  for (int z = 0; z < v.nz; z += std::max(1, v.nz / 8)) {
    for (int y = 0; y < v.ny; ++y) {
      for (int x = 0; x < v.nx; ++x) {
        if (std::hypot(x - cx, y - cy) > r + 1 && v.at(x, y, z) != corner) return kNan;
      }
    }
  }
  return r;
}

bool unscanned(const Scan& s, int x, int y, int z) {
  const Voxels& v = s.voxels;
  if (x < 0 || y < 0 || z < 0 || x >= v.nx || y >= v.ny || z >= v.nz) return true;
  const double value = v.at(x, y, z);
  return std::isnan(s.options.padding) ? value < kUnscanned : value == s.options.padding;
}

// Why the skin cannot be measured where the mesh cuts this edge; 0 where it can.
std::uint8_t flags_of(const Scan& s, const CutEdge& e) {
  const Voxels& v = s.voxels;
  const Support& support = s.body.support;
  const int out[3] = {e.x + (e.axis == 0 ? e.step : 0), e.y + (e.axis == 1 ? e.step : 0),
                      e.z + (e.axis == 2 ? e.step : 0)};
  if (unscanned(s, out[0], out[1], out[2])) return kSkinCut;
  if (std::hypot(out[0] - (v.nx - 1) / 2.0, out[1] - (v.ny - 1) / 2.0) > s.radius - 1.5) return kSkinCut;
  if (support.found) {
    const int margin = support.sign * static_cast<int>(std::ceil(kContactMargin / v.spacing()[support.axis]));
    if (is_support(support, out[0] + (support.axis == 0 ? margin : 0), out[1] + (support.axis == 1 ? margin : 0)))
      return kSkinContact;
  }
  if (s.body.tissue.inside(out[0], out[1], out[2])) return kSkinContact;
  if (!s.body.tissue.inside(e.x, e.y, e.z)) return kSkinClosed;
  return 0;
}

// Where the values along a lattice edge cross the body's threshold; half-way where they do not, the inner end where the
// body is cut.
Vec3 first_guess(const Scan& s, const CutEdge& e, std::uint8_t flags) {
  const Voxels& v = s.voxels;
  double t = flags & kSkinCut ? 0 : 0.5;
  if (flags == 0) {
    const Vec3 out = index_of(e, 1);
    const double a = v.at(e.x, e.y, e.z);
    const double b = v.at(static_cast<int>(out.x()), static_cast<int>(out.y()), static_cast<int>(out.z()));
    t = (a - s.options.body_threshold) / (a - b);
  }
  return v.origin + v.axes * index_of(e, t);
}

void place_vertices(const Run& run, const Scan& s, const std::vector<CutEdge>& cuts, Skin& skin) {
  const auto n = static_cast<std::int64_t>(cuts.size());
  skin.mesh.points.resize(n, 3);
  skin.flags.resize(cuts.size());
  parallel_for(run, n, kBlock, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) {
      const auto u = static_cast<std::size_t>(i);
      skin.flags[u] = flags_of(s, cuts[u]);
      skin.mesh.points.row(i) = first_guess(s, cuts[u], skin.flags[u]).transpose();
    }
  });
}

// Moves each vertex along its normal onto the edge. Returns the contrast of each.
Eigen::VectorXd find_edges(const Run& run, const Scan& s, Skin& skin) {
  const bool fixed = !std::isnan(s.options.threshold);
  Eigen::VectorXd contrast = Eigen::VectorXd::Constant(skin.mesh.size(), kNan);
  parallel_for(
      run, skin.mesh.size(), kBlock,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto u = static_cast<std::size_t>(i);
          if (skin.flags[u]) continue;
          const Vec3 n = skin.mesh.normal(i);
          const Edge edge = find_edge(s.voxels, s.voxel_from_frame, skin.mesh.point(i), n, s.options.threshold);
          const double offset = fixed ? edge.threshold_offset : edge.offset;
          if (!(edge.contrast >= kContrast) || std::isnan(offset)) {
            skin.flags[u] = kSkinNoEdge;
            continue;
          }
          contrast[i] = edge.contrast;
          skin.mesh.points.row(i) += offset * n.transpose();
          if (fixed) skin.bias[i] = offset - edge.offset;
        }
      },
      "measuring the skin");
  return contrast;
}

double median_known(const Eigen::VectorXd& all) {
  std::vector<double> v(all.data(), all.data() + all.size());
  v.erase(std::remove_if(v.begin(), v.end(), [](double x) { return std::isnan(x); }), v.end());
  return median(v);
}

// One sigma of what is left of the steps between voxels: linear interpolation misplaces the edge of half filled voxels
// by 0.055 of their size (RMS over the filling), alike wherever the skin runs along a layer of voxels, and it averages
// out over the layers that the smoothing crosses (eq. 7).
double steps(const Scan& s, const Vec3& n, double radius) {
  const Vec3 spacing = s.voxels.spacing();
  Eigen::Index k;
  const double along = (s.voxels.axes.transpose() * n).cwiseQuotient(spacing).cwiseAbs().maxCoeff(&k);
  const double layers = radius * std::sqrt(std::max(0.0, 1 - along * along)) / spacing[k];
  return 0.055 / (s.voxel_from_frame * n).norm() / (1 + 2 * layers);
}

void smooth(const Run& run, const Scan& s, double radius, Skin& skin) {
  std::vector<std::uint8_t> use(skin.flags.size());
  std::transform(skin.flags.begin(), skin.flags.end(), use.begin(), [](std::uint8_t f) { return f == 0; });
  Smoothed out = smooth_mesh(run, skin.mesh.points, skin.mesh.normals, skin.mesh.faces, use, radius, s.voxels.axes);
  skin.mesh.points = std::move(out.points);
  skin.mesh.normals = std::move(out.normals);
  skin.mesh.sigma = std::move(out.sigma);
  skin.bias += out.bias;
  skin.mesh.correlation_points = std::max(1.0, 1 / median_known(out.leverage));
  for (std::size_t i = 0; i < use.size(); ++i) {
    double& sigma = skin.mesh.sigma[static_cast<Eigen::Index>(i)];
    sigma = std::hypot(sigma, steps(s, skin.mesh.normal(static_cast<Eigen::Index>(i)), radius));
    if (use[i] && std::isnan(sigma)) skin.flags[i] = kSkinNoEdge;
  }
}

// Turns the faces where the lattice's frame is left-handed.
void set_faces(Faces&& faces, bool left_handed, Skin& skin) {
  skin.mesh.faces = std::move(faces);
  if (left_handed) skin.mesh.faces.col(1).swap(skin.mesh.faces.col(2));
}

}  // namespace

Skin skin_of_volume(const Run& run, const Voxels& voxels, const SkinOptions& options) {
  Scan s{voxels, options, voxels.axes.inverse(), {}};
  s.body = find_body(run, voxels, {options.body_threshold, options.closing, s.voxel_from_frame * options.down});
  s.radius = round_field(voxels);

  Skin skin;
  LatticeMesh lattice = mesh_of_lattice(run, voxels.nx, voxels.ny, voxels.nz, [&](int z, std::uint8_t* inside) {
    std::fill_n(inside, static_cast<std::size_t>(voxels.nx) * static_cast<std::size_t>(voxels.ny), std::uint8_t{0});
    for (int y = 0; y < voxels.ny; ++y) {
      for (const Span& span : s.body.mask.row(y, z))
        std::fill(inside + static_cast<std::ptrdiff_t>(y) * voxels.nx + span.begin,
                  inside + static_cast<std::ptrdiff_t>(y) * voxels.nx + span.end, std::uint8_t{1});
    }
  });
  set_faces(std::move(lattice.faces), voxels.axes.determinant() < 0, skin);
  place_vertices(run, s, lattice.cuts, skin);
  skin.bias = Eigen::VectorXd::Zero(skin.mesh.size());
  skin.mesh.normals = soft_normals(run, skin.mesh.points, skin.mesh.faces);
  skin.contrast = median_known(find_edges(run, s, skin));
  if (std::isnan(skin.contrast)) fail(Status::kNotFound, "no skin: the body meets air nowhere inside the volume");
  const double radius =
      std::isnan(options.smoothing) ? std::max(2.5, 2 * voxels.spacing().maxCoeff()) : options.smoothing;
  if (radius > 0) smooth(run, s, radius, skin);
  skin.couch_found = s.body.support.found;
  skin.volume = volume_of(skin.mesh.points, skin.mesh.faces);
  return skin;
}

SkinFigures figures_of(const Skin& skin) {
  double bias = 0;
  std::int64_t n = 0;
  for (std::size_t i = 0; i < skin.flags.size(); ++i) {
    if (skin.flags[i]) continue;
    bias += skin.bias[static_cast<Eigen::Index>(i)];
    ++n;
  }
  return {n > 0 ? bias / static_cast<double>(n) : kNan, median_known(skin.mesh.sigma)};
}

double volume_of(const Points& points, const Faces& faces) {
  double six = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Vec3 a = points.row(faces(f, 0)), b = points.row(faces(f, 1)), c = points.row(faces(f, 2));
    six += a.dot(b.cross(c));
  }
  return six / 6;
}

Surface part_without(const Skin& skin, std::uint8_t flags) {
  const Surface& m = skin.mesh;
  std::vector<std::int32_t> number(skin.flags.size(), -1);
  std::vector<std::int32_t> kept;
  for (Eigen::Index f = 0; f < m.faces.rows(); ++f) {
    std::uint8_t any = 0;
    for (int k = 0; k < 3; ++k) any |= skin.flags[static_cast<std::size_t>(m.faces(f, k))];
    if (any & flags) continue;
    kept.push_back(static_cast<std::int32_t>(f));
    for (int k = 0; k < 3; ++k) number[static_cast<std::size_t>(m.faces(f, k))] = 0;
  }
  std::int32_t n = 0;
  for (std::int32_t& i : number) {
    if (i == 0) i = n++;
  }
  if (n == 0) fail(Status::kNotFound, "no skin is left without the flagged vertices");
  bool sigma = m.sigma.size() > 0;
  for (std::size_t i = 0; i < number.size() && sigma; ++i)
    sigma = number[i] < 0 || m.sigma[static_cast<Eigen::Index>(i)] > 0;
  Surface out;
  out.points.resize(n, 3);
  out.normals.resize(n, 3);
  if (sigma) out.sigma.resize(n);
  out.correlation_points = m.correlation_points;
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] < 0) continue;
    const auto from = static_cast<Eigen::Index>(i);
    out.points.row(number[i]) = m.points.row(from);
    out.normals.row(number[i]) = m.normals.row(from);
    if (sigma) out.sigma[number[i]] = m.sigma[from];
  }
  out.faces.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t f = 0; f < kept.size(); ++f) {
    for (int k = 0; k < 3; ++k)
      out.faces(static_cast<Eigen::Index>(f), k) = number[static_cast<std::size_t>(m.faces(kept[f], k))];
  }
  return out;
}

}  // namespace sgrt
