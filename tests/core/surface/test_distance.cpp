// Signed distance against spheres and planes, its border and its holes.
#include <limits>

#include "scenes.hpp"
#include "surface/distance.hpp"
#include "surface/normals.hpp"

namespace sgrt {
namespace {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A cap of radius 100 about the origin, one random point a cell of 3 mm.
Surface cap(Draw& draw) {
  Surface s;
  s.points.resize(6980, 3);  // 2 pi R^2 / 9
  for (std::int64_t i = 0; i < s.size(); ++i) {
    const double z = (static_cast<double>(i) + 0.5) / static_cast<double>(s.size());
    const double a = 2 * kPi * std::fmod(0.6180339887498949 * static_cast<double>(i), 1.0) + 0.01 * draw.uniform();
    s.points.row(i) << 100 * std::sqrt(1 - z * z) * std::cos(a), 100 * std::sqrt(1 - z * z) * std::sin(a), 100 * z;
  }
  return s;
}

// REQ-SURF-011
TEST(Distance, SphereIsRightBetweenItsSamples) {
  Draw draw(1);
  const Surface estimated = estimate_normals(kSilent, cap(draw), {});
  Surface exact = estimated;
  exact.normals = exact.points / 100;
  for (const Surface& reference : {estimated, exact}) {
    Surface live;
    live.points.resize(3000, 3);
    Eigen::VectorXd truth(3000);
    for (std::int64_t i = 0; i < 3000; ++i) {
      Vec3 d = draw.direction();
      d[2] = std::abs(d[2]) + 0.2;  // not at the border
      truth[i] = draw.uniform(-8, 8);
      live.points.row(i) = ((100 + truth[i]) * d.normalized()).transpose();
    }
    const Eigen::VectorXd found = signed_distance(kSilent, reference, live, {}, {});
    EXPECT_LT((found - truth).cwiseAbs().maxCoeff(), 0.01);
  }
}

TEST(Distance, IsTakenAtThePose) {
  Draw draw(2);
  const Surface reference = estimate_normals(kSilent, sample(plane, 4000, 0, draw), {});
  Surface live = sample([](double u, double v) { return Vec3(0.8 * plane(u, v)); }, 500, 0, draw);  // z = 16
  const Pose D = displacement(200, 50, Vec3(1, 2, 3), draw);
  const Eigen::VectorXd found = signed_distance(kSilent, reference, moved(live, D), D.inverse(), {});
  EXPECT_LT((found.array() + 4).abs().maxCoeff(), 1e-6);
}

// REQ-SURF-011
TEST(Distance, NothingPastTheBorderOrTooFar) {
  Draw draw(3);
  const Surface reference = estimate_normals(kSilent, sample(plane, 13000, 0, draw), {});  // 3 mm apart
  Surface live;
  live.points.resize(5, 3);
  live.points << 0, 0, 25, 159, 0, 20, 0, -209, 20, 0, 0, 41, kNan, kNan, kNan;
  const Eigen::VectorXd found = signed_distance(kSilent, reference, live, {}, {});
  EXPECT_NEAR(found[0], 5, 1e-6);
  for (int i = 1; i < 5; ++i) EXPECT_TRUE(std::isnan(found[i])) << i;
}

TEST(Distance, BadInput) {
  Draw draw(4);
  const Surface bare = sample(plane, 100, 0, draw), good = estimate_normals(kSilent, bare, {});
  expect_error(Status::kInvalidArgument, "reference has no normals",
               [&] { signed_distance(kSilent, bare, bare, {}, {}); });
  expect_error(Status::kInvalidArgument, "max_distance_mm is -1",
               [&] { signed_distance(kSilent, good, bare, {}, DistanceOptions{-1}); });
}

}  // namespace
}  // namespace sgrt
