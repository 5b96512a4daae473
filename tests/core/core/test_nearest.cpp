// Nearest neighbours against brute force on clouds of every kind, with ties, duplicates and nonsense.
#include "core/nearest.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <thread>
#include <vector>

#include "core/parallel.hpp"
#include "expect.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;
using Hit = Nearest::Hit;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

std::vector<Hit> brute_force(const Points& points, const Vec3& x, int k, double max_distance) {
  std::vector<Hit> hits;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!points.row(i).allFinite()) continue;
    const double a = x.x() - points(i, 0), b = x.y() - points(i, 1), c = x.z() - points(i, 2);
    const double d = a * a + b * b + c * c;
    if (d <= max_distance * max_distance) hits.push_back({i, d});
  }
  std::sort(hits.begin(), hits.end(), [](const Hit& p, const Hit& q) {
    return std::make_pair(p.distance2, p.index) < std::make_pair(q.distance2, q.index);
  });
  hits.resize(std::min(hits.size(), static_cast<std::size_t>(k)));
  return hits;
}

void expect_like_brute_force(const Points& points, const std::vector<Vec3>& queries) {
  const Nearest nearest(sgrt::Run{}, points);
  Draw draw(99);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const int k = i % 3 == 0 ? 1 : i % 3 == 1 ? 5 : 30;
    const double reach = i % 4 == 0 ? kInf : std::pow(10, draw.uniform(-3, 3));
    std::vector<Hit> hits(static_cast<std::size_t>(k));
    hits.resize(static_cast<std::size_t>(nearest.neighbours(queries[i], k, reach, hits.data())));
    const std::vector<Hit> expected = brute_force(points, queries[i], k, reach);
    ASSERT_EQ(hits.size(), expected.size());
    for (std::size_t j = 0; j < hits.size(); ++j) {
      ASSERT_EQ(hits[j].index, expected[j].index) << "query " << queries[i].transpose() << ", neighbour " << j;
      ASSERT_EQ(hits[j].distance2, expected[j].distance2);
    }
    const Hit first = nearest.nearest(queries[i], reach);
    ASSERT_EQ(first.index, expected.empty() ? -1 : expected[0].index);
  }
}

std::vector<Vec3> queries_round(const Points& points, double scale, int n, Draw& draw) {
  std::vector<Vec3> queries;
  for (int i = 0; i < n; ++i) {
    const Eigen::Index row = static_cast<Eigen::Index>(draw.bits() % static_cast<std::uint64_t>(points.rows()));
    const Vec3 point = points.row(row).transpose();
    queries.push_back(i % 3 == 0 ? point : i % 3 == 1 ? Vec3(point + draw.vec3(scale / 100)) : draw.vec3(1.5 * scale));
  }
  return queries;
}

Points cloud(int n, const std::function<Vec3(int)>& point) {
  Points p(n, 3);
  for (int i = 0; i < n; ++i) p.row(i) = point(i).transpose();
  return p;
}

// REQ-SURF-016
TEST(Nearest, RandomCloudsOfEverySize) {
  Draw draw(1);
  for (int n : {1, 2, 3, 9, 10, 11, 12, 50, 1000, 20000}) {
    const Points p = cloud(n, [&](int) { return draw.vec3(100); });
    expect_like_brute_force(p, queries_round(p, 100, n > 5000 ? 100 : 300, draw));
  }
}

