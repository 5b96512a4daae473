// Finding a chessboard, see calibration/board.hpp: corners at one scale of the image after the other, the lattice they
// form, the board's own order, and each corner fitted to the full image.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "calibration/board.hpp"
#include "calibration/circles.hpp"
#include "calibration/lattice.hpp"
#include "calibration/text.hpp"
#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr std::size_t kMostSaddles = 1500;

// Half the size, each pixel the mean of four.
Image halved(const Image& image) {
  Image out;
  out.resize(image.height / 2, image.width / 2);
  for (int y = 0; y < out.height; ++y) {
    const float *a = image.row(2 * y), *b = image.row(2 * y + 1);
    for (int x = 0; x < out.width; ++x) out.row(y)[x] = (a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1]) / 4;
  }
  return out;
}

// Binomial 3 x 3; the border stays.
Image smoothed(const Image& image) {
  Image out = image;
  for (int y = 1; y + 1 < image.height; ++y) {
    const float *a = image.row(y - 1), *b = image.row(y), *c = image.row(y + 1);
    float* to = out.row(y);
    for (int x = 1; x + 1 < image.width; ++x) {
      const auto column = [&](int i) { return a[i] + 2 * b[i] + c[i]; };
      to[x] = (column(x - 1) + 2 * column(x) + column(x + 1)) / 16;
    }
  }
  return out;
}

// The lattice turned so that its first axis is the board's columns and both run as x and y of an image do.
struct Ordered {
  Lattice lattice;  // cells from 0
  int columns = 0, rows = 0;
};

Ordered normalised(const Lattice& lattice, const std::function<Vec2(int)>& at) {
  const Extent e = extent_of(lattice);
  Ordered out{{}, e.columns, e.rows};
  double cross = 0;
  for (const auto& [cell, index] : lattice) {
    out.lattice[{cell.first - e.i0, cell.second - e.j0}] = index;
    const auto right = lattice.find({cell.first + 1, cell.second}), down = lattice.find({cell.first, cell.second + 1});
    if (right == lattice.end() || down == lattice.end()) continue;
    const Vec2 a = at(right->second) - at(index), b = at(down->second) - at(index);
    cross += a.x() * b.y() - a.y() * b.x();
  }
  if (cross >= 0) return out;
  Lattice mirrored;
  for (const auto& [cell, index] : out.lattice) mirrored[{cell.first, e.rows - 1 - cell.second}] = index;
  out.lattice = std::move(mirrored);
  return out;
}

// By a quarter turn: (i, j) -> (rows - 1 - j, i), which keeps the handedness.
Ordered turned(const Ordered& o) {
  Ordered out{{}, o.rows, o.columns};
  for (const auto& [cell, index] : o.lattice) out.lattice[{o.rows - 1 - cell.second, cell.first}] = index;
  return out;
}

// Whether the square outside the lattice's first corner is dark: the sector between both axes, pointing back.
bool first_is_dark(const Ordered& o, const std::vector<Saddle>& saddles) {
  int dark = 0;
  for (const auto& [cell, index] : o.lattice) {
    const auto right = o.lattice.find({cell.first + 1, cell.second}),
               down = o.lattice.find({cell.first, cell.second + 1});
    if (right == o.lattice.end() || down == o.lattice.end()) continue;
    const Saddle& s = saddles[index];
    const Vec2 diagonal = saddles[right->second].at + saddles[down->second].at - 2 * s.at;
    constexpr double kPi = 3.14159265358979323846;
    const double along = std::fmod(std::atan2(diagonal.y(), diagonal.x()) - s.angle[0] + 2 * kPi, kPi);
    const double end = std::fmod(s.angle[1] - s.angle[0] + kPi, kPi);
    const bool here = along < end;  // in the sector that follows the falling edge
    dark += here == ((cell.first + cell.second) % 2 == 0) ? 1 : -1;
  }
  return dark > 0;
}

// In the board's own order: columns along its longer agreement, and the dark square first. Empty: the size is another
// one.
Ordered as_board(const Board& board, Ordered o, const std::vector<Saddle>& saddles) {
  if (o.columns != board.columns || o.rows != board.rows) o = turned(o);
  if (o.columns != board.columns || o.rows != board.rows) return {};
  bool turn;
  if (half_turn_ambiguous(board)) {  // either will do: columns to the right of the image
    const auto mean_x = [&](int column) {
      double sum = 0, count = 0;
      for (const auto& [cell, index] : o.lattice) {
        if (cell.first != column) continue;
        sum += saddles[index].at.x() + 1e-3 * saddles[index].at.y();
        ++count;
      }
      return sum / count;
    };
    turn = mean_x(0) > mean_x(o.columns - 1);
  } else {
    turn = !first_is_dark(o, saddles);
  }
  return turn ? turned(turned(o)) : o;
}

