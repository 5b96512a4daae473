// Bundle adjustment, see calibration/bundle.hpp; symbols of docs/theory/calibration.md. A view adds J^T J of its own
// block: the lens and the pose of its camera, the warp, and the placement's pose.
#include "calibration/bundle.hpp"

#include <cmath>
#include <limits>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Columns of a view's Jacobian: lens, camera pose, warp, placement.
constexpr int kPose = kMaxLens, kWarp = kPose + 6, kPlace = kWarp + 3, kColumns = kPlace + 6;
using Block = Eigen::Matrix<double, kColumns, kColumns>;
using Column = Eigen::Matrix<double, kColumns, 1>;
using Cross = Eigen::Matrix<double, Eigen::Dynamic, 6>;

// eq. 6: the normal equations, split into cameras and warp (A), placements (B) and what couples them (W).
struct Normal {
  Eigen::MatrixXd A;
  Eigen::VectorXd a;
  std::vector<Mat6> B;
  std::vector<Vec6> b;
  std::vector<Cross> W;
};

struct ViewFrames {
  const Camera& camera;
  Pose camera_from_target;
  Mat3 R;  // camera_from_room
  const Pose& room_from_target;
};
ViewFrames frames_of(const Scene& scene, const View& view) {
  const Camera& camera = scene.cameras[view.camera];
  const Pose& place = scene.room_from_target[view.placement];
  return {camera, camera.camera_from_room * place, camera.camera_from_room.R, place};
}

// The cost of a view, and with `gram` J^T J and `gradient` J^T r. Infinity where a point of weight > 0 has no pixel.
double add_view(const Bundle& bundle, const Scene& scene, const View& view, Block* gram, Column* gradient) {
  const ViewFrames f = frames_of(scene, view);
  Eigen::Matrix<double, Eigen::Dynamic, kColumns> J;
  Eigen::VectorXd r(2 * view.index.size());
  if (gram) J.resize(r.size(), kColumns);
  Vec2 pixel;
  Mat23 by_point;
  LensJacobian by_lens;
  Eigen::Matrix<double, 3, 6> turn;
  turn.rightCols<3>().setIdentity();
  for (std::size_t i = 0; i < view.index.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 * i);
    const double w = std::sqrt(view.weight[i]) / (view.sigma[i] * bundle.noise);
    const Vec3 on_target = warped(bundle.target, scene.warp, view.index[i]);
    const Vec3 x = f.camera_from_target * on_target;
    if (!(w > 0) || !project_with_lens(f.camera, x, pixel, by_point, by_lens)) {
      if (w > 0) return std::numeric_limits<double>::infinity();
      r.segment<2>(row).setZero();
      if (gram) J.middleRows<2>(row).setZero();
      continue;
    }
    r.segment<2>(row) = w * (view.pixel[i] - pixel);
    if (!gram) continue;
    J.block<2, kMaxLens>(row, 0) = w * by_lens;
    turn.leftCols<3>() = -skew(x);
    J.block<2, 6>(row, kPose) = w * by_point * turn;
    const Mat23 by_room = w * by_point * f.R;
    turn.leftCols<3>() = -skew(f.room_from_target * on_target);
    J.block<2, 6>(row, kPlace) = by_room * turn;
    J.block<2, 3>(row, kWarp) =
        by_room * f.room_from_target.R.col(2) * bundle.target.warp_basis(view.index[i]).transpose();
  }
  if (gram) {
    gram->noalias() = J.transpose() * J;
    gradient->noalias() = J.transpose() * r;
  }
  return r.squaredNorm();
}

double prior_cost(const Bundle& bundle, const Scene& scene, const Layout& layout) {
  double cost = 0;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const LensVector off = lens_of(scene.cameras[c]) - bundle.priors[c].mean;
    for (int i = 0; i < kMaxLens; ++i) {
      const double t = off(i) / bundle.priors[c].sigma(i);
      if (layout.lens[c][i] >= 0) cost += t * t;
    }
  }
  return layout.warp >= 0 ? cost + scene.warp.squaredNorm() / (bundle.warp_sigma * bundle.warp_sigma) : cost;
}

double cost_of(const Bundle& bundle, const Scene& scene, const Layout& layout) {
  double cost = prior_cost(bundle, scene, layout);
  for (const View& view : bundle.views) cost += add_view(bundle, scene, view, nullptr, nullptr);
  return cost;
}

void add_priors(const Bundle& bundle, const Scene& scene, const Layout& layout, Normal& n) {
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const LensVector off = bundle.priors[c].mean - lens_of(scene.cameras[c]);
    for (int i = 0; i < kMaxLens; ++i) {
      const int at = layout.lens[c][i];
      if (at < 0) continue;
      const double p = 1 / (bundle.priors[c].sigma(i) * bundle.priors[c].sigma(i));
      n.A(at, at) += p;
      n.a(at) += p * off(i);
    }
  }
  if (layout.warp < 0) return;
  const double p = 1 / (bundle.warp_sigma * bundle.warp_sigma);
  n.A.diagonal().segment<3>(layout.warp).array() += p;
  n.a.segment<3>(layout.warp) -= p * scene.warp;
}