// A large cloud has several trees.
TEST(Nearest, LargeCloudsInParts) {
  Draw draw(10);
  const Points spread = cloud(170'000, [&](int) { return draw.vec3(100); });
  expect_like_brute_force(spread, queries_round(spread, 100, 60, draw));
  // Ties across the cuts: a lattice, its points' order shuffled, asked half-way between them.
  const Points lattice = cloud(110'592, [&](int i) {
    const int j = static_cast<int>((std::int64_t{i} * 48'611) % 110'592);
    return Vec3(j % 48, j / 48 % 48, j / 2304);
  });
  std::vector<Vec3> middles;
  for (int i = 0; i < 60; ++i)
    middles.push_back(0.5 * Vec3(std::floor(draw.uniform(40, 56)), std::floor(draw.uniform(40, 56)),
                                 std::floor(draw.uniform(40, 56))));
  expect_like_brute_force(lattice, middles);
  // Most coordinates equal, so that a cut runs through equal ones.
  const Points comb = cloud(120'000, [&](int i) { return Vec3(i % 7 == 0 ? i : 0, 1e-3 * i, 0); });
  expect_like_brute_force(comb, queries_round(comb, 120, 30, draw));
}

TEST(Nearest, AsksBetweenItsPartsAndIsTheSameWithThreads) {
  Draw draw(11);
  const Points p = cloud(300'000, [&](int) { return draw.vec3(100); });
  int polls = 0;
  sgrt::Run run;
  run.progress = [&](double, const char*) { return ++polls == 20; };
  expect_error(Status::kCancelled, "search tree", [&] { Nearest(run, p); });
  EXPECT_EQ(polls, 20);
  ThreadPool pool(4);
  sgrt::Run by_four;
  by_four.pool = &pool;
  const Nearest one(sgrt::Run{}, p), four(by_four, p);
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = draw.vec3(120);
    Hit a[8], b[8];
    ASSERT_EQ(one.neighbours(x, 8, kInf, a), 8);
    ASSERT_EQ(four.neighbours(x, 8, kInf, b), 8);
    for (int k = 0; k < 8; ++k) ASSERT_TRUE(a[k].index == b[k].index && a[k].distance2 == b[k].distance2);
  }
}

TEST(Nearest, LatticeFullOfTies) {
  Draw draw(2);
  const Points p = cloud(9 * 9 * 9, [&](int i) { return Vec3(i % 9, i / 9 % 9, i / 81); });
  std::vector<Vec3> queries;
  for (int i = 0; i < 600; ++i)
    queries.push_back(
        0.5 * Vec3(std::floor(draw.uniform(0, 17)), std::floor(draw.uniform(0, 17)), std::floor(draw.uniform(0, 17))));
  expect_like_brute_force(p, queries);
}

TEST(Nearest, PointsOnASphereSeenFromItsCentre) {
  Draw draw(3);
  const Points p = cloud(3000, [&](int) { return Vec3(100 * draw.direction()); });
  expect_like_brute_force(p, {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Constant(1e-14), Vec3::Constant(1e-9)});
}

TEST(Nearest, Duplicates) {
  Draw draw(4);
  const Points p =
      cloud(2000, [&](int) { return Vec3(std::floor(draw.uniform(0, 6)), std::floor(draw.uniform(-3, 3)), 0); });
  expect_like_brute_force(p, queries_round(p, 6, 300, draw));
  Points zeros = Points::Zero(40, 3);
  for (int i = 0; i < 40; i += 2) zeros(i, i % 3) = -0.0;  // the same place
  expect_like_brute_force(zeros, {Vec3::Zero(), Vec3(1, 2, 3), Vec3(1, 2, 3)});
}

// REQ-SURF-016
TEST(Nearest, AMillionEqualPointsCostNoMoreThanOne) {
  const Points p = Points::Constant(1'000'000, 3, 7.5);
  const Nearest nearest(sgrt::Run{}, p);
  EXPECT_EQ(nearest.size(), 1'000'000);
  Hit hits[5];
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 20000; ++i) {
    ASSERT_EQ(nearest.nearest(Vec3(i, 0, 0), kInf).index, 0);
    ASSERT_EQ(nearest.neighbours(Vec3(i, 0, 0), 5, kInf, hits), 5);
  }
  for (int k = 0; k < 5; ++k) EXPECT_EQ(hits[k].index, k);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));  // 4e10 comparisons otherwise
}

// REQ-SURF-016
TEST(Nearest, Collinear) {
  Draw draw(5);
  const Vec3 along = draw.direction();
  for (int axis = 0; axis < 4; ++axis) {
    const Vec3 direction = axis < 3 ? Vec3(Vec3::Unit(axis)) : along;
    const Points p = cloud(5000, [&](int) { return Vec3(draw.uniform(-100, 100) * direction); });
    expect_like_brute_force(p, queries_round(p, 100, 60, draw));
  }
}

