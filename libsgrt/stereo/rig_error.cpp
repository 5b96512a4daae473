// The rig's uncertainty over the rectified images, see stereo/rig_error.hpp.
#include "stereo/rig_error.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"

namespace sgrt {
namespace {

using Row = Eigen::Map<const Eigen::ArrayXf>;

// d (u, v) rectified by each mode where the camera looks along (u, v, 1): A of lens and rotation, B of translation at
// z = 1. False beside the lens's reach.
bool shifts_at(const Rectification& r, const RectifiedView& view, const Eigen::MatrixXd& modes, double x, double y,
               Mat2X& A, Mat2X& B) {
  const Mat3 camera_from_rectified = view.camera->camera_from_room.R * r.room_from_rectified;
  const Vec3 at = camera_from_rectified * Vec3((x - view.cx) / r.f, (y - view.cy) / r.f, 1);
  Mat2X J;
  if (!project_camera(*view.camera, at).allFinite() || !pixel_by_parameters(*view.camera, at, J)) return false;
  const Eigen::Matrix2d by_pixel = (J.rightCols<3>() * camera_from_rectified.leftCols<2>()).inverse();
  const Eigen::Index n = modes.rows() - 3;
  A = by_pixel * (J.leftCols(n) * modes.topRows(n));
  B = by_pixel * (J.rightCols<3>() * modes.bottomRows<3>());
  return true;
}

// Nodes beside the lens's reach take the nearest in their row, then in their column: points lie near them at most.
void fill_gaps(ErrorTable& t) {
  const auto node = [&t](int i, int j) { return &t.nodes[static_cast<std::size_t>(j * t.columns + i) * t.numbers]; };
  const auto fill = [&](int count, const auto& at) {
    for (int k = 0; k < count; ++k)
      for (int off = 1; off < count && std::isnan(*at(k)); ++off)
        for (const int from : {k - off, k + off})
          if (std::isnan(*at(k)) && from >= 0 && from < count && !std::isnan(*at(from)))
            std::copy_n(at(from), t.numbers, at(k));
  };
  for (int j = 0; j < t.rows; ++j) fill(t.columns, [&](int i) { return node(i, j); });
  for (int i = 0; i < t.columns; ++i) fill(t.rows, [&](int j) { return node(i, j); });
}

ErrorTable tabulate(const Run& run, const Rectification& r, const RectifiedView& view, const Eigen::MatrixXd& modes,
                    int coordinates) {
  ErrorTable t;
  t.columns = view.width / kErrorCell + 2, t.rows = view.height / kErrorCell + 2;
  const auto n = static_cast<int>(modes.cols());
  t.numbers = 2 * coordinates * n;
  t.nodes.assign(static_cast<std::size_t>(t.columns) * t.rows * t.numbers, std::nanf(""));
  parallel_for(
      run, static_cast<std::int64_t>(t.columns) * t.rows, 32,
      [&](std::int64_t begin, std::int64_t end) {
        Mat2X A, B;
        for (std::int64_t k = begin; k < end; ++k) {
          const std::int64_t row = k / t.columns, column = k - row * t.columns;
          const auto x = static_cast<double>(column * kErrorCell), y = static_cast<double>(row * kErrorCell);
          if (!shifts_at(r, view, modes, x, y, A, B)) continue;
          float* out = &t.nodes[static_cast<std::size_t>(k) * t.numbers];
          for (const Mat2X* part : {&A, &B})
            for (int c = 0; c < coordinates; ++c)
              for (int m = 0; m < n; ++m) *out++ = static_cast<float>((*part)(c, m));
        }
      },
      "rectifying");
  fill_gaps(t);
  return t;
}

template <class Numbers>
void interpolate(const ErrorTable& t, double x, double y, Numbers& out) {
  const double u = x / kErrorCell, v = y / kErrorCell;
  const int i = std::clamp(static_cast<int>(u), 0, t.columns - 2), j = std::clamp(static_cast<int>(v), 0, t.rows - 2);
  const auto a = static_cast<float>(u - i), b = static_cast<float>(v - j);
  const float* node = &t.nodes[static_cast<std::size_t>(j * t.columns + i) * t.numbers];
  const std::ptrdiff_t n = t.numbers, below = n * t.columns;
  out = (1 - b) * ((1 - a) * Row(node, n) + a * Row(node + n, n)) +
        b * ((1 - a) * Row(node + below, n) + a * Row(node + below + n, n));
}

}  // namespace

PairModes pair_modes(const Rig& rig, const StereoPair& pair) {
  PairModes modes;
  if (rig.uncertainty.modes.cols() == 0) return modes;
  const SharedModes shared = shared_modes(rig);
  const Eigen::MatrixXd left = camera_modes(rig, rig.cameras[pair.left]);
  const Eigen::MatrixXd right = camera_modes(rig, rig.cameras[pair.right]);
  const Eigen::Index parameters = left.rows() + right.rows();
  Eigen::MatrixXd rest(parameters, shared.rest.cols());
  rest << left * shared.rest, right * shared.rest;
  if (rest.cols() > parameters) {  // R^T = Q T: R R^T = T^T T, with no more columns than parameters
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rest.transpose());
    rest = Eigen::MatrixXd(qr.matrixQR().topRows(parameters).triangularView<Eigen::Upper>()).transpose();
  }
  const Eigen::Index count = shared.kept.cols() + rest.cols();
  modes.names = shared.names;
  modes.left.resize(left.rows(), count), modes.right.resize(right.rows(), count);
  modes.left << left * shared.kept, rest.topRows(left.rows());
  modes.right << right * shared.kept, rest.bottomRows(right.rows());
  return modes;
}

RigError make_rig_error(const Run& run, const PairModes& modes, const Rectification& rectification) {
  RigError error;
  if (modes.left.cols() == 0) return error;
  error.names = modes.names;
  error.modes = static_cast<int>(modes.left.cols());
  error.left = tabulate(run, rectification, rectification.left, modes.left, 2);
  error.right = tabulate(run, rectification, rectification.right, modes.right, 1);
  return error;
}

ErrorAt::ErrorAt(const RigError& error) : error_(&error), left_(error.left.numbers), right_(error.right.numbers) {}

void ErrorAt::move_to(const Rectification& r, double x, double y, double disparity, double z) {
  interpolate(error_->left, x, y, left_);
  interpolate(error_->right, x - disparity, y, right_);
  inverse_z_ = static_cast<float>(1 / z);
  // X = z (u, v, 1), z = B / (u left - u right). The image stays and the camera moves: the ray turns the other way.
  const Vec3 ray((x - r.left.cx) / r.f, (y - r.left.cy) / r.f, 1);
  const Vec3 by_difference = z * z / r.baseline * ray;
  by_shift_ << by_difference, Vec3::Zero(), -by_difference;
  by_shift_(0, 0) -= z, by_shift_(1, 1) -= z;
  by_shift_ = (r.room_from_rectified * by_shift_).eval();
}

Vec3 ErrorAt::mode(int k) const {
  const int n = error_->modes;
  const float u = left_[k] + inverse_z_ * left_[2 * n + k], v = left_[n + k] + inverse_z_ * left_[3 * n + k];
  const float right = right_[k] + inverse_z_ * right_[n + k];
  return by_shift_ * Vec3(u, v, right);
}

Mat3 ErrorAt::rest() const {
  Mat3 sum = Mat3::Zero();
  for (int k = static_cast<int>(error_->names.size()); k < error_->modes; ++k) {
    const Vec3 m = mode(k);
    sum += m * m.transpose();
  }
  return sum;
}

}  // namespace sgrt