// Where the columns of a view's block stand in the reduced system.
std::array<int, kPlace> places_of(const Layout& layout, int camera) {
  std::array<int, kPlace> at;
  for (int i = 0; i < kMaxLens; ++i) at[i] = layout.lens[camera][i];
  for (int i = 0; i < 6; ++i) at[kPose + i] = layout.pose[camera] < 0 ? -1 : layout.pose[camera] + i;
  for (int i = 0; i < 3; ++i) at[kWarp + i] = layout.warp < 0 ? -1 : layout.warp + i;
  return at;
}

void scatter(const std::array<int, kPlace>& at, const Block& gram, const Column& gradient, int placement, Normal& n) {
  for (int i = 0; i < kPlace; ++i) {
    if (at[i] < 0) continue;
    n.a(at[i]) += gradient(i);
    n.W[placement].row(at[i]) += gram.block<1, 6>(i, kPlace);
    for (int j = 0; j < kPlace; ++j) {
      if (at[j] >= 0) n.A(at[i], at[j]) += gram(i, j);
    }
  }
  n.B[placement] += gram.block<6, 6>(kPlace, kPlace);
  n.b[placement] += gradient.segment<6>(kPlace);
}

// eq. 6. Returns the cost.
double linearise(const Bundle& bundle, const Scene& scene, const Layout& layout, Normal& n, bool with_priors) {
  const std::size_t placements = scene.room_from_target.size();
  n.A = Eigen::MatrixXd::Zero(layout.size, layout.size);
  n.a = Eigen::VectorXd::Zero(layout.size);
  n.B.assign(placements, Mat6::Zero());
  n.b.assign(placements, Vec6::Zero());
  n.W.assign(placements, Cross::Zero(layout.size, 6));
  double cost = prior_cost(bundle, scene, layout);
  Block gram;
  Column gradient;
  for (const View& view : bundle.views) {
    const double part = add_view(bundle, scene, view, &gram, &gradient);
    if (!std::isfinite(part)) return part;
    cost += part;
    scatter(places_of(layout, view.camera), gram, gradient, view.placement, n);
  }
  if (with_priors) add_priors(bundle, scene, layout, n);
  return cost;
}

struct Step {
  Eigen::VectorXd cameras;
  std::vector<Vec6> placements;
  bool ok = false;
};

// eq. 7: the reduced system, damped by lambda times the diagonal.
Step step_of(const Normal& n, double lambda) {
  Step step;
  Eigen::MatrixXd S = n.A;
  Eigen::VectorXd s = n.a;
  S.diagonal() *= 1 + lambda;
  std::vector<Eigen::LDLT<Mat6>> factor(n.B.size());
  for (std::size_t b = 0; b < n.B.size(); ++b) {
    Mat6 B = n.B[b];
    if (B.isZero(0)) B.setIdentity();  // a placement that nothing sees stays where it is
    B.diagonal() *= 1 + lambda;
    factor[b].compute(B);
    if (n.A.rows() == 0) continue;
    const Eigen::Matrix<double, 6, Eigen::Dynamic> X = factor[b].solve(n.W[b].transpose());
    S.noalias() -= n.W[b] * X;
    s.noalias() -= X.transpose() * n.b[b];
  }
  const Eigen::VectorXd d = S.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  step.cameras = d.cwiseProduct(
      Eigen::MatrixXd(d.asDiagonal() * S * d.asDiagonal()).ldlt().solve(Eigen::VectorXd(d.cwiseProduct(s))));
  step.ok = step.cameras.allFinite();
  for (std::size_t b = 0; b < n.B.size(); ++b) {
    Vec6 right = n.b[b];
    if (n.A.rows() > 0) right -= n.W[b].transpose() * step.cameras;
    step.placements.push_back(factor[b].solve(right));
    step.ok = step.ok && step.placements.back().allFinite();
  }
  return step;
}

Scene moved(const Scene& scene, const Layout& layout, const Step& step) {
  Scene next = scene;
  for (std::size_t c = 0; c < next.cameras.size(); ++c) {
    LensVector lens = lens_of(next.cameras[c]);
    for (int i = 0; i < kMaxLens; ++i) {
      if (layout.lens[c][i] >= 0) lens(i) += step.cameras(layout.lens[c][i]);
    }
    set_lens(lens, next.cameras[c]);
    if (layout.pose[c] < 0) continue;
    Pose& pose = next.cameras[c].camera_from_room;
    pose = se3_exp(step.cameras.segment<6>(layout.pose[c])) * pose;
  }
  for (std::size_t b = 0; b < step.placements.size(); ++b) {
    next.room_from_target[b] = se3_exp(step.placements[b]) * next.room_from_target[b];
  }
  if (layout.warp >= 0) next.warp += step.cameras.segment<3>(layout.warp);
  return next;
}

