// Growing a lattice, see calibration/lattice.hpp.
#include "calibration/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <limits>

namespace sgrt {
namespace {

constexpr double kPi = 3.14159265358979323846, kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Cell kSteps[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

Cell plus(const Cell& a, const Cell& b) {
  return {a.first + b.first, a.second + b.second};
}
Cell minus(const Cell& a, const Cell& b) {
  return {a.first - b.first, a.second - b.second};
}

// The angle between an edge (mod pi) and a direction.
double off_edge(double edge, const Vec2& direction) {
  const double d = std::fmod(std::atan2(direction.y(), direction.x()) - edge + 2 * kPi, kPi);
  return std::min(d, kPi - d);
}

// The step from a cell in a direction: the one that led to it, or that of a neighbour beside it.
Vec2 step_at(const Lattice& lattice, const Cell& cell, const Cell& d, const std::function<Vec2(int)>& at) {
  const auto point = [&](const Cell& c) {
    const auto found = lattice.find(c);
    return found == lattice.end() ? Vec2(kNaN, kNaN) : at(found->second);
  };
  const Vec2 straight = point(cell) - point(minus(cell, d));
  if (straight.allFinite()) return straight;
  for (const Cell& side : {Cell{d.second, d.first}, Cell{-d.second, -d.first}}) {
    const Vec2 beside = point(plus(plus(cell, side), d)) - point(plus(cell, side));
    if (beside.allFinite()) return beside;
  }
  return {kNaN, kNaN};
}

class ChessGrower {
 public:
  explicit ChessGrower(const std::vector<Saddle>& saddles) : saddles_(saddles), used_(saddles.size(), false) {}

  Lattice grow(Lattice lattice, std::size_t enough) {
    std::vector<bool> taken(saddles_.size(), false);
    std::deque<Cell> todo;
    for (const auto& [cell, index] : lattice) {
      taken[index] = true;
      todo.push_back(cell);
    }
    while (!todo.empty() && lattice.size() < enough) {
      const Cell cell = todo.front();
      todo.pop_front();
      for (const Cell& d : kSteps) {
        const Cell next = plus(cell, d);
        if (lattice.count(next)) continue;
        const int found = neighbour(lattice, cell, d, taken);
        if (found < 0) continue;
        lattice[next] = found;
        taken[found] = true;
        todo.push_back(next);
      }
    }
    for (const auto& [cell, index] : lattice) used_[index] = true;
    return lattice;
  }
  bool used(int i) const { return used_[static_cast<std::size_t>(i)]; }

 private:
  // The corner one step from a cell, or -1.
  int neighbour(const Lattice& lattice, const Cell& cell, const Cell& d, const std::vector<bool>& taken) const {
    constexpr double kNear = 0.3, kAngle = 0.3, kLook = 0.25, kFaint = 0.3;
    const Saddle& from = saddles_[lattice.at(cell)];
    const int parity = (cell.first + cell.second) & 1, edge = d.first != 0 ? parity : 1 - parity;
    const Vec2 step = step_at(lattice, cell, d, [&](int i) { return saddles_[i].at; });
    Vec2 ray(std::cos(from.angle[edge]), std::sin(from.angle[edge]));
    if (d.first + d.second < 0) ray = -ray;
    int best = -1;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < saddles_.size(); ++i) {
      if (taken[i] || saddles_[i].strength < kFaint * from.strength) continue;
      const Vec2 to = saddles_[i].at - from.at;
      double distance;
      if (step.allFinite()) {
        distance = (to - step).norm();
        if (distance > kNear * step.norm()) continue;
      } else {
        distance = to.norm();
        if (distance >= nearest || to.dot(ray) < std::cos(kLook) * distance) continue;
      }
      if (distance >= nearest || off_edge(saddles_[i].angle[1 - edge], to) > kAngle ||
          off_edge(from.angle[edge], to) > kAngle)
        continue;
      nearest = distance;
      best = static_cast<int>(i);
    }
    return best;
  }

  const std::vector<Saddle>& saddles_;
  std::vector<bool> used_;
};

// The middle of what the steps in the four directions expect: the median of each coordinate, so that one wrong
// neighbour does not decide. step: their mean length. NaN where none tells.
Vec2 expected_at(const Lattice& lattice, const Cell& cell, const std::function<Vec2(int)>& at, double& step) {
  std::vector<double> x, y;
  step = 0;
  for (const Cell& d : kSteps) {
    const auto one = lattice.find(minus(cell, d)), two = lattice.find(minus(minus(cell, d), d));
    if (one == lattice.end() || two == lattice.end()) continue;
    const Vec2 p = 2 * at(one->second) - at(two->second);
    step += (at(one->second) - at(two->second)).norm();
    x.push_back(p.x());
    y.push_back(p.y());
  }
  if (x.empty()) return {kNaN, kNaN};
  step /= static_cast<double>(x.size());
  std::sort(x.begin(), x.end());
  std::sort(y.begin(), y.end());
  const std::size_t n = x.size();
  return {(x[n / 2] + x[(n - 1) / 2]) / 2, (y[n / 2] + y[(n - 1) / 2]) / 2};
}

}  // namespace

Extent extent_of(const Lattice& lattice) {
  if (lattice.empty()) return {};
  int i0 = lattice.begin()->first.first, i1 = i0, j0 = lattice.begin()->first.second, j1 = j0;
  for (const auto& [cell, index] : lattice) {
    i0 = std::min(i0, cell.first);
    i1 = std::max(i1, cell.first);
    j0 = std::min(j0, cell.second);
    j1 = std::max(j1, cell.second);
  }
  return {i0, j0, i1 - i0 + 1, j1 - j0 + 1};
}

Lattice trimmed(const Lattice& lattice) {
  Lattice out = lattice;
  while (!out.empty()) {
    const Extent e = extent_of(out);
    struct Line {
      bool column;
      int at, length;
    };
    const Line lines[] = {{true, e.i0, e.rows},
                          {true, e.i0 + e.columns - 1, e.rows},
                          {false, e.j0, e.columns},
                          {false, e.j0 + e.rows - 1, e.columns}};
    const auto on = [](const Line& l, const Cell& c) { return (l.column ? c.first : c.second) == l.at; };
    const Line* emptiest = nullptr;
    double least = 0.5;
    for (const Line& line : lines) {
      const auto count = std::count_if(out.begin(), out.end(), [&](const auto& item) { return on(line, item.first); });
      const double share = static_cast<double>(count) / line.length;
      if (share >= least) continue;
      least = share;
      emptiest = &line;
    }
    if (!emptiest) break;
    const Line line = *emptiest;
    for (auto item = out.begin(); item != out.end();) item = on(line, item->first) ? out.erase(item) : std::next(item);
  }
  return out;
}

Lattice grow_chessboard(const std::vector<Saddle>& saddles, std::size_t enough) {
  ChessGrower grower(saddles);
  Lattice best;
  for (std::size_t seed = 0; seed < saddles.size(); ++seed) {
    if (grower.used(static_cast<int>(seed))) continue;
    Lattice lattice = grower.grow({{{0, 0}, static_cast<int>(seed)}}, enough);
    if (lattice.size() > best.size()) best = std::move(lattice);
  }
  // A wrong corner keeps the right one out: without the wrong ones it grows again.
  const auto at = [&](int i) { return saddles[static_cast<std::size_t>(i)].at; };
  best = cleaned(best, at);
  return cleaned(grower.grow(best, enough), at);
}

Lattice grow_points(const std::vector<Vec2>& points, int seed, const Vec2& a, const Vec2& b, std::size_t most) {
  constexpr double kNear = 0.33;
  Lattice lattice{{{0, 0}, seed}};
  std::vector<bool> taken(points.size(), false);
  taken[seed] = true;
  const auto at = [&](int i) { return points[i]; };
  std::deque<Cell> todo{{0, 0}};
  while (!todo.empty() && lattice.size() <= most) {
    const Cell cell = todo.front();
    todo.pop_front();
    for (const Cell& d : kSteps) {
      const Cell next = plus(cell, d);
      if (lattice.count(next)) continue;
      Vec2 step = step_at(lattice, cell, d, at);
      if (!step.allFinite()) step = (d.first + d.second) * (d.first != 0 ? a : b);
      const Vec2 wanted = points[lattice.at(cell)] + step;
      int best = -1;
      double nearest = kNear * step.norm();
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double distance = taken[i] ? nearest : (points[i] - wanted).norm();
        if (distance >= nearest) continue;
        nearest = distance;
        best = static_cast<int>(i);
      }
      if (best < 0) continue;
      lattice[next] = best;
      taken[best] = true;
      todo.push_back(next);
    }
  }
  return lattice;
}

Vec2 predicted(const Lattice& lattice, const Cell& cell, const std::function<Vec2(int)>& at) {
  double step;
  return expected_at(lattice, cell, at, step);
}

Lattice cleaned(const Lattice& lattice, const std::function<Vec2(int)>& at) {
  constexpr double kFar = 0.25;  // of a step
  Lattice out = lattice;
  for (;;) {
    Cell worst{};
    double most = kFar;
    for (const auto& [cell, index] : out) {
      double step;
      const Vec2 expected = expected_at(out, cell, at, step);
      const double off = (at(index) - expected).norm() / step;
      // Nothing along either axis tells where it should be: as bad as can be.
      const double offence = expected.allFinite() ? off : 1e9;
      if (offence <= most) continue;
      most = offence;
      worst = cell;
    }
    if (most <= kFar) return out;
    out.erase(worst);
  }
}

}  // namespace sgrt
