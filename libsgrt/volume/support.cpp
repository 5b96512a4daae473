// Finds the couch by its constant cross-section. docs/theory/volume.md eq. 2.
#include "volume/support.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace sgrt {
namespace {

constexpr double kShare = 0.9;      // of the slices in which couch is couch
constexpr double kThickest = 60;    // mm, a couch's thickest layer, and the widest gap between two layers
constexpr double kNarrowest = 80;   // mm of couch top that must be seen
constexpr double kSteepest = 0.35;  // slope of its top
constexpr int kSamples = 24;        // lines that propose a curve

// share[across * n + along]: of the slices with tissue there; `along` counts from the couch's side towards the patient.
struct CrossSection {
  int lines, depth;
  std::vector<float> share;
};

CrossSection cross_section(const Runs& tissue, int axis, int sign) {
  CrossSection c{axis == 0 ? tissue.ny : tissue.nx, axis == 0 ? tissue.nx : tissue.ny, {}};
  c.share.assign(static_cast<std::size_t>(c.lines) * static_cast<std::size_t>(c.depth), 0);
  const float slice = 1.0F / static_cast<float>(tissue.nz);
  for (int z = 0; z < tissue.nz; ++z) {
    for (int y = 0; y < tissue.ny; ++y) {
      for (const Span& s : tissue.row(y, z)) {
        for (int x = s.begin; x < s.end; ++x) {
          const int line = axis == 0 ? y : x, along = axis == 0 ? x : y;
          const int depth = sign > 0 ? c.depth - 1 - along : along;
          c.share[static_cast<std::size_t>(line) * c.depth + depth] += slice;
        }
      }
    }
  }
  return c;
}

// Depth of the couch's top on one line: the top of the last thin layer that a short gap joins to the layers below; -1:
// none.
int top_of_line(const float* share, int depth, int thickest) {
  int top = -1;
  for (int d = 0; d < depth;) {
    if (share[d] < kShare) {
      if (top >= 0 && d - top > thickest) break;
      ++d;
      continue;
    }
    const int begin = d;
    while (d < depth && share[d] >= kShare) ++d;
    if (d - begin > thickest) break;  // a body
    top = d - 1;
  }
  return top;
}

struct Curve {
  Vec3 a = Vec3::Zero();  // depth = a0 + a1 u + a2 u^2 with u in [-1, 1] across
  double at(double u) const { return a[0] + u * (a[1] + u * a[2]); }
  double slope(double u) const { return a[1] + 2 * u * a[2]; }
};

Curve through(const std::array<Vec2, 3>& p) {
  Mat3 m;
  Vec3 d;
  for (int i = 0; i < 3; ++i) {
    const double u = p[static_cast<std::size_t>(i)].x();
    m.row(i) << 1, u, u * u;
    d[i] = p[static_cast<std::size_t>(i)].y();
  }
  return {m.partialPivLu().solve(d)};
}

std::vector<Vec2> near(const std::vector<Vec2>& tops, const Curve& curve) {
  std::vector<Vec2> out;
  for (const Vec2& p : tops) {
    if (std::abs(p.y() - curve.at(p.x())) <= 1.5) out.push_back(p);
  }
  return out;
}

// The curve that most tops agree with, from every three of a few of them; then least squares.
Curve fit(const std::vector<Vec2>& tops, std::vector<Vec2>& inliers) {
  std::vector<Vec2> some;
  for (int i = 0; i < kSamples; ++i) some.push_back(tops[i * (tops.size() - 1) / (kSamples - 1)]);
  Curve best;
  for (std::size_t i = 0; i < some.size(); ++i) {
    for (std::size_t j = i + 1; j < some.size(); ++j) {
      for (std::size_t k = j + 1; k < some.size(); ++k) {
        if (some[j].x() <= some[i].x() || some[k].x() <= some[j].x()) continue;
        const Curve curve = through({some[i], some[j], some[k]});
        std::vector<Vec2> agree = near(tops, curve);
        if (agree.size() > inliers.size()) best = curve, inliers = std::move(agree);
      }
    }
  }
  Mat3 m = Mat3::Identity() * 1e-9;
  Vec3 g = Vec3::Zero();
  for (const Vec2& p : inliers) {
    const Vec3 row(1, p.x(), p.x() * p.x());
    m += row * row.transpose();
    g += row * p.y();
  }
  if (!inliers.empty()) best.a = m.ldlt().solve(g);
  return best;
}

}  // namespace

Support find_support(const Runs& tissue, const Vec3& down, const Vec3& spacing) {
  Support support;
  if (down.head<2>().norm() == 0 || tissue.nz < 3) return support;
  support.axis = std::abs(down.x()) > std::abs(down.y()) ? 0 : 1;
  support.sign = down[support.axis] > 0 ? 1 : -1;
  const double along_mm = spacing[support.axis], across_mm = spacing[1 - support.axis];
  const CrossSection c = cross_section(tissue, support.axis, support.sign);
  const int thickest = static_cast<int>(kThickest / along_mm);
  std::vector<Vec2> tops, seen;
  for (int line = 0; line < c.lines; ++line) {
    const int top = top_of_line(&c.share[static_cast<std::size_t>(line) * c.depth], c.depth, thickest);
    if (top >= 0) tops.emplace_back(2.0 * line / std::max(1, c.lines - 1) - 1, top);
  }
  if (static_cast<double>(tops.size()) * across_mm < kNarrowest || tops.size() < kSamples) return support;
  const Curve curve = fit(tops, seen);
  if (static_cast<double>(seen.size()) * across_mm < kNarrowest) return support;
  const double low = seen.front().x(), high = seen.back().x();
  const double lean = across_mm * (c.lines - 1) / 2 / along_mm;  // voxels of depth a unit of u, at a slope of 1
  if (std::max(std::abs(curve.slope(low)), std::abs(curve.slope(high))) > kSteepest * lean) return support;
  support.found = true;
  for (int line = 0; line < c.lines; ++line) {
    const double u = std::clamp(2.0 * line / std::max(1, c.lines - 1) - 1, low, high);
    const int depth =
        std::clamp(static_cast<int>(std::floor(curve.at(u) + 1.0)), 0, c.depth - 1);  // one voxel of margin
    support.top.push_back(support.sign > 0 ? c.depth - 1 - depth : depth);
  }
  return support;
}

Runs without_support(const Run&, const Runs& tissue, const Support& support) {
  if (!support.found) return tissue;
  Runs out(tissue.nx, tissue.ny, tissue.nz);
  for (int z = 0; z < tissue.nz; ++z) {
    for (int y = 0; y < tissue.ny; ++y) {
      RowSpans& row = out.row(y, z);
      for (const Span& s : tissue.row(y, z)) {
        for (int x = s.begin; x < s.end; ++x) {
          if (is_support(support, x, y)) continue;
          if (!row.empty() && row.back().end == x) {
            ++row.back().end;
          } else {
            row.push_back({x, x + 1});
          }
        }
      }
    }
  }
  return out;
}

}  // namespace sgrt
