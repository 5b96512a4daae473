// Masks as runs: set operations row by row, balls as stacks of rows, components by union-find over touching runs.
#include "volume/runs.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

// body(y, z, spans) for every row: fills `spans`, which is empty; the row gets a copy without spare room.
template <class Body>
Runs each_row(const Run& run, int nx, int ny, int nz, Body&& body) {
  Runs out(nx, ny, nz);
  parallel_for(
      run, static_cast<std::int64_t>(out.rows.size()), 256,
      [&](std::int64_t begin, std::int64_t end) {
        RowSpans spans;
        for (std::int64_t i = begin; i < end; ++i) {
          spans.clear();
          body(static_cast<int>(i % ny), static_cast<int>(i / ny), spans);
          out.rows[static_cast<std::size_t>(i)].assign(spans.begin(), spans.end());
        }
      },
      "finding the body");
  return out;
}

// The rows of a ball: its half width in voxels at each (dy, dz) that it reaches.
struct BallRow {
  int dy, dz, half;
};
std::vector<BallRow> ball_rows(double radius, const Vec3& spacing) {
  std::vector<BallRow> ball;
  const int my = static_cast<int>(radius / spacing.y()), mz = static_cast<int>(radius / spacing.z());
  for (int dz = -mz; dz <= mz; ++dz) {
    for (int dy = -my; dy <= my; ++dy) {
      const double rest = radius * radius - std::pow(dy * spacing.y(), 2) - std::pow(dz * spacing.z(), 2);
      if (rest >= 0) ball.push_back({dy, dz, static_cast<int>(std::sqrt(rest) / spacing.x())});
    }
  }
  return ball;
}

// Sorts and joins spans that overlap or touch.
void join(RowSpans& spans) {
  std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) { return a.begin < b.begin; });
  std::size_t n = 0;
  for (const Span& s : spans) {
    if (n > 0 && s.begin <= spans[n - 1].end) {
      spans[n - 1].end = std::max(spans[n - 1].end, s.end);
    } else {
      spans[n++] = s;
    }
  }
  spans.resize(n);
}

class UnionFind {
 public:
  explicit UnionFind(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(std::size_t a, std::size_t b) {
    a = root(a), b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

// Number of the first run of each row, and the component of each run.
struct Components {
  std::vector<std::size_t> first, of;
};

Components label(const Runs& mask) {
  Components c;
  c.first.reserve(mask.rows.size() + 1);
  std::size_t n = 0;
  for (const RowSpans& row : mask.rows) {
    c.first.push_back(n);
    n += row.size();
  }
  c.first.push_back(n);
  UnionFind sets(n);
  const auto touch = [&](std::size_t row_a, std::size_t row_b) {
    const RowSpans &a = mask.rows[row_a], &b = mask.rows[row_b];
    for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
      if (a[i].begin < b[j].end && b[j].begin < a[i].end) sets.unite(c.first[row_a] + i, c.first[row_b] + j);
      a[i].end < b[j].end ? ++i : ++j;
    }
  };
  for (int z = 0; z < mask.nz; ++z) {
    for (int y = 0; y < mask.ny; ++y) {
      const std::size_t row = static_cast<std::size_t>(z) * mask.ny + y;
      if (y > 0) touch(row, row - 1);
      if (z > 0) touch(row, row - static_cast<std::size_t>(mask.ny));
    }
  }
  c.of.resize(n);
  for (std::size_t i = 0; i < n; ++i) c.of[i] = sets.root(i);
  return c;
}

Runs keep(const Runs& mask, const Components& c, const std::vector<char>& wanted) {
  Runs out(mask.nx, mask.ny, mask.nz);
  for (std::size_t row = 0; row < mask.rows.size(); ++row) {
    for (std::size_t i = 0; i < mask.rows[row].size(); ++i) {
      if (wanted[c.of[c.first[row] + i]]) out.rows[row].push_back(mask.rows[row][i]);
    }
  }
  return out;
}

}  // namespace

bool Runs::inside(int x, int y, int z) const {
  if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) return false;
  const RowSpans& spans = row(y, z);
  const auto after =
      std::upper_bound(spans.begin(), spans.end(), x, [](int value, const Span& s) { return value < s.begin; });
  return after != spans.begin() && x < (after - 1)->end;
}