bool lenses_are_sane(const Scene& scene) {
  for (const Camera& c : scene.cameras) {
    if (!(c.fx > 1 && c.fy > 1 && c.fx < 1e7 && c.fy < 1e7)) return false;
  }
  return true;
}

}  // namespace

Target make_target(const Points& points) {
  Target target{points, Vec2::Zero(), 1};
  const Vec2 low = points.leftCols<2>().colwise().minCoeff(), high = points.leftCols<2>().colwise().maxCoeff();
  target.centre = (low + high) / 2;
  target.half_size = (high - low).maxCoeff() / 2;
  return target;
}

Vec3 Target::warp_basis(int i) const {
  const Vec2 uv = (points.row(i).head<2>().transpose() - centre) / half_size;
  return {uv.x() * uv.x(), uv.x() * uv.y(), uv.y() * uv.y()};
}

Vec3 warped(const Target& target, const Vec3& warp, int i) {
  Vec3 x = target.points.row(i);
  x.z() += warp.dot(target.warp_basis(i));
  return x;
}

Layout layout_of(const Bundle& bundle, const Scene& scene) {
  Layout layout;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    std::array<int, kMaxLens> at;
    at.fill(-1);
    for (int i = 0; i < lens_count(scene.cameras[c]) && !bundle.hold_cameras; ++i) {
      if (bundle.priors[c].sigma(i) > 0) at[i] = layout.size++;
    }
    layout.lens.push_back(at);
    const bool held = bundle.hold_cameras || static_cast<int>(c) == bundle.reference;
    layout.pose.push_back(held ? -1 : layout.size);
    layout.size += held ? 0 : 6;
  }
  if (bundle.warp_sigma > 0) {
    layout.warp = layout.size;
    layout.size += 3;
  }
  return layout;
}

std::vector<Vec2> residuals_of(const Bundle& bundle, const Scene& scene, const View& view) {
  const ViewFrames f = frames_of(scene, view);
  std::vector<Vec2> residuals;
  for (std::size_t i = 0; i < view.index.size(); ++i) {
    Vec2 pixel;
    const Vec3 x = f.camera_from_target * warped(bundle.target, scene.warp, view.index[i]);
    residuals.emplace_back(project_with_lens(f.camera, x, pixel) ? Vec2(view.pixel[i] - pixel) : Vec2(kNaN, kNaN));
  }
  return residuals;
}

Solution solve(const Run& run, const Bundle& bundle, Scene& scene, int max_iterations) {
  constexpr double kFirstLambda = 1e-4, kLargestLambda = 1e12, kTolerance = 1e-9, kNothing = 1e-12;
  const Layout layout = layout_of(bundle, scene);
  Normal normal;
  Solution solution;
  solution.cost = linearise(bundle, scene, layout, normal, true);
  if (!std::isfinite(solution.cost)) fail(Status::kDegenerate, "a point of the start lies where no camera can see it");
  double lambda = kFirstLambda;
  for (; solution.iterations < max_iterations && !solution.converged; ++solution.iterations) {
    run.poll(static_cast<double>(solution.iterations) / max_iterations, "solve");
    double gain = -1;
    while (lambda < kLargestLambda) {
      const Step step = step_of(normal, lambda);
      const Scene next = step.ok ? moved(scene, layout, step) : scene;
      const double cost =
          step.ok && lenses_are_sane(next) ? cost_of(bundle, next, layout) : std::numeric_limits<double>::infinity();
      if (cost <= solution.cost) {
        gain = solution.cost - cost;
        scene = next;
        lambda = std::max(lambda / 10, 1e-12);
        break;
      }
      lambda *= 10;
    }
    if (gain < 0) {  // no step lessens the cost: it is at its bottom to the last bits
      solution.converged = true;
      break;
    }
    solution.converged = gain <= kTolerance * solution.cost + kNothing;
    if (!solution.converged) solution.cost = linearise(bundle, scene, layout, normal, true);
  }
  return solution;
}

Eigen::MatrixXd information_of(const Bundle& bundle, const Scene& scene, bool with_priors) {
  const Layout layout = layout_of(bundle, scene);
  Normal n;
  linearise(bundle, scene, layout, n, with_priors);
  for (std::size_t b = 0; b < n.B.size(); ++b) {
    if (!n.B[b].isZero(0)) n.A.noalias() -= n.W[b] * n.B[b].ldlt().solve(n.W[b].transpose());
  }
  return (n.A + n.A.transpose()) / 2;
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& information) {
  const Eigen::Index n = information.rows();
  const Eigen::VectorXd d = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(Eigen::MatrixXd(d.asDiagonal() * information * d.asDiagonal()));
  if (!d.allFinite() || factor.info() != Eigen::Success) return Eigen::MatrixXd::Constant(n, n, kNaN);
  const Eigen::MatrixXd inverse = d.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(n, n)) * d.asDiagonal();
  return (inverse + inverse.transpose()) / 2;
}

}  // namespace sgrt
