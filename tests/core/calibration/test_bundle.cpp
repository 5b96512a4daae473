// The bundle: its Jacobians against finite differences, and the lens derivatives.
#include <gtest/gtest.h>

#include "../rig/lenses.hpp"
#include "calibration/bundle.hpp"
#include "rig/parameters.hpp"
#include "rig/uncertainty.hpp"
#include "rigs.hpp"

using namespace sgrt;
using namespace sgrt::test;

// REQ-CALIB-006
TEST(Parameters, DerivativesOfTheLensAgreeWithDifferences) {
  for (const Camera& lens_camera : real_lenses()) {
    const Camera camera = make_camera(lens_camera);
    for (const Vec3& x : {Vec3(100, 50, 900), Vec3(-180, 120, 1000), Vec3(20, -150, 800)}) {
      Vec2 pixel, ahead, behind;
      Mat23 by_point;
      LensJacobian by_lens;
      ASSERT_TRUE(project_with_lens(camera, x, pixel, by_point, by_lens));
      EXPECT_LT((pixel - project_camera(camera, x)).norm(), 1e-9);
      for (int i = 0; i < lens_count(camera); ++i) {
        const double h = i < 4 ? 1e-3 : 1e-6;
        Camera moved = camera;
        LensVector lens = lens_of(camera);
        lens(i) += h;
        set_lens(lens, moved);
        ASSERT_TRUE(project_with_lens(moved, x, ahead));
        lens(i) -= 2 * h;
        set_lens(lens, moved);
        ASSERT_TRUE(project_with_lens(moved, x, behind));
        EXPECT_LT(((ahead - behind) / (2 * h) - by_lens.col(i)).norm(), 1e-6 * (1 + by_lens.col(i).norm()))
            << camera.id << " " << i;
      }
      Mat23 expected;
      project_camera(camera, x, &expected);
      EXPECT_LT((by_point - expected).norm(), 1e-9 * expected.norm());
    }
  }
}

TEST(Parameters, NothingBehindTheCamera) {
  Vec2 pixel;
  EXPECT_FALSE(project_with_lens(real_lenses()[1], Vec3(1, 1, -5), pixel));
  EXPECT_FALSE(project_with_lens(real_lenses()[1], Vec3(1, 1, 0), pixel));
}

// The information matrix is J^T J with placements eliminated: against a Jacobian by differences of all unknowns.
// REQ-CALIB-006
TEST(Bundle, InformationAgreesWithDifferences) {
  std::vector<Camera> cameras = two_pods();
  cameras.resize(2);
  SeenOptions o;
  o.boards = 4;
  o.columns = 4;
  o.rows = 3;
  o.square = 80;
  const Seen seen = see(cameras, o, 3);
  Bundle bundle;
  bundle.target = make_target(seen.data.points);
  bundle.priors.resize(2);
  bundle.warp_sigma = 1;
  bundle.noise = 0.5;
  Scene scene;
  for (std::size_t c = 0; c < 2; ++c) scene.cameras.push_back(relative_to_first(cameras, c));
  for (const Pose& p : seen.room_from_board) scene.room_from_target.push_back(cameras[0].camera_from_room * p);
  scene.warp = Vec3(0.3, -0.2, 0.1);
  for (int c = 0; c < 2; ++c) {
    for (int b = 0; b < 4; ++b) bundle.views.push_back({c, b, {}, {}, {}, {}});
  }
  for (const Sight& s : seen.data.sights) {
    View& v = bundle.views[4 * s.camera + s.placement];
    v.index.push_back(s.point);
    v.pixel.push_back(s.pixel);
    v.sigma.push_back(1 + 0.1 * s.point);
    v.weight.push_back(s.point % 5 == 0 ? 0.5 : 1);
  }
  const Layout layout = layout_of(bundle, scene);
  const auto residual = [&](const Eigen::VectorXd& step) {
    Scene moved = scene;
    for (int c = 0; c < 2; ++c) {
      LensVector lens = lens_of(moved.cameras[c]);
      for (int i = 0; i < 9; ++i) lens(i) += step(layout.lens[c][i]);
      set_lens(lens, moved.cameras[c]);
      if (c == 1)
        moved.cameras[1].camera_from_room =
            se3_exp(step.segment<6>(layout.pose[1])) * moved.cameras[1].camera_from_room;
    }
    moved.warp += step.segment<3>(layout.warp);
    for (int b = 0; b < 4; ++b)
      moved.room_from_target[b] = se3_exp(step.segment<6>(layout.size + 6 * b)) * moved.room_from_target[b];
    std::vector<double> all;
    for (const View& v : bundle.views) {
      const auto r = residuals_of(bundle, moved, v);
      for (std::size_t i = 0; i < r.size(); ++i) {
        for (int k = 0; k < 2; ++k) all.push_back(r[i](k) * std::sqrt(v.weight[i]) / v.sigma[i] / bundle.noise);
      }
    }
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size())));
  };
  const int n = layout.size + 24;
  ASSERT_EQ(layout.size, 9 + 9 + 6 + 3);
  Eigen::MatrixXd J(residual(Eigen::VectorXd::Zero(n)).size(), n);
  for (int i = 0; i < n; ++i) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    const double h = 1e-5;
    step(i) = h;
    J.col(i) = (residual(step) - residual(-step)) / (2 * h);
  }
  const Eigen::MatrixXd H = J.transpose() * J;
  const int m = layout.size;
  const Eigen::MatrixXd expected =
      H.topLeftCorner(m, m) -
      H.topRightCorner(m, 24) * H.bottomRightCorner(24, 24).ldlt().solve(H.bottomLeftCorner(24, m));
  const Eigen::MatrixXd got = information_of(bundle, scene, false);
  const Eigen::VectorXd d = expected.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((d.asDiagonal() * (got - expected) * d.asDiagonal()).cwiseAbs().maxCoeff(), 2e-3);
}

