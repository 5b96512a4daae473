// Finding boards in rendered images: place, order, blur, light, hidden points, wrong sizes, and no board at all.
#include "calibration/board.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "calibration/bundle.hpp"
#include "rigs.hpp"

using namespace sgrt;
using namespace sgrt::test;

namespace {

struct Look {
  double blur = 0.7, noise = 1, slope = 0;  // px, grey levels, grey levels over the image
  Vec2 hidden = Vec2(-1000, -1000);         // a bright spot of 0.6 squares here, board mm
};

struct Photo {
  std::vector<std::uint8_t> pixels;
  int width, height;
  ImageView view() const { return {pixels.data(), ImageView::Type::kU8, height, width, width, 1}; }
};

// Dark 40, bright 200; the board's own margin is bright, the ground behind it grey.
double shade(const Board& board, const Vec2& p, const Look& look) {
  const double s = board.spacing_mm;
  if ((p - look.hidden).norm() < 0.6 * s) return 250;
  if (board.kind == BoardKind::kCircles) {
    if (p.x() < -2 * s || p.y() < -2 * s || p.x() > (2 * board.columns + 1) * s || p.y() > (board.rows + 1) * s)
      return 110;
    for (int i = 0; i < board.rows; ++i) {
      for (int j = 0; j < board.columns; ++j) {
        if ((p - Vec2((2 * j + i % 2) * s, i * s)).norm() < 0.5 * s) return 40;
      }
    }
    return 200;
  }
  const int i = static_cast<int>(std::floor(p.y() / s)) + 1, j = static_cast<int>(std::floor(p.x() / s)) + 1;
  if (i < -1 || j < -1 || i > board.rows + 1 || j > board.columns + 1) return 110;
  const bool inside = i >= 0 && j >= 0 && i <= board.rows && j <= board.columns;
  return inside && (i + j) % 2 == 0 ? 40 : 200;
}

Photo photograph(const Camera& camera, const Board& board, const Pose& camera_from_board, const Look& look,
                 unsigned seed) {
  constexpr int kFine = 4;
  const Pose back = camera_from_board.inverse();
  const auto value = [&](double x, double y) {
    const Vec3 ray = back.R * undistort(camera, {x, y}).homogeneous();
    const double t = -back.t.z() / ray.z();
    return t > 0 ? shade(board, (back.t + t * ray).head<2>(), look) : 110;
  };
  Photo photo{{}, camera.width, camera.height};
  Draw draw(seed);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;  // the pixel's square and the lens's blur, by a stratified sample of both
      for (int i = 0; i < kFine; ++i) {
        for (int j = 0; j < kFine; ++j) {
          const double u = (j + draw.uniform(0, 1)) / kFine - 0.5, v = (i + draw.uniform(0, 1)) / kFine - 0.5;
          const double a = (draw.uniform() + draw.uniform() + draw.uniform()) *
                           look.blur;  // variance 1: three uniforms of variance 1/3
          const double b = (draw.uniform() + draw.uniform() + draw.uniform()) * look.blur;
          sum += value(x + u + a, y + v + b);
        }
      }
      const double light = 1 + look.slope * (static_cast<double>(x) / camera.width - 0.5);
      const double grey = sum / (kFine * kFine) * light + look.noise * normal_of(draw);
      photo.pixels.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0))));
    }
  }
  return photo;
}

Camera small_camera() {
  Camera c;
  c.id = "small";
  c.width = 400;
  c.height = 300;
  c.fx = c.fy = 420;
  c.cx = 205;
  c.cy = 147;
  c.distortion_count = 5;
  c.distortion = {-0.18, 0.05, 1e-3, -5e-4, 0};
  return make_camera(c);
}

Pose placed(const Board& board, double rx, double ry, double rz, double distance) {
  const Target target = make_target(board_points(board));
  Pose pose{so3_exp(Vec3(rx, ry, rz)), Vec3(5, -4, distance)};
  pose.t -= pose.R * Vec3(target.centre.x(), target.centre.y(), 0);
  return pose;
}

struct Error2 {
  double rms, worst;
};
Error2 error_of(const Detection& d, const Camera& camera, const Board& board, const Pose& pose) {
  const Points points = board_points(board);
  double sum = 0, worst = 0;
  for (std::size_t i = 0; i < d.index.size(); ++i) {
    const double e = (d.pixel[i] - project_camera(camera, pose * Vec3(points.row(d.index[i])))).norm();
    sum += e * e;
    worst = std::max(worst, e);
  }
  return {std::sqrt(sum / static_cast<double>(d.index.size())), worst};
}

const Board kChess{BoardKind::kChessboard, 8, 5, 20};

}  // namespace

TEST(Board, ChessboardsInManyPosesAreFoundInTheBoardsOwnOrder) {
  const Camera camera = small_camera();
  int seed = 0;
  for (double rz : {0.1, 1.6, -2.2}) {
    for (double tilt : {0.0, 0.6}) {
      const Pose pose = placed(kChess, tilt, -0.5 * tilt, rz, 340);
      const Photo photo = photograph(camera, kChess, pose, Look{}, ++seed);
      const Detection d = detect_board(sgrt::Run{}, kChess, photo.view());
      ASSERT_TRUE(d.found) << d.why << " turned by " << rz << ", tilted by " << tilt;
      EXPECT_EQ(d.index.size(), 40U);
      const Error2 e = error_of(d, camera, kChess, pose);
      EXPECT_LT(e.rms, 0.09) << rz << " " << tilt;  // 16 samples a pixel are most of it
      EXPECT_LT(e.worst, 0.35);
    }
  }
}

