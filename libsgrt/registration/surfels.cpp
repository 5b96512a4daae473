// Building the pyramid: samples are sorted into cells, each cell gets a surfel fitted to the samples in and round it,
// and the surfels of one level are the samples of the next. docs/theory/icp.md section 2.
#include "registration/surfels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "registration/surfel_fit.hpp"
#include "registration/voxels.hpp"

namespace sgrt {
namespace {

using kernels::Surfel;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPerCell = 3;         // samples, of the finest level: cells of about 1.8 spacings
constexpr double kMostCells = 24'000;  // more samples only make the fits better
constexpr double kCoarsest = 24;       // mm, of the top level at least

double quantile(std::vector<double>& v, double share) {
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(v.size() - 1));
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

struct Extent {
  Vec3 middle;
  double side;
};

// Where the samples lie; a few strays do not matter.
Extent extent_of(const Points& x) {
  Extent out{Vec3::Zero(), 0};
  for (int k = 0; k < 3; ++k) {
    std::vector<double> v(x.col(k).begin(), x.col(k).end());
    const double low = quantile(v, 0.01), high = quantile(v, 0.99);
    out.middle[k] = 0.5 * (low + high);
    out.side = std::max(out.side, high - low);
  }
  return out;
}

Vec3 low_corner(const Vec3& middle, double cell) {
  return middle -
         cell * Vec3(1 << (kernels::kKeyBitsX - 1), 1 << (kernels::kKeyBitsY - 1), 1 << (kernels::kKeyBitsZ - 1));
}

// The cell's side at which a cell holds so many samples, whatever their density.
double choose_cell(const Points& x, const Extent& extent) {
  const auto n = static_cast<double>(x.rows());
  const double least = std::max(extent.side / 800, 1e-6);
  double cell = std::max(least, extent.side * std::sqrt(kPerCell / n));
  for (int i = 0; i < 6; ++i) {
    const auto cells = static_cast<double>(count_cells(x, low_corner(extent.middle, cell), cell));
    const double factor = std::sqrt(std::max(kPerCell * cells / n, cells / kMostCells));
    cell = std::max(least, cell * std::clamp(factor, 0.25, 4.0));
    if (std::abs(factor - 1) < 0.05) break;
  }
  return cell;
}

// The surfels of a level, the voxels that lead to them, and which cloud row went to which surfel.
struct Built {
  SurfelLevel level;
  std::vector<std::int32_t> surfel_of_row;
  std::vector<double> residuals;
  std::size_t cells = 0;
};

Built build_level(const Run& run, const Cloud& cloud, const Vec3& low, double cell) {
  const Cells cells = sort_into_cells(cloud.x, low, cell);
  const std::size_t n = cells.keys.size();
  std::vector<Made> made(n);
  parallel_for(
      run, static_cast<std::int64_t>(n), 256,
      [&](std::int64_t begin, std::int64_t end) {
        std::vector<std::int32_t> rows;
        for (std::int64_t c = begin; c < end; ++c) made[c] = make_surfel(cloud, cells, c, cell, rows);
      },
      "preparing the reference");
  Built out;
  out.cells = n;
  out.surfel_of_row.assign(static_cast<std::size_t>(cloud.x.rows()), 0);
  SurfelLevel& level = out.level;
  Surfel none{};
  none.reach2 = -1;
  level.surfels.assign(1, none);
  level.samples.assign(1, 0);
  level.slope_variance.assign(1, 0);
  level.noise.assign(1, 0);
  std::vector<std::uint32_t> keys(1, kernels::kNoKey);
  for (std::size_t c = 0; c < n; ++c) {
    if (!(made[c].surfel.reach2 > 0)) continue;
    for (std::int64_t i = cells.begin[c]; i < cells.begin[c + 1]; ++i) {
      out.surfel_of_row[cells.rows[i]] = static_cast<std::int32_t>(level.surfels.size());
    }
    keys.push_back(cells.keys[c]);
    level.surfels.push_back(made[c].surfel);
    level.samples.push_back(made[c].samples);
    level.slope_variance.push_back(made[c].slope);
    level.noise.push_back(made[c].noise);
    if (made[c].residual == made[c].residual) out.residuals.push_back(made[c].residual);
  }
  level.parent.assign(level.surfels.size(), 0);
  fill_voxels(keys, low, cell, level);
  return out;
}

// The surfels as samples of the next level.
Cloud cloud_of(const SurfelLevel& level) {
  const std::size_t n = level.surfels.size() - 1;
  Cloud out;
  out.x.resize(static_cast<Eigen::Index>(n), 3);
  out.normals.resize(static_cast<Eigen::Index>(n), 3);
  out.variance.resize(static_cast<Eigen::Index>(n));
  out.samples.assign(level.samples.begin() + 1, level.samples.end());
  out.slope.assign(level.slope_variance.begin() + 1, level.slope_variance.end());
  out.noise.assign(level.noise.begin() + 1, level.noise.end());
  for (std::size_t i = 0; i < n; ++i) {
    const Surfel& s = level.surfels[i + 1];
    for (int k = 0; k < 3; ++k) {
      out.x(static_cast<Eigen::Index>(i), k) = s.q[k];
      out.normals(static_cast<Eigen::Index>(i), k) = s.n[k];
    }
    out.variance[static_cast<Eigen::Index>(i)] = s.variance;
    out.counts.push_back(s.counts);
  }
  return out;
}

Cloud cloud_of(const Surface& surface, const std::vector<std::uint8_t>& counts, const Vec3& centre) {
  std::vector<std::int64_t> rows;
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (surface.present(i) && (!surface.has_normals() || surface.normal(i).allFinite())) rows.push_back(i);
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  Cloud out;
  out.x.resize(n, 3);
  out.normals.setZero(n, 3);
  out.variance.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::int64_t i = rows[static_cast<std::size_t>(k)];
    out.x.row(k) = (surface.point(i) - centre).transpose();
    if (surface.has_normals()) out.normals.row(k) = surface.normals.row(i);
    out.variance[k] = surface.sigma.size() > 0 ? surface.sigma[i] * surface.sigma[i] : kNan;
    const float in = counts.empty() || counts[static_cast<std::size_t>(i)] != 0 ? 1.0F : 0.0F;
    out.counts.push_back(in);
    out.samples.push_back(in);
    out.slope.push_back(-1);
    out.noise.push_back(0);
  }
  if (surface.covariance.rows() > 0) {
    out.surface = &surface;
    out.rows = std::move(rows);
  }
  return out;
}

// Surfels of estimated sign turn towards a place above the couch, as estimated normals do.
void turn_up(const Vec3& centre, SurfelLevel& level) {
  const Vec3 viewpoint = Vec3(0, 0, 1e4) - centre;
  for (Surfel& s : level.surfels) {
    const Vec3 q(s.q[0], s.q[1], s.q[2]), n(s.n[0], s.n[1], s.n[2]);
    if (!(n.dot(viewpoint - q) < 0)) continue;
    for (float& v : s.n) v = -v;
    for (float& v : s.k) v = -v;
  }
}

double median_of(std::vector<double> v) {
  return v.empty() ? kNan : quantile(v, 0.5);
}

// Noise that the samples do not carry is their roughness; what a fit leaves of it in its height.
void fill_noise(double roughness2, SurfelLevel& level) {
  for (Surfel& s : level.surfels) {
    if (!(s.variance == s.variance)) s.variance = static_cast<float>(roughness2 == roughness2 ? roughness2 : 0);
    s.variance = std::max(s.variance, 5e-7F);  // nothing is known better than a micron
  }
  // Where samples are few or lie to one side the height is less certain: its pairs weigh less.
  std::vector<double> heights;
  for (const Surfel& s : level.surfels) {
    if (s.reach2 > 0) heights.push_back(s.height);
  }
  level.noise.clear();
  const double typical = heights.empty() ? 1 : quantile(heights, 0.5);
  for (Surfel& s : level.surfels) {
    const auto excess = static_cast<float>(std::max(1.0, s.height / typical));
    s.height = std::min(1.0F, s.height) * s.variance;
    level.noise.push_back(s.variance * std::sqrt(excess));  // between even samples and those on one side
    s.variance *= excess;
  }
}

void measure(SurfelField& field) {
  for (SurfelLevel& each : field.levels) {
    for (const Surfel& s : each.surfels) each.count += s.counts > 0 ? 1 : 0;
  }
  const SurfelLevel& level = field.levels[0];
  field.box_min.setConstant(1e30);
  field.box_max.setConstant(-1e30);
  double sum = 0;
  for (std::size_t i = 1; i < level.surfels.size(); ++i) {
    const Surfel& s = level.surfels[i];
    if (!(s.counts > 0)) continue;
    const Vec3 q(s.q[0], s.q[1], s.q[2]);
    field.box_min = field.box_min.cwiseMin(q);
    field.box_max = field.box_max.cwiseMax(q);
    sum += q.squaredNorm();
    ++field.count;
  }
  field.lever = std::max(1e-3, std::sqrt(sum / static_cast<double>(std::max<std::int64_t>(1, field.count))));
}

}  // namespace

