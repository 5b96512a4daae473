// Free motions in words. docs/theory/icp.md section 5.
#include "registration/words.hpp"

#include <algorithm>
#include <cmath>

namespace sgrt {
namespace {

constexpr double kPureSlide = 0.05;  // a scaled rotation below this share of the motion is none
constexpr double kAligned = 0.97;    // cosine within which a direction is called by the axis' name
const char* const kAxis[] = {"LAT", "LNG", "VRT"};
const char* const kTurn[] = {"PITCH", "ROLL", "RTN"};

// Orthonormal vectors that span the columns' space, each as near to a room axis as what is left of the space allows.
std::vector<Vec3> along_axes(const Eigen::Matrix<double, 3, Eigen::Dynamic>& columns) {
  std::vector<Vec3> out;
  if (columns.cols() == 0) return out;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(columns, Eigen::ComputeThinU);
  Mat3 projector = svd.matrixU() * svd.matrixU().transpose();
  while (out.size() < static_cast<std::size_t>(columns.cols())) {
    int axis;
    projector.diagonal().maxCoeff(&axis);
    const Vec3 v = projector.col(axis).normalized();
    out.push_back(v);
    projector -= v * v.transpose();
  }
  const auto axis_of = [](const Vec3& v) {
    int axis;
    v.cwiseAbs().maxCoeff(&axis);
    return axis;
  };
  std::stable_sort(out.begin(), out.end(), [&](const Vec3& a, const Vec3& b) { return axis_of(a) < axis_of(b); });
  return out;
}

FreeMotion make_motion(Vec6 scaled_motion) {
  int largest;
  scaled_motion.cwiseAbs().maxCoeff(&largest);
  scaled_motion /= scaled_motion[largest];
  scaled_motion.head<3>() /= kTurnLever;
  return {scaled_motion, ""};
}

std::string direction_words(const Vec3& direction, const char* const* turn_names) {
  const Vec3 v = direction.normalized();
  int axis;
  if (v.cwiseAbs().maxCoeff(&axis) >= kAligned) {
    return turn_names != nullptr ? std::string(kAxis[axis]) + " (" + turn_names[axis] + ")" : kAxis[axis];
  }
  std::string words;
  for (int i = 0; i < 3; ++i) {
    const double c = v[i] * (v[axis] < 0 ? -1 : 1);
    if (std::abs(c) < 0.1) continue;
    const auto percent = std::to_string(std::lround(std::abs(c) * 100));
    words += (words.empty() ? (c < 0 ? "-" : "") : (c < 0 ? " - " : " + ")) + percent + " % " + kAxis[i];
  }
  return words;
}

std::string point_words(const Vec3& x) {
  std::string words = "(";
  for (int i = 0; i < 3; ++i) words += (i > 0 ? ", " : "") + std::to_string(std::lround(x[i]));
  return words + ") mm";
}

// The point nearest the isocentre that all turns leave where it is, relative to it: t = c x w (least squares).
Vec3 common_centre(const std::vector<FreeMotion>& motions) {
  Mat3 m = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  for (const FreeMotion& f : motions) {
    const Mat3 W = -skew(f.motion.head<3>());  // c x w = -[w]_x c
    m += W.transpose() * W;
    b += W.transpose() * f.motion.tail<3>();
  }
  return m.completeOrthogonalDecomposition().solve(b);
}

std::string turn_words(const Vec6& motion, const Vec3& centre, const Vec3& isocentre) {
  std::string words = "turns about " + direction_words(motion.head<3>(), kTurn);
  if (centre.norm() > 1) words += " through " + point_words(isocentre + centre);
  const Vec3 w = motion.head<3>();
  const double advance = std::abs(w.dot(motion.tail<3>())) / (w.squaredNorm() * kTurnLever);
  return advance > 0.1 ? words + " and slides along it" : words;
}

bool is_slide(const Vec6& motion) {
  const Vec6 z = scaled(motion);
  return z.head<3>().norm() < kPureSlide * z.norm();
}

}  // namespace

Vec6 scaled(const Vec6& motion) {
  Vec6 z = motion;
  z.head<3>() *= kTurnLever;
  return z;
}

std::string words_of(const Vec6& motion, const Vec3& isocentre) {
  if (is_slide(motion)) return "slides along " + direction_words(motion.tail<3>(), nullptr);
  return turn_words(motion, common_centre({{motion, ""}}), isocentre);
}

std::vector<FreeMotion> name_motions(const Motions& basis, const Vec3& isocentre) {
  std::vector<FreeMotion> slides, turns;
  if (basis.cols() == 0) return slides;
  const Eigen::JacobiSVD<Eigen::MatrixXd> space(basis, Eigen::ComputeThinU);
  const Motions Q = space.matrixU();
  // Combinations without rotation are slides; the others are turns.
  const Eigen::JacobiSVD<Eigen::MatrixXd> turn(Q.topRows(3), Eigen::ComputeFullV);
  int rank = 0;
  while (rank < turn.singularValues().size() && turn.singularValues()[rank] > kPureSlide) ++rank;
  const Motions turning = Q * turn.matrixV().leftCols(rank);
  const Motions sliding = Q * turn.matrixV().rightCols(Q.cols() - rank);
  const Eigen::MatrixXd ways = rank < Q.cols() ? Eigen::MatrixXd(sliding.bottomRows(3)) : Eigen::MatrixXd(3, 0);
  for (const Vec3& v : along_axes(ways)) {
    Vec6 z = Vec6::Zero();
    z.tail<3>() = v;
    slides.push_back(make_motion(z));
    slides.back().words = words_of(slides.back().motion, isocentre);
  }
  if (rank == 0) return slides;
  const Eigen::JacobiSVD<Eigen::MatrixXd> inverse(turning.topRows(3), Eigen::ComputeThinU | Eigen::ComputeThinV);
  for (const Vec3& v : along_axes(turning.topRows(3))) turns.push_back(make_motion(turning * inverse.solve(v)));
  const Vec3 centre = common_centre(turns);
  for (FreeMotion& f : turns) {
    const Vec3 w = f.motion.head<3>(), error = f.motion.tail<3>() - centre.cross(w);
    const bool shared = error.norm() < 0.1 * kTurnLever * w.norm();
    f.words = shared ? turn_words(f.motion, centre, isocentre) : words_of(f.motion, isocentre);
    slides.push_back(f);
  }
  return slides;
}

}  // namespace sgrt