std::int64_t Runs::count() const {
  std::int64_t n = 0;
  for (const RowSpans& spans : rows) {
    for (const Span& s : spans) n += s.end - s.begin;
  }
  return n;
}

void intersect(const RowSpans& a, const RowSpans& b, RowSpans& out) {
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const Span s{std::max(a[i].begin, b[j].begin), std::min(a[i].end, b[j].end)};
    if (s.begin < s.end) out.push_back(s);
    a[i].end < b[j].end ? ++i : ++j;
  }
}

Runs intersect(const Run& run, const Runs& a, const Runs& b) {
  return each_row(run, a.nx, a.ny, a.nz,
                  [&](int y, int z, RowSpans& out) { intersect(a.row(y, z), b.row(y, z), out); });
}

Runs complement(const Run& run, const Runs& a) {
  return each_row(run, a.nx, a.ny, a.nz, [&](int y, int z, RowSpans& out) {
    int x = 0;
    for (const Span& s : a.row(y, z)) {
      if (s.begin > x) out.push_back({x, s.begin});
      x = s.end;
    }
    if (x < a.nx) out.push_back({x, a.nx});
  });
}

Runs dilate(const Run& run, const Runs& mask, double radius_mm, const Vec3& spacing_mm) {
  const std::vector<BallRow> ball = ball_rows(radius_mm, spacing_mm);
  return each_row(run, mask.nx, mask.ny, mask.nz, [&](int y, int z, RowSpans& out) {
    for (const BallRow& b : ball) {
      const int yy = y + b.dy, zz = z + b.dz;
      if (yy < 0 || zz < 0 || yy >= mask.ny || zz >= mask.nz) continue;
      for (const Span& s : mask.row(yy, zz))
        out.push_back({std::max(0, s.begin - b.half), std::min(mask.nx, s.end + b.half)});
    }
    join(out);
  });
}

Runs erode(const Run& run, const Runs& mask, double radius_mm, const Vec3& spacing_mm, bool outside) {
  const std::vector<BallRow> ball = ball_rows(radius_mm, spacing_mm);
  return each_row(run, mask.nx, mask.ny, mask.nz, [&](int y, int z, RowSpans& out) {
    RowSpans shrunk, both;
    out.push_back({0, mask.nx});
    for (const BallRow& b : ball) {
      const int yy = y + b.dy, zz = z + b.dz;
      const bool beyond = yy < 0 || zz < 0 || yy >= mask.ny || zz >= mask.nz;
      if (beyond && outside) continue;
      if (beyond) return out.clear();
      shrunk.clear();
      for (const Span& s : mask.row(yy, zz)) {
        const int begin = outside && s.begin == 0 ? 0 : s.begin + b.half;
        const int end = outside && s.end == mask.nx ? mask.nx : s.end - b.half;
        if (begin < end) shrunk.push_back({begin, end});
      }
      both.clear();
      intersect(out, shrunk, both);
      std::swap(out, both);
      if (out.empty()) return;
    }
  });
}

Runs largest_component(const Runs& mask) {
  const Components c = label(mask);
  std::vector<std::int64_t> size(c.of.size(), 0);
  for (std::size_t row = 0; row < mask.rows.size(); ++row) {
    for (std::size_t i = 0; i < mask.rows[row].size(); ++i)
      size[c.of[c.first[row] + i]] += mask.rows[row][i].end - mask.rows[row][i].begin;
  }
  std::vector<char> wanted(size.size(), 0);
  const auto largest = std::max_element(size.begin(), size.end());
  if (largest != size.end()) wanted[static_cast<std::size_t>(largest - size.begin())] = 1;
  return keep(mask, c, wanted);
}

Runs components_with(const Runs& mask, const std::function<bool(const Span&, int y, int z)>& seed) {
  const Components c = label(mask);
  std::vector<char> wanted(c.of.size(), 0);
  for (int z = 0; z < mask.nz; ++z) {
    for (int y = 0; y < mask.ny; ++y) {
      const std::size_t row = static_cast<std::size_t>(z) * mask.ny + y;
      for (std::size_t i = 0; i < mask.rows[row].size(); ++i) {
        if (seed(mask.rows[row][i], y, z)) wanted[c.of[c.first[row] + i]] = 1;
      }
    }
  }
  return keep(mask, c, wanted);
}

}  // namespace sgrt