SurfelField make_surfels(const Run& run, const Surface& surface, const std::vector<std::uint8_t>& counts) {
  SurfelField field;
  std::int64_t n = 0;
  for (std::int64_t i = 0; i < surface.size(); ++i) {
    if (!surface.present(i) || (!counts.empty() && counts[static_cast<std::size_t>(i)] == 0)) continue;
    field.centre += surface.point(i);
    ++n;
  }
  if (n > 0) field.centre /= static_cast<double>(n);
  Cloud cloud = cloud_of(surface, counts, field.centre);
  if (cloud.x.rows() == 0) fail(Status::kInsufficientData, "the reference has no usable points");
  const Extent extent = extent_of(cloud.x);
  field.cell = choose_cell(cloud.x, extent);
  Built built;
  for (int attempt = 0; attempt < 6; ++attempt, field.cell *= 2) {  // noise larger than the cells: take larger ones
    field.low = low_corner(extent.middle, field.cell);
    built = build_level(run, cloud, field.low, field.cell);
    if (2 * built.level.surfels.size() > built.cells) break;
  }
  if (!surface.has_normals()) turn_up(field.centre, built.level);
  field.roughness2 = median_of(built.residuals);
  fill_noise(field.roughness2, built.level);
  field.levels.push_back(std::move(built.level));
  double cell = field.cell;
  while (static_cast<int>(field.levels.size()) < kernels::kMaxLevels && cell < kCoarsest) {
    cell *= 2;
    Built next = build_level(run, cloud_of(field.levels.back()), field.low, cell);
    std::vector<std::int32_t>& parent = field.levels.back().parent;
    std::copy(next.surfel_of_row.begin(), next.surfel_of_row.end(), parent.begin() + 1);
    for (Surfel& s : next.level.surfels) s.height = s.variance;
    field.levels.push_back(std::move(next.level));
  }
  measure(field);
  return field;
}

}  // namespace sgrt
