// The dense step: from one shared warp each window gets the plane that its own refinement would find, whatever the
// warp's shape; the weights of curvature are this window's own.
#include "stereo/dense.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "stereo/waves.hpp"

namespace sgrt {
namespace {

using namespace testing;
using kernels::RowMatch;

double texture(double x, double y) {
  static const PlaneWaves waves(5, 40, 6, 14, 10);
  return waves(x, y);
}

RectifiedImage image_of(const std::function<double(double, double)>& grey) {
  return rectified_image(100, 140, grey);
}

using Disparity = std::function<double(double, double)>;  // of a left pixel

// The right image of a left one that shows `texture`: the left x of a right one by a fixed point.
RectifiedImage right_of(const Disparity& d) {
  return image_of([&](double xr, double y) {
    double x = xr + d(xr, y);
    for (int k = 0; k < 30; ++k) x = xr + d(x, y);
    return 0.7 * texture(x, y) + 20;
  });
}

// Nodes that hold `wrong`, which is near the truth, as planes without slope.
struct Warped {
  Grid nodes;
  MatchField field;
  std::vector<Cell> cells;
  WarpWork work;
  Warped(const RectifiedImage& left, const RectifiedImage& right, const Disparity& wrong) {
    nodes = make_nodes(left.value.width, left.value.height, 21);
    field.matches.resize(nodes.size());
    field.reason.assign(nodes.size(), Reason::kNone);
    for (std::int64_t k = 0; k < nodes.size(); ++k)
      field.matches[k].d = static_cast<float>(wrong(nodes.x(k), nodes.y(k)));
    tear(nodes, field, cells);
    warp({}, left, right, nodes, field, cells, work);
  }
};

std::vector<RowMatch> step(const RectifiedImage& left, const Warped& w, const Grid& grid, const Run& run = {}) {
  std::vector<RowMatch> matches;
  dense_step(run, left, w.work, grid, {21, 0, 1, nullptr}, matches);
  return matches;
}

constexpr Grid kGrid{8, 5, 10, 30};  // within the image by more than a window

TEST(Dense, GivesThePlaneWhateverTheWarpsShape) {
  const RectifiedImage left = image_of(texture);
  const Disparity truth = [](double x, double y) { return 9.3 + 0.06 * (x - 70) - 0.04 * (y - 50); };
  const RectifiedImage right = right_of(truth);
  const Disparity bumpy = [&](double x, double y) { return truth(x, y) + 0.08 * std::sin(x / 6) * std::cos(y / 7); };
  for (const Disparity& start : {truth, bumpy}) {
    const auto matches = step(left, Warped(left, right, start), kGrid);
    for (std::int64_t k = 0; k < kGrid.size(); ++k) {
      ASSERT_EQ(matches[k].outcome, kernels::kConverged);
      EXPECT_NEAR(matches[k].d, truth(kGrid.x(k), kGrid.y(k)), 4e-3);
      EXPECT_NEAR(matches[k].a, 0.06, 1.5e-3);
      EXPECT_NEAR(matches[k].b, -0.04, 1.5e-3);
      EXPECT_GT(matches[k].correlation, 0.98);
    }
  }
}

TEST(Dense, WeightsTakeTheCurvatureOff) {
  const RectifiedImage left = image_of(texture);
  const double c20 = 1.5e-3, c11 = -8e-4, c02 = 1e-3;
  const Disparity truth = [&](double x, double y) {
    const double i = x - 70, j = y - 50;
    return 9.3 + c20 * i * i + c11 * i * j + c02 * j * j;
  };
  const auto matches = step(left, Warped(left, right_of(truth), truth), kGrid);
  for (std::int64_t k = 0; k < kGrid.size(); ++k) {
    const RowMatch& m = matches[k];
    const double d = truth(kGrid.x(k), kGrid.y(k));
    EXPECT_GT(m.d - d, 0.04);  // the plane alone
    EXPECT_NEAR(m.d - m.w20 * c20 - m.w11 * c11 - m.w02 * c02, d, 6e-3);
  }
}

TEST(Dense, BothInstructionSetsGiveTheSameBits) {
  if (detect_isa() != Isa::kAvx2) GTEST_SKIP() << "this machine has no AVX2";
  const RectifiedImage left = image_of(texture);
  const Disparity truth = [](double x, double) { return 9.3 + 0.1 * (x - 70); };
  const Warped w(left, right_of(truth), truth);
  sgrt::Run fast;
  fast.isa = Isa::kAvx2;
  const Grid whole{47, 33, 3, 1};  // rims included
  const auto a = step(left, w, whole), b = step(left, w, whole, fast);
  for (std::int64_t k = 0; k < whole.size(); ++k) {
    EXPECT_EQ(a[k].outcome, b[k].outcome);
    if (a[k].outcome != kernels::kConverged) continue;
    EXPECT_EQ(a[k].d, b[k].d);
    EXPECT_EQ(a[k].noise, b[k].noise);
  }
}

// Nodes that disagree by half a pixel tear their cell; missing ones leave it open.
TEST(Dense, CellsKnowEdgesAndHoles) {
  MatchField field;
  const Grid nodes{6, 4, 7, 3};
  field.matches.resize(nodes.size());
  field.reason.assign(nodes.size(), Reason::kNone);
  for (std::int64_t k = 0; k < nodes.size(); ++k) field.matches[k].d = k % 6 < 3 ? 5.F : 6.F;
  field.reason[0] = Reason::kNoMatch;
  std::vector<Cell> cells;
  tear(nodes, field, cells);
  EXPECT_EQ(cells[0], Cell::kOpen);
  EXPECT_EQ(cells[1], Cell::kSmooth);
  EXPECT_EQ(cells[2], Cell::kTorn);
  EXPECT_EQ(cells[3], Cell::kSmooth);
}

}  // namespace
}  // namespace sgrt