// REQ-CALIB-005
TEST(Board, BlurSlopingLightAndNoise) {
  const Camera camera = small_camera();
  const Pose pose = placed(kChess, 0.3, 0.3, 0.2, 260);
  Look look;
  look.blur = 2;
  look.noise = 4;
  look.slope = 1.2;
  const Detection d = detect_board(sgrt::Run{}, kChess, photograph(camera, kChess, pose, look, 3).view());
  ASSERT_TRUE(d.found) << d.why;
  EXPECT_LT(error_of(d, camera, kChess, pose).rms, 0.15);
  // The predicted sigma is that of the errors within a factor of two (the rendering adds its own).
  double predicted = 0;
  for (double s : d.sigma_px) predicted += s * s / static_cast<double>(d.sigma_px.size());
  EXPECT_LT(std::sqrt(predicted), 2 * error_of(d, camera, kChess, pose).rms);
  EXPECT_GT(std::sqrt(predicted), 0.25 * error_of(d, camera, kChess, pose).rms);
}

TEST(Board, AHiddenCornerIsLeftOut) {
  const Camera camera = small_camera();
  const Pose pose = placed(kChess, 0.2, -0.3, 0, 260);
  Look look;
  look.hidden = Vec2(60, 40);
  const Detection d = detect_board(sgrt::Run{}, kChess, photograph(camera, kChess, pose, look, 4).view());
  ASSERT_TRUE(d.found) << d.why;
  EXPECT_EQ(std::count(d.index.begin(), d.index.end(), 2 * 8 + 3), 0);
  EXPECT_GE(d.index.size(), 36U);
  EXPECT_LT(error_of(d, camera, kChess, pose).rms, 0.06);
}

TEST(Board, AnotherSizeIsNotTakenForTheBoard) {
  const Camera camera = small_camera();
  const Pose pose = placed(kChess, 0.3, 0.1, 0.1, 270);
  const Photo photo = photograph(camera, kChess, pose, Look{}, 5);
  for (const auto& [columns, rows] :
       {std::pair(7, 5), std::pair(8, 4), std::pair(6, 4), std::pair(9, 5), std::pair(8, 6)}) {
    const Detection d = detect_board(sgrt::Run{}, Board{BoardKind::kChessboard, columns, rows, 20}, photo.view());
    EXPECT_FALSE(d.found) << columns << " x " << rows;
    EXPECT_NE(d.why.find("saw 8 x 5"), std::string::npos) << columns << " x " << rows << ": " << d.why;
  }
}

TEST(Board, CirclesAreFound) {
  const Camera camera = small_camera();
  const Board board{BoardKind::kCircles, 4, 7, 14};
  for (double rz : {0.0, 1.0, -2.5}) {
    const Pose pose = placed(board, 0.4, 0.3, rz, 260);
    const Detection d = detect_board(sgrt::Run{}, board, photograph(camera, board, pose, Look{}, 6).view());
    ASSERT_TRUE(d.found) << d.why;
    EXPECT_EQ(d.index.size(), 28U);
    EXPECT_LT(error_of(d, camera, board, pose).rms, 0.08) << rz;
  }
}

// REQ-CALIB-005
TEST(Board, NoBoardInSpeckleAndInNothing) {
  Photo photo{std::vector<std::uint8_t>(400 * 300), 400, 300};
  Draw draw(1);
  for (auto& p : photo.pixels) p = static_cast<std::uint8_t>(draw.uniform(0, 256));
  for (int pass = 0; pass < 3; ++pass) {  // speckle of about three pixels
    std::vector<std::uint8_t> next = photo.pixels;
    for (std::size_t i = 401; i + 401 < next.size(); ++i)
      next[i] = static_cast<std::uint8_t>((photo.pixels[i] * 2 + photo.pixels[i - 1] + photo.pixels[i + 1] +
                                           photo.pixels[i - 400] + photo.pixels[i + 400]) /
                                          6);
    photo.pixels = next;
  }
  EXPECT_FALSE(detect_board(sgrt::Run{}, kChess, photo.view()).found);
  EXPECT_FALSE(detect_board(sgrt::Run{}, Board{BoardKind::kCircles, 4, 7, 14}, photo.view()).found);
  std::fill(photo.pixels.begin(), photo.pixels.end(), 128);
  EXPECT_FALSE(detect_board(sgrt::Run{}, kChess, photo.view()).found);
  EXPECT_FALSE(detect_board(sgrt::Run{}, Board{BoardKind::kCircles, 4, 7, 14}, photo.view()).found);
  const Photo tiny{std::vector<std::uint8_t>(1, 7), 1, 1};
  EXPECT_FALSE(detect_board(sgrt::Run{}, kChess, tiny.view()).found);
}

TEST(Board, PointsAndNonsense) {
  const Points c = board_points(Board{BoardKind::kCircles, 3, 4, 10});
  EXPECT_EQ(Vec3(c.row(3)), Vec3(10, 10, 0));
  EXPECT_EQ(Vec3(c.row(11)), Vec3(50, 30, 0));
  EXPECT_TRUE(half_turn_ambiguous(Board{BoardKind::kCircles, 3, 4, 10}));
  EXPECT_FALSE(half_turn_ambiguous(kChess));
  expect_error(Status::kInvalidArgument, "board.columns: 2", [] {
    check_board(Board{BoardKind::kChessboard, 2, 5, 1});
  });
  expect_error(Status::kInvalidArgument, "board.rows: 101", [] {
    check_board(Board{BoardKind::kChessboard, 5, 101, 1});
  });
  for (double bad : {0.0, -25.0, std::nan("")})
    expect_error(Status::kInvalidArgument, "board.spacing_mm", [&] {
      check_board(Board{BoardKind::kChessboard, 5, 4, bad});
    });
}
