// Live mode: near the prior as good as everywhere, and never what the prior says in place of what is seen.
#include <gtest/gtest.h>

#include <cstring>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "rig/parameters.hpp"
#include "stereo/prior.hpp"
#include "stereo/scene.hpp"
#include "stereo/stereo.hpp"

namespace sgrt {
namespace {

using namespace testing;

const Scene kSphere{150, 0};

struct Pair {
  Rig rig = small_rig();
  std::vector<float> left, right;
  explicit Pair(const Scene& scene = kSphere) {
    const Texture texture(4.5);
    left = render(rig.cameras[0], scene, texture, 200, 10, 1, 1);
    right = render(rig.cameras[1], scene, texture, 200, 10, 1, 2);
  }
  std::shared_ptr<StereoResult> push(StereoMatcher& matcher, const Run& run = {}) const {
    return matcher.match(run, view_of(left, rig.cameras[0]), view_of(right, rig.cameras[1]));
  }
  StereoMatcher matcher() const { return {{}, rig, rig.pairs[0], {}}; }
};

// The whole sphere's front, moved by `off`, a point every `step` mm.
Surface cap(const Vec3& off, double step = 2) {
  std::vector<Vec3> points;
  for (double x = -60; x <= 60; x += step)
    for (double y = -60; y <= 60; y += step) points.emplace_back(x, y, std::sqrt(150 * 150 - x * x - y * y) - 150);
  Surface s;
  s.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    s.points.row(static_cast<Eigen::Index>(i)) = (points[i] + off).transpose();
  return s;
}

double rms_of(const StereoResult& result, double& worst) {
  double sum = 0, n = 0;
  worst = 0;
  for (std::int64_t k = 0; k < result.surface->size(); ++k) {
    if (!result.surface->present(k)) continue;
    const double d = kSphere.distance(result.surface->point(k));
    sum += d * d, n += 1, worst = std::max(worst, std::abs(d));
  }
  return std::sqrt(sum / n);
}

std::int64_t count(const StereoResult& result, Reason reason) {
  return result.reason_count[static_cast<std::size_t>(reason)];
}

TEST(Live, NearThePriorAsGoodAsEverywhere) {
  const Pair pair;
  StereoMatcher matcher = pair.matcher();
  double worst = 0;
  const auto whole = pair.push(matcher);
  const double everywhere = rms_of(*whole, worst);
  const std::int64_t all = whole->point_count;
  for (const double step : {2.0, 9.0})  // a dense prior and a sparse one
    for (const double dz : {0.0, 8.0, -8.0}) {
      const Surface prior = cap(Vec3(2, -3, dz), step);
      matcher.set_prior({}, &prior, nullptr, {});
      const auto result = pair.push(matcher);
      EXPECT_GT(result->point_count, 1500) << "prior " << dz << " mm off, a point every " << step;
      EXPECT_LT(result->point_count, all);
      EXPECT_LT(rms_of(*result, worst), everywhere);  // the rim is not in it
      EXPECT_LT(worst, 1.0);
      EXPECT_LT(count(*result, Reason::kMoved), step > 5 ? 30 : 1);
    }
  matcher.set_prior({}, nullptr, nullptr, {});
  EXPECT_EQ(pair.push(matcher)->point_count, all);
}

TEST(Live, OnlyTheRegion) {
  const Pair pair;
  StereoMatcher matcher = pair.matcher();
  const Surface prior = cap(Vec3::Zero());
  const Roi roi = roi_from_box(Vec3(-20, -15, -200), Vec3(30, 25, 200));
  matcher.set_prior({}, &prior, &roi, {});
  const auto result = pair.push(matcher);
  ASSERT_EQ(result->status, Status::kOk);
  EXPECT_GT(result->point_count, 200);
  EXPECT_GT(count(*result, Reason::kOutOfVolume), 0);
  for (std::int64_t k = 0; k < result->surface->size(); ++k) {
    if (!result->surface->present(k)) continue;
    const Vec3 x = result->surface->point(k);  // a node is 6 px, 5 mm
    EXPECT_TRUE(x.x() > -28 && x.x() < 38 && x.y() > -23 && x.y() < 33) << x.transpose();
  }
}

// What has moved beyond the band is told, a wrong prior finds nothing or the truth.
TEST(Live, APriorNeverMakesASurface) {
  const Pair pair;
  StereoMatcher matcher = pair.matcher();
  PriorOptions narrow;
  narrow.band = 5;
  Surface prior = cap(Vec3(0, 0, 12));
  matcher.set_prior({}, &prior, nullptr, narrow);
  auto result = pair.push(matcher);
  EXPECT_LT(result->point_count, 50);
  EXPECT_GT(count(*result, Reason::kMoved), 1000);
  for (const double dz : {60.0, -80.0, 150.0, -300.0}) {
    prior = cap(Vec3(0, 0, dz));
    matcher.set_prior({}, &prior, nullptr, {});
    result = pair.push(matcher);
    EXPECT_EQ(result->point_count, 0) << dz;
    EXPECT_EQ(result->status, Status::kNotFound) << dz;
  }
}

TEST(Live, FollowsMotionStepByStep) {
  const Pair still;
  std::vector<Pair> frames;
  for (const double rise : {5.0, 10.0}) {
    Pair pair = still;
    for (Camera& c : pair.rig.cameras) c.camera_from_room.t += c.camera_from_room.R * Vec3(0, 0, rise);
    const Texture texture(4.5);
    pair.left = render(pair.rig.cameras[0], kSphere, texture, 200, 10, 1, 1);
    pair.right = render(pair.rig.cameras[1], kSphere, texture, 200, 10, 1, 2);
    frames.push_back(std::move(pair));
  }
  StereoMatcher matcher = still.matcher();
  PriorOptions options;
  options.band = 7;
  const Surface prior = cap(Vec3::Zero());
  for (const bool follow : {true, false}) {
    options.follow = follow;
    matcher.set_prior({}, &prior, nullptr, options);
    EXPECT_GT(frames[0].push(matcher)->point_count, 1000);
    EXPECT_EQ(frames[1].push(matcher)->point_count > 1000, follow);
  }
}

TEST(Live, RefusesWhatCannotBeAPrior) {
  const Pair pair;
  StereoMatcher matcher = pair.matcher();
  const Surface aside = cap(Vec3(2000, 0, 0)), good = cap(Vec3::Zero());
  const Roi empty = roi_from_box(Vec3(500, 500, 0), Vec3(501, 501, 1));
  PriorOptions wide;
  wide.band = 0;
  const auto status = [&](const Surface& prior, const Roi* roi, const PriorOptions& options) {
    try {
      matcher.set_prior({}, &prior, roi, options);
    } catch (const Error& e) {
      return e.status();
    }
    return Status::kOk;
  };
  EXPECT_EQ(status(aside, nullptr, {}), Status::kInsufficientData);
  EXPECT_EQ(status(good, &empty, {}), Status::kInsufficientData);
  EXPECT_EQ(status(good, nullptr, wide), Status::kInvalidArgument);
  EXPECT_GT(pair.push(matcher)->point_count, 1500);  // as before
}

TEST(Live, ACancelledPriorLeavesTheSessionAsItWas) {
  Pair pair;
  for (const Camera& camera : pair.rig.cameras) pair.rig.uncertainty.parameters.push_back(camera.id + ".fx");
  ASSERT_EQ(parameter_names(pair.rig.cameras[0])[0], pair.rig.uncertainty.parameters[0]);
  pair.rig.uncertainty.modes = Eigen::Matrix2d::Identity();  // a rig with uncertainty has tables to make
  StereoMatcher matcher = pair.matcher();
  const std::int64_t all = pair.push(matcher)->point_count;
  const Surface prior = cap(Vec3::Zero());
  sgrt::Run cancelling;
  cancelling.progress = [](double, const char*) { return true; };
  try {
    matcher.set_prior(cancelling, &prior, nullptr, {});
    ADD_FAILURE() << "expected to be cancelled";
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Status::kCancelled);
  }
  EXPECT_EQ(pair.push(matcher)->point_count, all);
}

TEST(Live, SameBitsAtAnyThreadCountAndInstructionSet) {
  const Pair pair;
  const Surface prior = cap(Vec3(1, 2, 5));
  const auto points = [&](const sgrt::Run& run) {
    StereoMatcher matcher = pair.matcher();
    PriorOptions options;
    options.follow = true;
    matcher.set_prior(run, &prior, nullptr, options);
    pair.push(matcher, run);
    return pair.push(matcher, run)->surface->points;
  };
  const Points one = points({});
  const auto same = [&](const Points& other) {
    return one.rows() == other.rows() &&
           std::memcmp(one.data(), other.data(), static_cast<std::size_t>(one.size()) * sizeof(double)) == 0;
  };
  for (const int threads : {2, 3, 4, 8}) {
    ThreadPool pool(threads);
    sgrt::Run run;
    run.pool = &pool;
    EXPECT_TRUE(same(points(run))) << threads << " threads";
  }
  sgrt::Run avx2;
  avx2.isa = detect_isa();
  EXPECT_TRUE(same(points(avx2)));
}

}  // namespace
}  // namespace sgrt