// Each outer line of the board must be there for the most part, or the count from it is a guess.
bool borders_are_seen(const Ordered& o) {
  int left = 0, right = 0, top = 0, bottom = 0;
  for (const auto& [cell, index] : o.lattice) {
    left += cell.first == 0;
    right += cell.first == o.columns - 1;
    top += cell.second == 0;
    bottom += cell.second == o.rows - 1;
  }
  return 2 * std::min(left, right) >= o.rows && 2 * std::min(top, bottom) >= o.columns &&
         10 * o.lattice.size() >= 8 * static_cast<std::size_t>(o.columns * o.rows);
}

struct Found {
  Ordered board;
  std::vector<Saddle> saddles;
  int columns = 0, rows = 0;  // of the largest lattice seen, whatever it is
};

Found find_at(const Board& board, const Image& image, double radius) {
  Found found;
  found.saddles = find_saddles(smoothed(image), radius, kMostSaddles);
  const auto enough = static_cast<std::size_t>(4 * board.columns * board.rows);
  const auto at = [&](int i) { return found.saddles[i].at; };
  const Lattice lattice = trimmed(grow_chessboard(found.saddles, enough));
  if (lattice.size() < 9) return found;
  const Ordered o = normalised(lattice, at);
  found.columns = std::max(o.columns, o.rows);
  found.rows = std::min(o.columns, o.rows);
  found.board = as_board(board, o, found.saddles);
  if (!found.board.lattice.empty() && !borders_are_seen(found.board)) found.board = {};
  return found;
}

// A corner of the board in the full image, from where it should be and a corner like it.
std::optional<Saddle> fitted(const Image& image, const Vec2& near, const Saddle& like, double space, double& sigma_px) {
  constexpr double kReach = 0.42, kLeast = 2.5, kMost = 16, kFaint = 0.25;
  const double radius = std::clamp(kReach * space, kLeast, kMost);
  const auto corner = fit_corner(image, near, like.angle[0], like.angle[1], radius);
  if (!corner || 2 * corner->contrast < kFaint * like.strength) return std::nullopt;
  sigma_px = corner->sigma_px;
  return Saddle{corner->at, {like.angle[0], like.angle[1]}, like.strength};
}

// The neighbour nearest to a cell's place, and its distance.
const Saddle* neighbour_of(const Lattice& lattice, const std::vector<Saddle>& saddles, const Cell& cell, const Vec2& at,
                           double& space) {
  const Saddle* best = nullptr;
  space = std::numeric_limits<double>::infinity();
  for (const Cell& n : {Cell{cell.first + 1, cell.second}, Cell{cell.first - 1, cell.second},
                        Cell{cell.first, cell.second + 1}, Cell{cell.first, cell.second - 1}}) {
    const auto other = lattice.find(n);
    if (other == lattice.end() || (saddles[other->second].at - at).norm() >= space) continue;
    best = &saddles[other->second];
    space = (best->at - at).norm();
  }
  return best;
}

// Whether corners follow beyond an outer line: then the board is a larger one, of which this is a part.
bool goes_on(const Board& board, const Image& image, const Lattice& lattice, const std::vector<Saddle>& corners,
             Detection& d) {
  constexpr double kNear = 0.2, kStrong = 2.7;  // of a step; times what fitted() asks of the contrast
  const auto at = [&](int i) { return corners[static_cast<std::size_t>(i)].at; };
  const auto there = [&](const Cell& cell) {
    const Vec2 expected = predicted(lattice, cell, at);
    double space, sigma = 0;
    const Saddle* beside = expected.allFinite() ? neighbour_of(lattice, corners, cell, expected, space) : nullptr;
    if (!beside) return false;
    const Saddle like{expected, {beside->angle[1], beside->angle[0]}, kStrong * beside->strength};
    const auto corner = fitted(image, expected, like, space, sigma);
    return corner && (corner->at - expected).norm() < kNear * space;
  };
  bool more = false;
  const auto side = [&](bool column, int line, int length, int& seen) {
    int count = 0;
    for (int i = 0; i < length; ++i) count += there(column ? Cell{line, i} : Cell{i, line});
    if (2 * count < length) return;
    more = true;
    ++seen;
  };
  int columns = board.columns, rows = board.rows;
  side(true, -1, board.rows, columns);
  side(true, board.columns, board.rows, columns);
  side(false, -1, board.columns, rows);
  side(false, board.rows, board.columns, rows);
  if (!more) return false;
  d.seen_columns = columns;
  d.seen_rows = rows;
  return true;
}

