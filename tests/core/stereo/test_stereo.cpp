// The whole of stereo on scenes known in closed form: accuracy, honest sigma, reasons, determinism.
#include "stereo/stereo.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "core/parallel.hpp"
#include "stereo/scene.hpp"

namespace sgrt {
namespace {

using namespace testing;

struct Capture {
  std::vector<float> left, right;
};

Capture capture(const Rig& rig, const Scene& scene, double noise, unsigned seed, double right_gain = 170,
                double right_offset = 20) {
  const Texture texture(4.5);
  return {render(rig.cameras[0], scene, texture, 200, 10, noise, seed),
          render(rig.cameras[1], scene, texture, right_gain, right_offset, noise * right_gain / 200, seed + 1)};
}

std::shared_ptr<StereoResult> run_stereo(const Rig& rig, const Capture& c, const StereoOptions& options = {},
                                         const Run& run = {}) {
  StereoMatcher matcher(run, rig, rig.pairs[0], options);
  return matcher.match(run, view_of(c.left, rig.cameras[0]), view_of(c.right, rig.cameras[1]));
}

struct Errors {
  double mean = 0, rms = 0, chi2 = 0, normal_deg = 0, worst = 0;
  std::int64_t count = 0;
};

Errors errors_of(const StereoResult& result, const Scene& scene) {
  Errors e;
  const Surface& s = *result.surface;
  for (std::int64_t k = 0; k < s.size(); ++k) {
    if (!s.present(k)) continue;
    const double d = scene.distance(s.point(k));
    e.mean += d, e.rms += d * d, e.chi2 += d * d / (s.sigma(k) * s.sigma(k));
    e.worst = std::max(e.worst, std::abs(d));
    e.normal_deg += std::acos(std::min(1.0, s.normal(k).dot(scene.normal_at(s.point(k))))) * 180 / M_PI;
    ++e.count;
  }
  const double n = static_cast<double>(e.count);
  e.mean /= n, e.rms = std::sqrt(e.rms / n), e.chi2 /= n, e.normal_deg /= n;
  return e;
}

// REQ-STEREO-001
TEST(Stereo, PlaneWithoutNoiseIsFoundToMicrons) {
  const Rig rig = small_rig();
  const Scene plane{0, 0.3};
  const auto result = run_stereo(rig, capture(rig, plane, 0, 1));
  ASSERT_EQ(result->status, Status::kOk);
  const Errors e = errors_of(*result, plane);
  EXPECT_GT(e.count, 3000);
  // 0.01 px is 0.065 mm here.
  EXPECT_LT(e.rms, 0.02);
  EXPECT_LT(std::abs(e.mean), 0.005);
  EXPECT_LT(e.normal_deg, 0.5);
}

TEST(Stereo, SphereAndUnlikeGainWithNoise) {
  const Rig rig = small_rig();
  const Scene sphere{150, 0};
  const auto result = run_stereo(rig, capture(rig, sphere, 1.5, 2, 120, 60));
  const Errors e = errors_of(*result, sphere);
  EXPECT_GT(e.count, 2500);
  EXPECT_LT(std::abs(e.mean), 0.03);
  EXPECT_LT(e.rms, 0.15);
  EXPECT_LT(e.worst, 1.0);
}

// The predicted sigma is the sampled one: chi^2 a point is 1 over many noise draws.
// REQ-STEREO-002
TEST(Stereo, SigmaIsHonest) {
  const Rig rig = small_rig();
  const Scene plane{0, 0.1};
  const Capture clean = capture(rig, plane, 0, 1);
  for (const double noise : {1.0, 4.0}) {
    double chi2 = 0, n = 0;
    for (unsigned trial = 0; trial < 4; ++trial) {
      Capture c = clean;
      std::mt19937 random(trial + 10);
      std::normal_distribution<float> normal(0, static_cast<float>(noise));
      for (float& g : c.left) g += normal(random);
      for (float& g : c.right) g += normal(random);
      const Errors e = errors_of(*run_stereo(rig, c), plane);
      chi2 += e.chi2 * static_cast<double>(e.count), n += static_cast<double>(e.count);
    }
    EXPECT_GT(chi2 / n, 0.8) << "noise " << noise;
    EXPECT_LT(chi2 / n, 1.25) << "noise " << noise;
  }
}

// REQ-DET-004
TEST(Stereo, SameBitsAtAnyThreadCountAndInstructionSet) {
  const Rig rig = small_rig();
  const Capture c = capture(rig, Scene{150, 0}, 2, 3);
  const auto one = run_stereo(rig, c);
  const auto equal = [&](const StereoResult& other) {
    return one->reason == other.reason && one->right_px.size() == other.right_px.size() &&
           std::memcmp(one->right_px.data(), other.right_px.data(), one->right_px.size() * sizeof(double)) == 0 &&
           std::memcmp(one->surface->points.data(), other.surface->points.data(),
                       static_cast<std::size_t>(one->surface->points.size()) * sizeof(double)) == 0;
  };
  for (const int threads : {2, 3, 4, 8}) {
    ThreadPool pool(threads);
    sgrt::Run run;
    run.pool = &pool;
    EXPECT_TRUE(equal(*run_stereo(rig, c, {}, run))) << threads << " threads";
  }
  if (detect_isa() == Isa::kAvx2) {
    sgrt::Run run;
    run.isa = Isa::kAvx2;
    EXPECT_TRUE(equal(*run_stereo(rig, c, {}, run))) << "AVX2";
  }
}

// REQ-STEREO-003
TEST(Stereo, EveryGridPointHasAReasonAndTheySum) {
  const Rig rig = small_rig();
  const auto result = run_stereo(rig, capture(rig, Scene{60, 0}, 1, 4));
  std::int64_t sum = 0;
  for (const std::int64_t n : result->reason_count) sum += n;
  EXPECT_EQ(sum, static_cast<std::int64_t>(result->width) * result->height);
  EXPECT_EQ(result->reason_count[0], result->point_count);
  for (std::size_t k = 0; k < result->reason.size(); ++k) {
    EXPECT_EQ(result->reason[k] == 0, result->surface->present(static_cast<std::int64_t>(k)));
    EXPECT_EQ(result->reason[k] == 0, std::isfinite(result->right_px[2 * k]));
  }
  // The empty background has no texture.
  EXPECT_GT(result->reason_count[static_cast<int>(Reason::kNoTexture)], 500);
}

// A plate before a wall: left of it a strip of the wall that the right camera does not see.
TEST(Stereo, WhatStandsBehindIsOccluded) {
  Rig rig = small_rig();
  const Texture texture(4.5), behind(5.5, 7);
  const auto image = [&](const Camera& camera) {
    std::vector<float> pixels;
    pixels.reserve(static_cast<std::size_t>(camera.width) * camera.height);
    const Vec3 c = camera.centre_in_room();
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Vec3 ray = unproject(camera, Vec2(x, y));
        const Vec3 near = c + ray * ((80 - c.z()) / ray.z()), far = c + ray * ((-120 - c.z()) / ray.z());
        const bool plate = std::abs(near.x()) < 50 && std::abs(near.y()) < 50;
        pixels.push_back(static_cast<float>(200 * (plate ? texture(near) : behind(far))));
      }
    return pixels;
  };
  const Capture c{image(rig.cameras[0]), image(rig.cameras[1])};
  const auto result = run_stereo(rig, c);
  std::int64_t hidden = 0, told = 0, wrong = 0;
  for (std::size_t k = 0; k < result->reason.size(); ++k) {
    const Vec2 left(result->left_px[2 * k], result->left_px[2 * k + 1]);
    if (!(left.array() > 30).all() || left.x() > 290 || left.y() > 210) continue;
    const Vec3 centre = rig.cameras[0].centre_in_room(), ray = unproject(rig.cameras[0], left);
    const Vec3 near = centre + ray * ((80 - centre.z()) / ray.z()), x = centre + ray * ((-120 - centre.z()) / ray.z());
    const Vec3 from = rig.cameras[1].centre_in_room();
    const Vec3 crossing = from + (x - from) * ((80 - from.z()) / (x.z() - from.z()));
    const bool plate = std::abs(near.x()) < 50 && std::abs(near.y()) < 50;
    const bool covered = !plate && std::abs(crossing.x()) < 48 && std::abs(crossing.y()) < 48;
    hidden += covered, told += covered && result->reason[k] == static_cast<int>(Reason::kOccluded);
    wrong += covered && result->reason[k] == 0 && result->surface->points(static_cast<std::int64_t>(k), 2) < 60;
  }
  EXPECT_GT(hidden, 150);
  EXPECT_GT(told, hidden / 3);
  EXPECT_LT(wrong, hidden / 10);
}

// REQ-STEREO-004
TEST(Stereo, BlankUnrelatedAndSaturatedImagesGiveNoPoint) {
  const Rig rig = small_rig();
  const std::size_t n = static_cast<std::size_t>(320) * 240;
  const Capture blank{std::vector<float>(n, 40), std::vector<float>(n, 40)};
  EXPECT_EQ(run_stereo(rig, blank)->status, Status::kNotFound);
  Capture unrelated;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> grey(0, 255);
  for (auto* image : {&unrelated.left, &unrelated.right})
    for (std::size_t i = 0; i < n; ++i) image->push_back(grey(random));
  EXPECT_EQ(run_stereo(rig, unrelated)->status, Status::kNotFound);
  // 8 bit images of which all is clipped.
  const std::vector<std::uint8_t> white(n, 255);
  ImageView view;
  view.data = white.data(), view.type = ImageView::Type::kU8;
  view.height = 240, view.width = 320, view.row_stride = 320, view.column_stride = 1;
  StereoMatcher matcher({}, rig, rig.pairs[0], {});
  const auto result = matcher.match({}, view, view);
  EXPECT_EQ(result->status, Status::kNotFound);
  EXPECT_GT(result->reason_count[static_cast<int>(Reason::kSaturated)], 2000);
}

// A texture beside a blank wall, without noise: ZNCC knows no scale, so the last bits of the wall must not count.
TEST(Stereo, ABlankWallBesideATextureGivesNothing) {
  const Rig rig = small_rig();
  const Scene sphere{60, 0};
  const Capture c = capture(rig, sphere, 0, 1);
  std::vector<std::uint8_t> grey[2];
  for (const float g : c.left) grey[0].push_back(static_cast<std::uint8_t>(std::lround(std::clamp(g, 0.F, 254.F))));
  for (const float g : c.right) grey[1].push_back(static_cast<std::uint8_t>(std::lround(std::clamp(g, 0.F, 254.F))));
  ImageView view[2];
  for (int i = 0; i < 2; ++i) {
    view[i].data = grey[i].data(), view[i].type = ImageView::Type::kU8;
    view[i].height = 240, view[i].width = 320, view[i].row_stride = 320, view[i].column_stride = 1;
  }
  StereoMatcher matcher({}, rig, rig.pairs[0], {});
  const Errors e = errors_of(*matcher.match({}, view[0], view[1]), sphere);
  EXPECT_GT(e.count, 300);
  EXPECT_LT(e.worst, 1.5);  // 0.25 px, at the rim
}

TEST(Stereo, VolumeBoundsTheSurface) {
  const Rig rig = small_rig();
  const Scene plane{0, 0.3};
  const Capture c = capture(rig, plane, 0.5, 6);
  StereoOptions options;
  options.volume_min = Vec3(-50, -40, -10), options.volume_max = Vec3(60, 40, 10);
  const auto result = run_stereo(rig, c, options);
  ASSERT_EQ(result->status, Status::kOk);
  for (std::int64_t k = 0; k < result->surface->size(); ++k) {
    if (!result->surface->present(k)) continue;
    EXPECT_LE(std::abs(result->surface->points(k, 2)), 10);
  }
  EXPECT_LT(errors_of(*result, plane).rms, 0.1);
  EXPECT_GT(result->reason_count[static_cast<int>(Reason::kOutOfVolume)], 0);
  options.volume_min = Vec3(-50, -40, 200), options.volume_max = Vec3(50, 40, 300);
  EXPECT_EQ(run_stereo(rig, c, options)->status, Status::kNotFound);
}

TEST(Stereo, PixelsProjectTheirPoint) {
  const Rig rig = small_rig();
  const auto result = run_stereo(rig, capture(rig, Scene{150, 0}, 1, 7));
  for (std::int64_t k = 0; k < result->surface->size(); k += 7) {
    if (!result->surface->present(k)) continue;
    const Vec3 x = result->surface->point(k);
    EXPECT_LT((project(rig.cameras[0], x) - Vec2(result->left_px[2 * k], result->left_px[2 * k + 1])).norm(), 1e-4);
    EXPECT_LT((project(rig.cameras[1], x) - Vec2(result->right_px[2 * k], result->right_px[2 * k + 1])).norm(), 1e-4);
  }
}

TEST(Stereo, RefusesWhatIsNotAPair) {
  Rig rig = small_rig();
  const auto message = [&](const StereoOptions& o) {
    try {
      StereoMatcher matcher({}, rig, rig.pairs[0], o);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  StereoOptions o;
  o.window = 16;
  EXPECT_NE(message(o).find("window_px: 16"), std::string::npos);
  // One camera in front of the other.
  rig.cameras[1].camera_from_room = rig.cameras[0].camera_from_room;
  rig.cameras[1].camera_from_room.t.z() -= 100;
  EXPECT_NE(message({}).find("along their baseline"), std::string::npos);
  rig.cameras[1].camera_from_room = rig.cameras[0].camera_from_room;
  EXPECT_NE(message({}).find("one place"), std::string::npos);
}

TEST(Stereo, SecondFrameReusesItsBuffersButNotALentSurface) {
  const Rig rig = small_rig();
  const Capture a = capture(rig, Scene{150, 0}, 1, 8), b = capture(rig, Scene{0, 0.2}, 1, 9);
  StereoMatcher matcher({}, rig, rig.pairs[0], {});
  const auto held = matcher.match({}, view_of(a.left, rig.cameras[0]), view_of(a.right, rig.cameras[1]))->surface;
  const Points before = held->points;
  const auto second = matcher.match({}, view_of(b.left, rig.cameras[0]), view_of(b.right, rig.cameras[1]));
  EXPECT_EQ(std::memcmp(before.data(), held->points.data(), static_cast<std::size_t>(before.size()) * sizeof(double)),
            0);
  EXPECT_NE(second->surface.get(), held.get());
}

}  // namespace
}  // namespace sgrt