TEST(Nearest, ExponentialSpacingMakesADeepTree) {
  Draw draw(6);
  const Points p = cloud(3 * 1000, [&](int i) { return Vec3(std::ldexp(1e5, -i / 3) * Vec3::Unit(i % 3)); });
  std::vector<Vec3> queries = queries_round(p, 1, 100, draw);
  for (int i = 0; i < 100; ++i) queries.push_back(std::pow(10, draw.uniform(-100, 5)) * draw.direction());
  expect_like_brute_force(p, queries);
}

TEST(Nearest, Clusters) {
  Draw draw(7);
  const Points p =
      cloud(10000, [&](int i) { return Vec3(1e5 * Vec3(i % 2, i % 3 / 2.0, i % 5 / 4.0) + draw.vec3(1e-6)); });
  expect_like_brute_force(p, queries_round(p, 1e5, 60, draw));
}

TEST(Nearest, NonFinitePointsAreLeftOut) {
  Draw draw(8);
  Points p = cloud(500, [&](int) { return draw.vec3(100); });
  for (int i = 0; i < 500; i += 3) p(i, i % 2) = i % 4 == 0 ? kNaN : i % 4 == 1 ? kInf : -kInf;
  EXPECT_EQ(Nearest(sgrt::Run{}, p).size(), 500 - 167);
  expect_like_brute_force(p, [&] {
    std::vector<Vec3> q;
    for (int i = 0; i < 200; ++i) q.push_back(draw.vec3(150));
    return q;
  }());
}

TEST(Nearest, NoneOrOne) {
  for (const Points& p : {Points(0, 3), Points(Points::Constant(5, 3, kNaN))}) {
    const Nearest none(sgrt::Run{}, p);
    EXPECT_EQ(none.size(), 0);
    EXPECT_EQ(none.nearest(Vec3::Zero(), kInf).index, -1);
    Hit hit;
    EXPECT_EQ(none.neighbours(Vec3::Zero(), 1, kInf, &hit), 0);
  }
  const Nearest one(sgrt::Run{}, Points(Eigen::RowVector3d(3, 4, 0)));
  EXPECT_EQ(one.nearest(Vec3::Zero(), 5).index, 0);  // the limit counts
  EXPECT_EQ(one.nearest(Vec3::Zero(), 5).distance2, 25);
  EXPECT_EQ(one.nearest(Vec3::Zero(), std::nextafter(5, 0)).index, -1);
  EXPECT_EQ(one.nearest(Vec3(3, 4, 0), 0).index, 0);
}

TEST(Nearest, Nonsense) {
  Nearest nearest(sgrt::Run{}, Points::Random(100, 3));
  Hit hits[2];
  for (double bad : {kNaN, kInf, -kInf}) EXPECT_EQ(nearest.nearest(Vec3(0, bad, 0), kInf).index, -1);
  for (double bad : {kNaN, -1.0}) EXPECT_EQ(nearest.nearest(Vec3::Zero(), bad).index, -1);
  EXPECT_EQ(nearest.neighbours(Vec3::Zero(), 0, kInf, hits), 0);
  EXPECT_EQ(nearest.neighbours(Vec3::Zero(), -4, kInf, nullptr), 0);
  EXPECT_EQ(nearest.nearest(Vec3::Constant(1e300), kInf).index, -1);  // no distance can be told
  expect_error(Status::kInvalidArgument, "points[1]",
               [] { Nearest(sgrt::Run{}, Points::Constant(3, 3, 1e200).colwise() + Eigen::Vector3d(-1e200, 0, 0)); });
  Nearest moved = std::move(nearest);
  nearest = std::move(moved);
  EXPECT_EQ(nearest.size(), 100);
}

// REQ-CTX-007
TEST(Nearest, ManyThreads) {
  Draw draw(9);
  const Points p = cloud(5000, [&](int) { return draw.vec3(100); });
  const Nearest nearest(sgrt::Run{}, p);
  std::vector<std::int64_t> serial(p.rows());
  const auto shifted = [&](Eigen::Index i) { return Vec3(p.row(i).transpose() + Vec3(1, -2, 3)); };
  for (Eigen::Index i = 0; i < p.rows(); ++i)
    serial[static_cast<std::size_t>(i)] = nearest.nearest(shifted(i), kInf).index;
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (Eigen::Index i = 0; i < p.rows(); ++i)
        wrong += nearest.nearest(shifted(i), kInf).index != serial[static_cast<std::size_t>(i)];
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace sgrt
