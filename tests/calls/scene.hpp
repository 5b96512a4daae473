// The plain data of the base calls, small enough that each call takes micro- to milliseconds: a lump of skin, a bumpy
// skin, a rig with a stereo pair, a laser and a time-of-flight unit and what they see, a board in many places, a ball
// in a volume.
#pragma once

#include <sgrt.h>

#include <cmath>
#include <string>
#include <vector>

namespace calls {

constexpr double kPi = 3.14159265358979323846;
constexpr int kLumpSide = 24, kBumpSide = 41;
constexpr int kWidth = 128, kHeight = 96;  // of the stereo pair
constexpr int kLaserWidth = 96, kLaserHeight = 72, kReadings = 5;
constexpr int kTofWidth = 24, kTofHeight = 10, kTofPixels = kTofWidth * kTofHeight;
constexpr int kColumns = 5, kRows = 4, kCorners = kColumns * kRows, kBoards = 6;
constexpr int kVoxelSide = 24, kRing = 24, kSlices = 4;
constexpr int kBoardWidth = 96, kBoardHeight = 80;  // of the image of a chessboard

struct Sights {  // as sgrt_calibration_data wants them
  std::vector<std::int32_t> index;
  std::vector<double> pixels;
  std::int64_t count() const { return static_cast<std::int64_t>(index.size() / 3); }
};

struct Scene {
  std::string rig;
  std::vector<double> lump, lump_normals, lump_sigma;  // kLumpSide^2 points
  std::vector<double> bumps, bump_normals;             // kBumpSide^2
  std::vector<std::uint8_t> left, right;
  std::vector<std::uint8_t> stripes;  // kReadings images
  std::vector<double> angles, times;
  std::vector<std::uint16_t> taps;
  std::vector<float> tof_frames[3];  // of a board 800, 1200, 1600 mm away
  std::vector<double> board;         // the corners
  Sights sights, phantom, laser_board;
  std::vector<double> phantom_points;
  std::vector<std::int32_t> stripe_placement;
  std::vector<double> stripe_angle, stripe_pixels, stripe_sigma;
  std::vector<std::int16_t> voxels;
  std::vector<double> contours;
  std::vector<std::uint8_t> chessboard;
};

Scene make_scene();
// What only a rig can tell: the light planes.
void light_scene(Scene& scene, const sgrt_rig* rig);

}  // namespace calls
