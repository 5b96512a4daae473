// What the rig's stored uncertainty does to every point of a pair, tabulated over the rectified images so that a point
// costs a few products. docs/theory/stereo.md, "The rig's own uncertainty".
#pragma once

#include <string>
#include <vector>

#include "core/run.hpp"
#include "rig/uncertainty.hpp"
#include "stereo/rectify.hpp"

namespace sgrt {

// How far the modes move what a camera shows, in normalised rectified coordinates, at nodes every kErrorCell pixels: by
// A + B / z exactly, A of lens and rotation, B of translation. A node holds A of every mode, then B; of the left camera
// both coordinates, of the right one x alone.
struct ErrorTable {
  int columns = 0, rows = 0, numbers = 0;
  std::vector<float> nodes;
};
constexpr int kErrorCell = 32;  // px

struct RigError {
  std::vector<std::string> names;  // of the modes that surfaces carry
  int modes = 0;                   // those first, then what they leave out; 0: the rig states no uncertainty
  ErrorTable left, right;
};
// 8 of the rig, and what the 36 parameters of two cameras can make of the others.
constexpr int kMaxErrorModes = 44;

// What of the rig does not change with the part of the view that is used: how its modes move the parameters of the
// pair's two cameras, lens then pose, those that surfaces carry first.
struct PairModes {
  std::vector<std::string> names;
  Eigen::MatrixXd left, right;  // no columns: the rig states no uncertainty
};
PairModes pair_modes(const Rig& rig, const StereoPair& pair);

RigError make_rig_error(const Run& run, const PairModes& modes, const Rectification& rectification);

// The motion of one point by each mode, mm at one sigma, room axes.
class ErrorAt {
 public:
  explicit ErrorAt(const RigError& error);
  // Rectified left pixel, its disparity and depth along the rectified axis.
  void move_to(const Rectification& r, double x, double y, double disparity, double z);
  Vec3 mode(int k) const;
  Mat3 rest() const;  // covariance of the modes that surfaces do not carry

 private:
  using Numbers = Eigen::Array<float, Eigen::Dynamic, 1, 0, 4 * kMaxErrorModes, 1>;  // not on the heap
  const RigError* error_;
  Numbers left_, right_;
  Mat3 by_shift_ = Mat3::Zero();  // d point / d (u left, v left, u right)
  float inverse_z_ = 0;
};

}  // namespace sgrt
