// Nearest neighbours, see core/nearest.hpp. Four things are done around FLANN's exact kd-tree. Coincident points enter
// it once and hang on a list, so that a million equal points cost no more than one. A large cloud is halved into parts
// with a tree each, so that threads share the work and the caller is asked between them. Our result set asks for all
// points within the last bits of the bound and decides itself, so that ties go to the lowest index whatever the trees'
// shapes. And FLANN's arena, which goes on with NULL when memory ends, is made to throw.
#include "core/nearest.hpp"

#include <stdio.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/parallel.hpp"

static void* malloc_or_throw(std::size_t size) {
  void* memory = malloc(size);
  if (!memory) throw std::bad_alloc();
  return memory;
}
#define malloc malloc_or_throw
#include <flann/util/allocator.h>
#undef malloc
#include <flann/algorithms/dist.h>
#include <flann/algorithms/kdtree_single_index.h>
#include <flann/general.h>

namespace sgrt {
namespace {

using Index = flann::KDTreeSingleIndex<flann::L2_3D<double>>;

constexpr int kLeaf = 10;
constexpr std::int64_t kMostInPart = 50'000;  // about 10 ms
// FLANN adds up the distance to a box step by step: it prunes by a bound that is this much wider, the result stays
// exact.
constexpr double kRounding = 1e-12;
// Beyond it a square overflows.
constexpr double kFarthest = 1e150;

std::uint64_t hash_of(const double* x) {
  std::uint64_t h = 0;
  for (int k = 0; k < 3; ++k) {
    std::uint64_t bits;
    const double value = x[k] + 0.0;  // -0 is 0
    std::memcpy(&bits, &value, sizeof bits);
    h = (h ^ bits) * 0x9E3779B97F4A7C15u;
    h ^= h >> 29;
  }
  return h ^ (h >> 32);
}

}  // namespace

struct Nearest::Tree {
  struct Place {
    Vec3 x;
    std::int32_t distinct;
  };
  struct Places {
    int part;
    Place *begin, *end;
  };
  // A box: of two halves, or of points in a tree of their own.
  struct Part {
    Vec3 low, high;
    int halves[2] = {-1, -1};      // parts
    std::vector<std::int32_t> of;  // distinct points
    std::unique_ptr<Index> index;

    double distance2(const Vec3& x) const { return (x - x.cwiseMax(low).cwiseMin(high)).squaredNorm(); }
  };

  std::int64_t size = 0;
  std::vector<Part> parts;          // the whole first; none where there is no point
  std::vector<std::int32_t> row;    // of a distinct point: the lowest row given that lies there
  std::vector<std::int32_t> again;  // of a row given: the next one at the same place, or -1; empty: all are distinct

  std::vector<Place> distinct(const Run& run, const Points& points);
  int halve(const Run& run, Place* begin, Place* end, std::vector<Places>& uncut);
  void build(const Places& places);
  std::int32_t next(std::int32_t i) const { return again.empty() ? -1 : again[static_cast<std::size_t>(i)]; }
  class Best;
};

// Fills row and again; returns the distinct finite points.
std::vector<Nearest::Tree::Place> Nearest::Tree::distinct(const Run& run, const Points& points) {
  const auto n = static_cast<std::size_t>(points.rows());
  std::size_t slots = 16;
  while (slots < 2 * n) slots *= 2;
  std::vector<std::int32_t> slot(slots, -1);  // distinct point by hash, linear probing
  std::vector<std::int32_t> last;             // of a distinct point: the last row seen there
  std::vector<Place> kept;
  kept.reserve(n);
  row.reserve(n);
  last.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (i % kMostInPart == 0) run.poll(static_cast<double>(i) / static_cast<double>(n), "search tree: places");
    const double* x = points.data() + 3 * i;
    if (!(std::isfinite(x[0]) && std::isfinite(x[1]) && std::isfinite(x[2]))) continue;
    if (std::abs(x[0]) > kFarthest || std::abs(x[1]) > kFarthest || std::abs(x[2]) > kFarthest) {
      fail(Status::kInvalidArgument, "points[" + std::to_string(i) + "]: a coordinate beyond 1e150");
    }
    ++size;
    std::size_t at = hash_of(x) & (slots - 1);
    const auto same = [&](std::int32_t j) {
      const Vec3& y = kept[static_cast<std::size_t>(j)].x;
      return x[0] == y[0] && x[1] == y[1] && x[2] == y[2];
    };
    while (slot[at] >= 0 && !same(slot[at])) at = (at + 1) & (slots - 1);
    const auto now = static_cast<std::int32_t>(i);
    if (slot[at] < 0) {
      slot[at] = static_cast<std::int32_t>(row.size());
      kept.push_back({Vec3(x[0], x[1], x[2]), slot[at]});
      row.push_back(now);
      last.push_back(now);
    } else {
      if (again.empty()) again.assign(n, -1);
      std::int32_t& before = last[static_cast<std::size_t>(slot[at])];
      again[static_cast<std::size_t>(before)] = now;
      before = now;
    }
  }
  return kept;
}

