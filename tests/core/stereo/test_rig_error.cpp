// The rig's uncertainty in its surfaces: calibrations drawn anew move the points as the modes say.
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "rig/uncertainty.hpp"
#include "stereo/scene.hpp"
#include "stereo/stereo.hpp"
#include "surface/fuse.hpp"

namespace sgrt {
namespace {

using namespace testing;

// Every parameter of both cameras is uncertain on its own: 30 modes, of which a surface carries 8.
Rig uncertain_rig() {
  Rig rig = small_rig();
  const double sigma[] = {0.3, 0.3, 0.4, 0.4, 1e-3, 3e-3, 2e-5, 2e-5, 3e-3, 2e-4, 2e-4, 1e-4, 0.05, 0.05, 0.05};
  for (const Camera& camera : rig.cameras)
    for (const std::string& name : parameter_names(camera)) rig.uncertainty.parameters.push_back(name);
  Eigen::VectorXd s(30);
  for (int i = 0; i < 30; ++i) s[i] = sigma[i % 15];
  rig.uncertainty.modes = s.asDiagonal();
  return rig;
}

Rig drawn(const Rig& rig, const Eigen::VectorXd& xi) {
  Rig out = rig;
  Eigen::Index at = 0;
  for (Camera& camera : out.cameras) {
    const Eigen::Index n = lens_count(camera);
    const Eigen::VectorXd off = (rig.uncertainty.modes * xi).segment(at, n + 6);
    LensVector lens = lens_of(camera);
    lens.head(n) += off.head(n);
    set_lens(lens, camera);
    camera.camera_from_room = se3_exp(off.tail<6>()) * camera.camera_from_room;
    camera = make_camera(camera);
    at += n + 6;
  }
  return out;
}

// Where the ray of the left pixel meets the plane of the right one's ray and the rectified columns, as stereo has it.
Vec3 triangulated(const Rig& rig, const Vec2& left, const Vec2& right) {
  const Camera &l = rig.cameras[0], &r = rig.cameras[1];
  const Vec3 base = r.centre_in_room() - l.centre_in_room(), ray = unproject(l, left);
  const Vec3 view = l.camera_from_room.R.row(2) + r.camera_from_room.R.row(2);
  const Vec3 normal = unproject(r, right).cross(view.cross(base));
  return l.centre_in_room() + ray * (base.dot(normal) / ray.dot(normal));
}

struct Matched {
  Rig rig = uncertain_rig();
  std::shared_ptr<StereoResult> sure, result;
  Matched() {
    const Texture texture(4.5);
    const Scene sphere{150, 0};
    const auto left = render(rig.cameras[0], sphere, texture, 200, 10, 1, 1);
    const auto right = render(rig.cameras[1], sphere, texture, 200, 10, 1, 2);
    const auto match = [&](const Rig& r) {
      return StereoMatcher({}, r, r.pairs[0], {}).match({}, view_of(left, r.cameras[0]), view_of(right, r.cameras[1]));
    };
    sure = match(small_rig()), result = match(rig);
  }
  // How far the drawn calibration puts point k along its normal.
  double moved(const Rig& draw, std::int64_t k) const {
    const std::vector<double>&l = result->left_px, &r = result->right_px;
    const Vec3 x = result->surface->point(k);
    const Vec3 y = triangulated(draw, Vec2(l[2 * k], l[2 * k + 1]), Vec2(r[2 * k], r[2 * k + 1]));
    return (y - x).dot(result->surface->normal(k));
  }
};

TEST(RigError, NoModesInTheRigChangeNothing) {
  const Matched m;
  EXPECT_TRUE(m.sure->surface->modes.empty());
  EXPECT_TRUE(m.sure->surface->mode_names.empty());
  EXPECT_EQ(m.sure->reason, m.result->reason);
  EXPECT_EQ(m.sure->right_px.size(), m.result->right_px.size());
}

TEST(RigError, ModesMovePointsAsTheCalibrationThatTheyStandFor) {
  const Matched m;
  const Surface& s = *m.result->surface;
  ASSERT_EQ(s.modes.size(), 8U);
  const SharedModes shared = shared_modes(m.rig);
  for (int mode = 0; mode < 8; ++mode) {
    const Rig draw = drawn(m.rig, shared.kept.col(mode));
    for (std::int64_t k = 0; k < s.size(); k += 41) {
      if (!s.present(k)) continue;
      const double predicted = s.modes[mode].row(k).dot(s.normals.row(k));
      EXPECT_NEAR(m.moved(draw, k), predicted, 0.02 * std::abs(predicted) + 0.004) << "mode " << mode << " point " << k;
    }
  }
}

// REQ-STEREO-009
TEST(RigError, CalibrationsDrawnAnewScatterAsModesAndCovarianceSay) {
  const Matched m;
  const Surface &s = *m.result->surface, &sure = *m.sure->surface;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Eigen::VectorXd sampled = Eigen::VectorXd::Zero(s.size());
  constexpr int kDraws = 80;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::VectorXd xi(m.rig.uncertainty.modes.cols());
    for (double& x : xi) x = normal(random);
    const Rig draw = drawn(m.rig, xi);
    for (std::int64_t k = 0; k < s.size(); k += 41)
      if (s.present(k)) sampled[k] += std::pow(m.moved(draw, k), 2) / kDraws;
  }
  double ratio = 0, rest_share = 0, n = 0;
  for (std::int64_t k = 0; k < s.size(); k += 41) {
    if (!s.present(k)) continue;
    const Vec3 normal_at = s.normal(k);
    const double rest = s.variance_along(k, normal_at) - sure.variance_along(k, normal_at);
    EXPECT_NEAR(s.sigma(k) * s.sigma(k) - sure.sigma(k) * sure.sigma(k), rest, 1e-9);
    EXPECT_GE(rest, 0);
    double carried = 0;
    for (const Points& mode : s.modes) carried += std::pow(mode.row(k).dot(normal_at), 2);
    ratio += sampled[k] / (carried + rest), rest_share += rest / (carried + rest), n += 1;
  }
  EXPECT_NEAR(ratio / n, 1, 0.2);  // 80 draws of few causes
  EXPECT_LT(rest_share / n, 0.1);  // eight carry nearly all
  EXPECT_GT(rest_share, 0);
}

TEST(RigError, NamesStandForOneCalibration) {
  const Rig rig = uncertain_rig();
  Rig other = rig;
  EXPECT_EQ(shared_modes(rig).names, shared_modes(other).names);
  EXPECT_EQ(shared_modes(rig).names[0].rfind("test ", 0), 0U);
  other.uncertainty.modes(3, 3) *= 1.01;
  EXPECT_NE(shared_modes(rig).names[0], shared_modes(other).names[0]);
  EXPECT_TRUE(shared_modes(small_rig()).names.empty());
  const SharedModes shared = shared_modes(rig);
  Eigen::MatrixXd V(30, 30);
  V << shared.kept, shared.rest;
  EXPECT_LT((V.transpose() * V - Eigen::MatrixXd::Identity(30, 30)).norm(), 1e-12);
}

TEST(RigError, FusionOfTwoPodsKeepsTheModes) {
  const Matched m;
  const Surface& s = *m.result->surface;
  const Fusion fusion = fuse({}, {&s, &s}, {});
  ASSERT_EQ(fusion.surface.modes.size(), 8U);
  EXPECT_EQ(fusion.surface.mode_names, s.mode_names);
  // One cause moves both alike: the mean does not lessen it.
  std::int64_t row = 0;
  for (std::int64_t k = 0; k < s.size(); ++k) {
    if (!s.present(k)) continue;
    EXPECT_NEAR((fusion.surface.modes[0].row(row) - s.modes[0].row(k)).norm(), 0, 1e-9);
    ++row;
  }
}

}  // namespace
}  // namespace sgrt