TEST(Uncertainty, ModesCarryTheCovarianceToPixelsAndPoints) {
  const std::vector<Camera> cameras = two_pods();
  Rig rig;
  rig.id = rig.room = "test";
  rig.cameras = cameras;
  rig.pairs = {{"pod1", 0, 1}};
  Draw draw(4);
  const Eigen::Index n = 4 * 15;
  Eigen::VectorXd sigma(n);
  for (Eigen::Index i = 0; i < n; ++i) sigma(i) = i % 15 < 4 ? 0.3 : i % 15 < 9 ? 1e-3 : i % 15 < 12 ? 1e-5 : 0.02;
  Eigen::MatrixXd A(n, n);
  for (Eigen::Index i = 0; i < n * n; ++i) A(i) = draw.uniform();
  const Eigen::MatrixXd C = sigma.asDiagonal() * (A * A.transpose() / n) * sigma.asDiagonal();
  rig.uncertainty = compact(cameras, C, {1500, 2000, 2500}, 0.05);
  EXPECT_LE(rig.uncertainty.modes.cols(), n);
  const Vec3 x(30, -40, 50);
  // By differences of the parameters, one mode after the other.
  const Mat2X modes = pixel_modes(rig, 1, x);
  const Mat3X points = point_modes(rig, rig.pairs[0], x);
  const auto moved = [&](const Camera& camera, int c, Eigen::Index mode, double h) {
    Camera out = camera;
    const Eigen::VectorXd step = h * rig.uncertainty.modes.col(mode).segment(15 * c, 15);
    LensVector lens = lens_of(camera);
    lens.head<9>() += step.head<9>();
    set_lens(lens, out);
    out.camera_from_room = se3_exp(step.tail<6>()) * out.camera_from_room;
    return out;
  };
  for (Eigen::Index k = 0; k < modes.cols(); ++k) {
    Vec2 a, b;
    const Camera ahead = moved(cameras[1], 1, k, 1e-3), behind = moved(cameras[1], 1, k, -1e-3);
    ASSERT_TRUE(project_with_lens(ahead, ahead.camera_from_room * x, a) &&
                project_with_lens(behind, behind.camera_from_room * x, b));
    EXPECT_LT(((a - b) / 2e-3 - modes.col(k)).norm(), 1e-4 * (1 + modes.col(k).norm()));
    // The point where the moved cameras see the pixels of x: their projection of it is the pixel again, to first order.
    const Camera left = moved(cameras[0], 0, k, 1e-4), right = moved(cameras[1], 1, k, 1e-4);
    const Vec3 y = x + 1e-4 * points.col(k);
    Eigen::Vector4d off;
    Vec2 l, r;
    ASSERT_TRUE(project_with_lens(left, left.camera_from_room * y, l) &&
                project_with_lens(right, right.camera_from_room * y, r));
    off << l - project(cameras[0], x), r - project(cameras[1], x);
    Eigen::Matrix<double, 4, 3> J;
    Mat23 jl, jr;
    project(cameras[0], x, &jl);
    project(cameras[1], x, &jr);
    J << jl, jr;
    EXPECT_LT((J.transpose() * off).norm(), 1e-3 * J.norm() * 1e-4 * (1 + points.col(k).norm()));
  }
  // What the compact form leaves out does not show in a pixel.
  Vec2 pixel;
  Mat23 by_point;
  LensJacobian by_lens;
  const Vec3 in_camera = cameras[1].camera_from_room * x;
  ASSERT_TRUE(project_with_lens(cameras[1], in_camera, pixel, by_point, by_lens));
  Eigen::Matrix<double, 2, 15> J;
  J << by_lens.leftCols<9>(), -by_point * skew(in_camera), by_point;
  const Eigen::Matrix2d expected = J * C.block<15, 15>(15, 15) * J.transpose(), got = modes * modes.transpose();
  EXPECT_LT((got - expected).norm(), 1e-3 * expected.norm());
}
