// The asymmetric grid, see calibration/circles.hpp: it is a square lattice turned by 45 degrees, so a lattice grown
// from a disc and two of its neighbours is the grid when its cells, put back, are the grid's own.
#include "calibration/circles.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/initial.hpp"
#include "calibration/lattice.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

// The cells of the grid in steps along both diagonals: u = (x + y) / 2, v = (y - x) / 2.
Cell diagonal_cell(int column, int row) {
  const int x = 2 * column + row % 2, y = row;
  return {(x + y) / 2, (y - x) / 2};
}

// The eight ways to lay axes on a square lattice; only those that keep the handedness of an image are boards seen from
// the front.
Cell laid(const Cell& c, int way) {
  static constexpr int kWays[4][4] = {{1, 0, 0, 1}, {0, -1, 1, 0}, {-1, 0, 0, -1}, {0, 1, -1, 0}};
  return {kWays[way][0] * c.first + kWays[way][1] * c.second, kWays[way][2] * c.first + kWays[way][3] * c.second};
}

// For each circle of the board the disc at its cell; empty unless every cell of the lattice is one of the board's and
// all are there.
std::vector<int> matched(const Board& board, const Lattice& lattice, int way) {
  Lattice wanted;
  for (int j = 0; j < board.rows; ++j) {
    for (int i = 0; i < board.columns; ++i) wanted[diagonal_cell(i, j)] = j * board.columns + i;
  }
  Lattice turned;
  for (const auto& [cell, index] : lattice) turned[laid(cell, way)] = index;
  const Extent a = extent_of(wanted), b = extent_of(turned);
  if (a.columns != b.columns || a.rows != b.rows || wanted.size() != turned.size()) return {};
  std::vector<int> discs(wanted.size());
  for (const auto& [cell, name] : wanted) {
    const auto found = turned.find({cell.first - a.i0 + b.i0, cell.second - a.j0 + b.j0});
    if (found == turned.end()) return {};
    discs[name] = found->second;
  }
  return discs;
}

// Centres of discs are not where their ellipses have theirs: the difference by the board's homography (eq. 19).
Vec2 centre_shift(const Mat3& H, const Vec2& at, double radius) {
  Mat3 C;  // the circle's dual conic: C* = c c^T - r^2 diag(1, 1, 0), whose image is H C* H^T
  const Vec3 c = at.homogeneous();
  C = c * c.transpose();
  C(0, 0) -= radius * radius;
  C(1, 1) -= radius * radius;
  const Mat3 E = H * C * H.transpose();
  return Vec2(E(0, 2), E(1, 2)) / E(2, 2) - (H * c).hnormalized();
}

void correct_centres(const Board& board, const std::vector<Disc>& discs, Detection& d) {
  const Target target = make_target(board_points(board));
  View view{0, 0, d.index, d.pixel, d.sigma_px, std::vector<double>(d.index.size(), 1)};
  const auto H = homography_of(target, view);
  if (!H) return;
  std::vector<double> radii;
  for (std::size_t i = 0; i < d.index.size(); ++i) {
    const Vec2 p = target.points.row(d.index[i]).head<2>();
    const Vec3 h = *H * p.homogeneous();
    const double scale = std::abs(H->determinant() / (h.z() * h.z() * h.z()));  // area of the image of 1 mm2
    radii.push_back(std::sqrt(discs[i].area / 3.14159265358979323846 / scale));
  }
  const double radius = median(radii);
  for (std::size_t i = 0; i < d.index.size(); ++i)
    d.pixel[i] -= centre_shift(*H, target.points.row(d.index[i]).head<2>().transpose(), radius);
}

bool try_lattice(const Board& board, const std::vector<Disc>& discs, const Lattice& lattice, Detection& d) {
  std::vector<int> names;
  for (int way = 0; way < 4; ++way) {
    const std::vector<int> found = matched(board, lattice, way);
    if (found.empty()) continue;
    // Of the two ways that a half turn may leave, the one whose rows run to the right of the image.
    const auto along = [&](const std::vector<int>& n) {
      return discs[n[board.columns - 1]].at.x() - discs[n[0]].at.x();
    };
    if (names.empty() || along(found) > along(names)) names = found;
  }
  if (names.empty()) return false;
  std::vector<Disc> own;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Disc& disc = discs[names[i]];
    own.push_back(disc);
    d.index.push_back(static_cast<int>(i));
    d.pixel.push_back(disc.at);
    d.sigma_px.push_back(disc.sigma_px);
  }
  correct_centres(board, own, d);
  return true;
}

}  // namespace

Detection detect_circles(const Run& run, const Board& board, const Image& image) {
  constexpr std::size_t kMostDiscs = 1500, kNear = 8, kMostSeeds = 60;
  Detection d;
  d.seen_columns = d.seen_rows = 0;
  std::vector<Disc> discs = find_discs(image);
  const auto wanted = static_cast<std::size_t>(board.columns) * board.rows;
  d.why = "saw " + std::to_string(discs.size()) + " dark discs, but no whole grid of " + std::to_string(board.columns) +
          " x " + std::to_string(board.rows) + " circles";
  if (discs.size() < wanted || discs.size() > kMostDiscs) return d;
  std::vector<Vec2> points;
  points.reserve(discs.size());
  for (const Disc& disc : discs) points.push_back(disc.at);
  Vec2 middle = Vec2::Zero();
  for (const Vec2& p : points) middle += p / static_cast<double>(points.size());
  std::vector<int> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return (points[a] - middle).norm() < (points[b] - middle).norm(); });
  for (std::size_t s = 0; s < std::min(kMostSeeds, order.size()); ++s) {
    run.poll(static_cast<double>(s) / kMostSeeds, "find the board");
    const int seed = order[s];
    std::vector<int> near = order;
    std::sort(near.begin(), near.end(),
              [&](int a, int b) { return (points[a] - points[seed]).norm() < (points[b] - points[seed]).norm(); });
    for (std::size_t i = 1; i < std::min(kNear, near.size()); ++i) {
      for (std::size_t j = 1; j < std::min(kNear, near.size()); ++j) {
        const Vec2 a = points[near[i]] - points[seed], b = points[near[j]] - points[seed];
        if (a.x() * b.y() - a.y() * b.x() < 0.3 * a.norm() * b.norm()) continue;  // handed as an image, not too slanted
        const Lattice lattice = grow_points(points, seed, a, b, wanted);
        if (lattice.size() != wanted || !try_lattice(board, discs, lattice, d)) continue;
        d.found = true;
        d.why.clear();
        return d;
      }
    }
  }
  return d;
}

}  // namespace sgrt
