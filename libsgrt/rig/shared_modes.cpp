// Which combinations of a rig's modes its surfaces carry, see rig/uncertainty.hpp. docs/theory/calibration.md eq.
// 23-24.
#include <algorithm>
#include <cstdint>
#include <cstring>

#include "core/surface.hpp"
#include "rig/uncertainty.hpp"

namespace sgrt {
namespace {

constexpr int kGrid = 4;  // cells across and down the left image

// How far from the left camera the pair's axes come closest, within 3 to 20 baselines; 8 where they are parallel.
double working_distance(const Camera& left, const Camera& right) {
  const Vec3 base = right.centre_in_room() - left.centre_in_room();
  const Vec3 a = left.camera_from_room.R.row(2), b = right.camera_from_room.R.row(2);
  const double length = base.norm(), cosine = a.dot(b), sine2 = 1 - cosine * cosine;
  const double along = sine2 > 1e-4 ? (base.dot(a) - base.dot(b) * cosine) / sine2 : 8 * length;
  return along > 0 ? std::clamp(along, 3 * length, 20 * length) : 8 * length;
}

// sum G^T G over points that both cameras of each pair see, G their motion by the modes (eq. 23).
Eigen::MatrixXd effect_of_modes(const Rig& rig) {
  const Eigen::Index n = rig.uncertainty.modes.cols();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
  for (const StereoPair& pair : rig.pairs) {
    const Camera &left = rig.cameras[pair.left], &right = rig.cameras[pair.right];
    const double distance = working_distance(left, right);
    for (const double share : {0.8, 1.0, 1.25})
      for (int i = 0; i < (kGrid + 1) * (kGrid + 1); ++i) {
        const int across = i % (kGrid + 1), down = i / (kGrid + 1);
        const Vec2 pixel(across * (left.width - 1.0) / kGrid, down * (left.height - 1.0) / kGrid);
        const Vec3 ray = undistort(left, pixel).homogeneous();
        const Mat3X moved = left_ray_modes(rig, pair, left.camera_from_room.inverse() * (share * distance * ray));
        if (moved.allFinite()) sum += moved.transpose() * moved;
      }
  }
  return sum;
}

// FNV-1a, 64 bits.
struct Fingerprint {
  std::uint64_t value = 14695981039346656037U;
  void add(const void* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      value = (value ^ static_cast<const unsigned char*>(data)[i]) * 1099511628211U;
  }
  void add(double x) {
    x += 0.0;  // -0 is 0
    add(&x, sizeof x);
  }
  void add(const std::string& s) { add(s.c_str(), s.size() + 1); }
};

std::string fingerprint_of(const Rig& rig) {
  Fingerprint f;
  for (const Camera& c : rig.cameras) {
    f.add(c.id);
    const LensVector lens = lens_of(c);
    for (const double x : lens) f.add(x);
    for (const double x : c.camera_from_room.R.reshaped()) f.add(x);
    for (const double x : c.camera_from_room.t) f.add(x);
  }
  for (const StereoPair& p : rig.pairs) f.add(rig.cameras[p.left].id), f.add(rig.cameras[p.right].id);
  for (const std::string& name : rig.uncertainty.parameters) f.add(name);
  for (const double x : rig.uncertainty.modes.reshaped()) f.add(x);
  std::string text;
  for (int i = 0; i < 8; ++i) text += "0123456789abcdef"[(f.value >> (60 - 4 * i)) & 15];
  return text;
}

}  // namespace

SharedModes shared_modes(const Rig& rig) {
  constexpr double kNegligible = 1e-9;  // of the variance
  SharedModes shared;
  if (rig.uncertainty.modes.cols() == 0) return shared;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> effect(effect_of_modes(rig));
  const Eigen::VectorXd variance = effect.eigenvalues().reverse();  // strongest first
  Eigen::MatrixXd V = effect.eigenvectors().rowwise().reverse();
  for (auto v : V.colwise()) {  // a sign of its own
    Eigen::Index largest;
    v.cwiseAbs().maxCoeff(&largest);
    if (v(largest) < 0) v *= -1;
  }
  Eigen::Index kept = 0;
  while (kept < std::min<Eigen::Index>(V.cols(), kMaxModes) && variance(kept) > kNegligible * variance(0)) ++kept;
  shared.kept = V.leftCols(kept), shared.rest = V.rightCols(V.cols() - kept);
  const std::string name = rig.id + " " + fingerprint_of(rig) + " ";
  for (Eigen::Index k = 0; k < kept; ++k) shared.names.push_back(name + std::to_string(k));
  return shared;
}

}  // namespace sgrt