// Fits every corner of the board to the full image; `scale`: pixels of the full image a pixel of the level. Those that
// no candidate stood for are looked for where their neighbours expect them, row after row.
void fit_board(const Board& board, const Image& image, const Found& found, double scale, Detection& d) {
  constexpr int kPasses = 4;
  constexpr double kNear = 0.3;
  std::vector<Saddle> corners;
  std::vector<double> sigmas;
  Lattice lattice;
  const auto keep = [&](const Cell& cell, const std::optional<Saddle>& corner, double sigma) {
    if (!corner) return;
    lattice[cell] = static_cast<int>(corners.size());
    corners.push_back(*corner);
    sigmas.push_back(sigma);
  };
  for (const auto& [cell, index] : found.board.lattice) {
    double space, sigma = 0;
    const Saddle& here = found.saddles[index];
    if (!neighbour_of(found.board.lattice, found.saddles, cell, here.at, space)) continue;
    const auto corner = fitted(image, (here.at.array() + 0.5) * scale - 0.5, here, space * scale, sigma);
    keep(cell, corner, sigma);
  }
  const auto at = [&](int i) { return corners[i].at; };
  lattice = cleaned(lattice, at);
  for (int pass = 0; pass < kPasses; ++pass) {
    for (int j = 0; j < board.rows; ++j) {
      for (int i = 0; i < board.columns; ++i) {
        const Vec2 expected =
            lattice.count({i, j}) ? Vec2(Vec2::Constant(std::nan(""))) : predicted(lattice, {i, j}, at);
        if (!expected.allFinite()) continue;
        double space, sigma = 0;
        const Saddle* beside = neighbour_of(lattice, corners, {i, j}, expected, space);
        if (!beside) continue;
        const Saddle like{expected, {beside->angle[1], beside->angle[0]}, beside->strength};
        const auto corner = fitted(image, expected, like, space, sigma);
        if (corner && (corner->at - expected).norm() < kNear * space) keep({i, j}, corner, sigma);
      }
    }
  }
  lattice = cleaned(lattice, at);
  if (goes_on(board, image, lattice, corners, d)) return;
  for (const auto& [cell, index] : lattice) {
    d.index.push_back(cell.second * board.columns + cell.first);
    d.pixel.push_back(corners[index].at);
    d.sigma_px.push_back(sigmas[index]);
  }
}

Detection detect_chessboard(const Run& run, const Board& board, const Image& image) {
  constexpr double kRadius = 5, kSmallRadius = 3;
  constexpr int kFirstSide = 800, kSmallestSide = 80;
  struct Level {
    Image image;
    double scale;
  };
  std::vector<Level> levels;
  levels.push_back({image, 1});
  while (std::min(levels.back().image.width, levels.back().image.height) >= 2 * kSmallestSide)
    levels.push_back({halved(levels.back().image), levels.back().scale * 2});
  // From the scale of about 800 pixels to finer ones, then to coarser ones, then the full image with a small ring.
  int first = 0;
  while (first + 1 < static_cast<int>(levels.size()) && levels[first].image.width > kFirstSide) ++first;
  std::vector<std::pair<int, double>> order;
  for (int l = first; l >= 0; --l) order.emplace_back(l, kRadius);
  for (int l = first + 1; l < static_cast<int>(levels.size()); ++l) order.emplace_back(l, kRadius);
  for (int l = 0; l <= first; ++l) order.emplace_back(l, kSmallRadius);
  Detection d;
  for (std::size_t n = 0; n < order.size(); ++n) {
    run.poll(static_cast<double>(n) / static_cast<double>(order.size()), "find the board");
    const Level& level = levels[order[n].first];
    const Found found = find_at(board, level.image, order[n].second);
    if (found.columns * found.rows > d.seen_columns * d.seen_rows) {
      d.seen_columns = found.columns;
      d.seen_rows = found.rows;
    }
    if (found.board.lattice.empty()) continue;
    fit_board(board, image, found, level.scale, d);
    d.found = 10 * d.index.size() >= 8 * static_cast<std::size_t>(board.columns * board.rows);
    if (d.found) return d;
    d.index.clear();
    d.pixel.clear();
    d.sigma_px.clear();
  }
  const std::string wanted = std::to_string(board.columns) + " x " + std::to_string(board.rows);
  d.why = d.seen_columns == 0 ? "no chessboard seen, expected " + wanted + " inner corners"
                              : "saw " + std::to_string(d.seen_columns) + " x " + std::to_string(d.seen_rows) +
                                    " inner corners at most, expected a whole board of " + wanted;
  return d;
}

}  // namespace

namespace {

// To 0 ... 255, whatever the caller's range; what is clipped to infinity becomes 255.
void stretch(Image& image) {
  float low = std::numeric_limits<float>::infinity(), high = -low;
  for (float v : image.pixels) {
    if (!std::isfinite(v)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  const float scale = high > low ? 255 / (high - low) : 0;
  for (float& v : image.pixels) v = std::isfinite(v) ? (v - low) * scale : 255;
}

}  // namespace

Detection detect_board(const Run& run, const Board& board, const ImageView& view) {
  check_board(board);
  Image image;
  load(view, image);
  stretch(image);
  return board.kind == BoardKind::kCircles ? detect_circles(run, board, image) : detect_chessboard(run, board, image);
}

}  // namespace sgrt