// Into parts of at most kMostInPart points, across the longest side of their box. Returns the number of the whole.
int Nearest::Tree::halve(const Run& run, Place* begin, Place* end, std::vector<Places>& uncut) {
  const std::size_t made = parts.size();
  Part part;
  part.low = part.high = begin->x;
  for (const Place* p = begin; p != end; ++p) part.low = part.low.cwiseMin(p->x), part.high = part.high.cwiseMax(p->x);
  int axis;
  (part.high - part.low).maxCoeff(&axis);
  parts.push_back(std::move(part));
  if (end - begin <= kMostInPart) {
    uncut.push_back({static_cast<int>(made), begin, end});
  } else {
    run.poll(0, "search tree: parts");
    Place* const middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end, [axis](const Place& a, const Place& b) { return a.x[axis] < b.x[axis]; });
    const int lower = halve(run, begin, middle, uncut), upper = halve(run, middle, end, uncut);
    parts[made].halves[0] = lower, parts[made].halves[1] = upper;
  }
  return static_cast<int>(made);
}

void Nearest::Tree::build(const Places& places) {
  Part& part = parts[static_cast<std::size_t>(places.part)];
  std::vector<Vec3> points;
  points.reserve(static_cast<std::size_t>(places.end - places.begin));
  part.of.reserve(points.capacity());
  for (const Place* p = places.begin; p != places.end; ++p) points.push_back(p->x), part.of.push_back(p->distinct);
  const flann::Matrix<double> matrix(points[0].data(), points.size(), 3);
  // `reorder` copies the points into the order of the leaves, so `points` need not live on.
  part.index = std::make_unique<Index>(matrix, flann::KDTreeSingleIndexParams(kLeaf, true));
  part.index->buildIndex();
}

// The k best hits, nearest first, ties by row.
class Nearest::Tree::Best : public flann::ResultSet<double> {
 public:
  Best(const Tree& tree, int k, double max_distance, Hit* hits)
      : tree_(tree), k_(k), limit2_(max_distance * max_distance), hits_(hits) {}

  int count() const { return count_; }
  bool full() const override { return count_ == k_; }
  double worstDist() const override { return bound() * (1 + kRounding) + std::numeric_limits<double>::min(); }

  void look_into(const Part& part, const Vec3& x) {
    if (part.index) {
      part_ = &part;
      part.index->findNeighbors(*this, x.data(), flann::SearchParams());
      return;
    }
    const Part* halves[] = {&tree_.parts[static_cast<std::size_t>(part.halves[0])],
                            &tree_.parts[static_cast<std::size_t>(part.halves[1])]};
    const double d[] = {halves[0]->distance2(x), halves[1]->distance2(x)};
    const int nearer = d[1] < d[0];
    look_into(*halves[nearer], x);
    if (d[1 - nearer] <= worstDist()) look_into(*halves[1 - nearer], x);
  }

  void addPoint(double distance2, std::size_t of_part) override {
    const auto distinct = static_cast<std::size_t>(part_->of[of_part]);
    for (std::int32_t i = tree_.row[distinct]; i >= 0; i = tree_.next(i)) {
      if (!insert({i, distance2})) return;  // the rows that follow are higher still
    }
  }

 private:
  double bound() const { return count_ == k_ ? hits_[k_ - 1].distance2 : limit2_; }

  static bool before(const Hit& a, const Hit& b) {
    return a.distance2 != b.distance2 ? a.distance2 < b.distance2 : a.index < b.index;
  }

  bool insert(const Hit& hit) {
    if (!(hit.distance2 <= limit2_) || (count_ == k_ && !before(hit, hits_[k_ - 1]))) return false;
    int at = count_ < k_ ? count_++ : k_ - 1;
    for (; at > 0 && before(hit, hits_[at - 1]); --at) hits_[at] = hits_[at - 1];
    hits_[at] = hit;
    return true;
  }

  const Tree& tree_;
  const Part* part_ = nullptr;
  int k_, count_ = 0;
  double limit2_;
  Hit* hits_;
};

Nearest::Nearest(const Run& run, const Points& points) : tree_(std::make_unique<Tree>()) {
  if (points.rows() > std::numeric_limits<std::int32_t>::max()) fail(Status::kLimit, "points: more than 2^31 - 1");
  std::vector<Tree::Place> places = tree_->distinct(run, points);
  if (places.empty()) return;
  std::vector<Tree::Places> uncut;
  tree_->halve(run, places.data(), places.data() + places.size(), uncut);
  const auto build = [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) tree_->build(uncut[static_cast<std::size_t>(i)]);
  };
  parallel_for(run, static_cast<std::int64_t>(uncut.size()), 1, build, "search tree");
}

Nearest::~Nearest() = default;
Nearest::Nearest(Nearest&&) noexcept = default;
Nearest& Nearest::operator=(Nearest&&) noexcept = default;

std::int64_t Nearest::size() const {
  return tree_->size;
}

Nearest::Hit Nearest::nearest(const Vec3& x, double max_distance) const {
  Hit hit;
  return neighbours(x, 1, max_distance, &hit) == 1 ? hit : Hit{};
}

int Nearest::neighbours(const Vec3& x, int k, double max_distance, Hit* hits) const {
  if (tree_->parts.empty() || k <= 0 || !(max_distance >= 0) || !x.allFinite()) return 0;
  Tree::Best best(*tree_, k, max_distance, hits);
  best.look_into(tree_->parts[0], x);
  return best.count();
}

}  // namespace sgrt
