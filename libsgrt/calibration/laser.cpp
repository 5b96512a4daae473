// The joint solve, see calibration/laser.hpp; symbols of docs/theory/laser.md.
#include "calibration/laser.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "calibration/initial.hpp"
#include "calibration/text.hpp"
#include "calibration/views.hpp"

namespace sgrt {
namespace {

constexpr double kPrior = 100;  // of each parameter in the units of kUnit: 0.1 rad, 100 mm
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

using Basis = Eigen::Matrix<double, kLaserParameters, Eigen::Dynamic>;

// The free directions of a unit among its parameters, a column each, 1 mrad or 1 mm long.
Basis basis_of(const LaserUnit& u) {
  const auto tangents = [](const Vec3& v) {
    Mat32 t;
    t.col(0) = v.unitOrthogonal();
    t.col(1) = v.cross(t.col(0));
    return t;
  };
  constexpr double mrad = 1e-3;
  Basis B = Basis::Zero(kLaserParameters, u.mirror ? 11 : 3);
  B.block<3, 2>(0, 0) = mrad * tangents(u.fan_normal);
  B(3, 2) = 1;
  if (!u.mirror) return B;
  const Mat32 across = tangents(u.axis_direction);
  B.block<3, 2>(4, 3) = mrad * across;
  B.block<3, 2>(7, 5) = across;
  B.block<3, 2>(10, 7) = mrad * tangents(u.normal_at_zero);
  B(13, 9) = 1;
  B(14, 10) = mrad;
  return B;
}

struct Problem {
  const Rig& rig;
  const Camera& camera;
  Target target;
  std::vector<View> views;  // one a placement
  std::vector<StripeSight> sights;
  std::vector<double> weight;  // robust, one a sight
  double corner_noise;
  std::vector<double> readings;  // distinct
  std::vector<int> reading_of;   // of each sight
};

struct State {
  LaserUnit unit;
  LaserVector off = LaserVector::Zero();  // from the start, for the prior
  std::vector<Pose> poses;                // room_from_board, one a view
};

// Where the ray of a stripe's centre meets the board, and how the plane's equation there changes.
struct Cut {
  Vec3 x, ray;
  double by_pixel;  // of e by the pixel across the stripe
  double error;     // e = n.x - d, mm
};
Cut cut_of(const Camera& camera, const Pose& board, const LightPlane& plane, const Vec2& pixel) {
  Cut c;
  Mat32 by_pixel;
  c.ray = unproject(camera, pixel, &by_pixel);
  const Vec3 n = board.R.col(2), from = camera.centre_in_room();
  const double t = n.dot(board.t - from) / n.dot(c.ray);
  c.x = from + t * c.ray;
  c.error = plane.n.dot(c.x) - plane.d;
  const Mat32 dx = t * (by_pixel - c.ray * (n.transpose() * by_pixel) / n.dot(c.ray));
  c.by_pixel = (plane.n.transpose() * dx).cwiseAbs().maxCoeff();
  if (!(t > 0)) c.error = kNaN;
  return c;
}

// Residual of a stripe's centre, px along its line.
double residual_of(const Problem& p, const State& s, std::size_t i, const std::vector<LightPlane>& planes) {
  const StripeSight& sight = p.sights[i];
  const Cut c = cut_of(p.camera, s.poses[static_cast<std::size_t>(sight.placement)],
                       planes[static_cast<std::size_t>(p.reading_of[i])], sight.pixel);
  return c.error / c.by_pixel;
}

std::vector<LightPlane> planes_of(const Problem& p, const LaserUnit& unit) {
  std::vector<LightPlane> planes(p.readings.size());
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i] = light_plane(unit, p.readings[i]);
  return planes;
}

struct Normal {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  double cost = 0;
};

// A row of the stripes touches the unit and one pose only.
void add_stripes(const Problem& p, const State& s, const Basis& basis, Normal& q) {
  const std::vector<LightPlane> planes = planes_of(p, s.unit);
  std::vector<Eigen::Matrix<double, 4, Eigen::Dynamic>> slopes(planes.size());
  for (std::size_t i = 0; i < slopes.size(); ++i) slopes[i] = light_plane_jacobian(s.unit, p.readings[i]) * basis;
  const Eigen::Index free = basis.cols();
  Eigen::VectorXd J(free + 6);
  for (std::size_t i = 0; i < p.sights.size(); ++i) {
    const StripeSight& sight = p.sights[i];
    const auto k = static_cast<std::size_t>(p.reading_of[i]);
    const Pose& board = s.poses[static_cast<std::size_t>(sight.placement)];
    const Cut c = cut_of(p.camera, board, planes[k], sight.pixel);
    const double scale = std::sqrt(p.weight[i]) / (c.by_pixel * sight.sigma), r = scale * c.error;
    if (!std::isfinite(r)) {
      q.cost = std::numeric_limits<double>::infinity();
      return;
    }
    const Vec3 n = board.R.col(2);
    // B exp(w, v): the board's normal turns by R (w x z), its origin moves by R v.
    const double along = planes[k].n.dot(c.ray) / n.dot(c.ray);
    const Vec3 lever = board.R.transpose() * (board.t - c.x);
    J.head(free) = scale * (slopes[k].topRows<3>().transpose() * c.x - slopes[k].row(3).transpose());
    J.segment<3>(free) = scale * along * Vec3::UnitZ().cross(lever);
    J.tail<3>() = scale * along * Vec3::UnitZ();
    const Eigen::Index at = free + 6 * sight.placement;
    q.H.topLeftCorner(free, free) += J.head(free) * J.head(free).transpose();
    q.H.block(at, 0, 6, free) += J.tail<6>() * J.head(free).transpose();
    q.H.block<6, 6>(at, at) += J.tail<6>() * J.tail<6>().transpose();
    q.g.head(free) -= r * J.head(free);
    q.g.segment<6>(at) -= r * J.tail<6>();
    q.cost += r * r;
  }
}

void add_corners(const Problem& p, const State& s, Eigen::Index free, Normal& q) {
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    const View& view = p.views[v];
    const Pose& board = s.poses[v];
    const Eigen::Index at = free + 6 * static_cast<Eigen::Index>(v);
    for (std::size_t i = 0; i < view.index.size(); ++i) {
      const Vec3 point = p.target.points.row(view.index[i]).transpose();
      Mat23 by_point;
      const Vec2 pixel = project(p.camera, board * point, &by_point);
      const double scale = 1 / (p.corner_noise * view.sigma[i]);
      const Vec2 r = scale * (view.pixel[i] - pixel);
      if (!r.allFinite()) {
        q.cost = std::numeric_limits<double>::infinity();
        return;
      }
      Eigen::Matrix<double, 2, 6> J;
      J << -by_point * board.R * skew(point), by_point * board.R;
      J *= scale;
      q.H.block<6, 6>(at, at) += J.transpose() * J;
      q.g.segment<6>(at) += J.transpose() * r;
      q.cost += r.squaredNorm();
    }
  }
}

Normal normal_of(const Problem& p, const State& s) {
  const Basis basis = basis_of(s.unit);
  const Eigen::Index free = basis.cols(), size = free + 6 * static_cast<Eigen::Index>(p.views.size());
  Normal q{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0};
  add_stripes(p, s, basis, q);
  add_corners(p, s, free, q);
  // Small turns from the start in the units of the basis.
  for (Eigen::Index i = 0; i < free; ++i) {
    const Eigen::VectorXd b = basis.col(i);
    const double off = b.dot(s.off) / b.squaredNorm();
    q.H(i, i) += 1 / (kPrior * kPrior);
    q.g(i) -= off / (kPrior * kPrior);
    q.cost += off * off / (kPrior * kPrior);
  }
  q.H.triangularView<Eigen::StrictlyUpper>() = q.H.transpose();
  return q;
}

State stepped(const State& s, const Eigen::VectorXd& step) {
  State next = s;
  const Basis basis = basis_of(s.unit);
  const LaserVector by = basis * step.head(basis.cols());
  next.unit = moved(s.unit, by);
  next.unit.fan_normal.normalize();
  next.unit.axis_direction.normalize();
  next.unit.normal_at_zero.normalize();
  next.off += by;
  for (std::size_t v = 0; v < s.poses.size(); ++v)
    next.poses[v] = s.poses[v] * se3_exp(step.segment<6>(basis.cols() + 6 * static_cast<Eigen::Index>(v)));
  return next;
}

// Levenberg and Marquardt.
int solve(const Run& run, const Problem& p, State& s, int max_iterations) {
  Normal q = normal_of(p, s);
  if (!std::isfinite(q.cost)) fail(Status::kDegenerate, "the start does not explain the stripes at all");
  double damping = 1e-4;
  int iteration = 0;
  for (; iteration < max_iterations; ++iteration) {
    run.poll(static_cast<double>(iteration) / max_iterations, "laser");
    Eigen::MatrixXd H = q.H;
    H.diagonal() *= 1 + damping;
    const State next = stepped(s, H.ldlt().solve(q.g));
    Normal trial = normal_of(p, next);
    if (trial.cost < q.cost) {
      const bool done = q.cost - trial.cost < 1e-9 * q.cost;
      s = next;
      q = std::move(trial);
      damping = std::max(damping / 10, 1e-12);
      if (done) break;
    } else {
      damping *= 10;
      if (damping > 1e8) break;
    }
  }
  return iteration;
}

// Cauchy weights while far, then 0 for what lies beyond the limit (eq. 20).
double weigh(Problem& p, const State& s, double outlier_sigma, bool final) {
  const std::vector<LightPlane> planes = planes_of(p, s.unit);
  std::vector<double> r(p.sights.size()), size(p.sights.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    r[i] = residual_of(p, s, i, planes) / p.sights[i].sigma;
    size[i] = std::isfinite(r[i]) ? std::abs(r[i]) : std::numeric_limits<double>::infinity();
  }
  const auto middle = size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2);
  std::nth_element(size.begin(), middle, size.end());
  const double scale = std::max(0.05, 1.4826 * *middle);
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double u = r[i] / (scale * (final ? outlier_sigma : 2));
    p.weight[i] = final ? (std::abs(u) < 1 ? 1 : 0) : 1 / (1 + u * u);
  }
  return scale;
}

// One view a placement, its pose from the corners alone.
std::vector<Pose> board_poses(const Problem& p, const CalibrationData& data) {
  std::vector<Pose> poses;
  poses.reserve(p.views.size());
  for (const View& view : p.views) {
    const std::optional<Pose> pose = plane_pose(p.target, p.camera, view);
    if (!pose)
      fail(Status::kDegenerate, "placement " + in_quotes(data.placements[static_cast<std::size_t>(view.placement)]) +
                                    ": the corners tell no pose of the board");
    poses.push_back(p.camera.camera_from_room.inverse() * *pose);
  }
  return poses;
}

// The sights on the board's plane no further than `margin` from its outer corners.
std::vector<StripeSight> sights_near(const Problem& p, const std::vector<Pose>& poses,
                                     const std::vector<StripeSight>& all, const std::vector<int>& view_of,
                                     double margin) {
  const Points& b = p.target.points;
  const Eigen::RowVector3d low = b.colwise().minCoeff(), high = b.colwise().maxCoeff();
  std::vector<StripeSight> on;
  on.reserve(all.size());
  for (const StripeSight& sight : all) {
    const int v = view_of[static_cast<std::size_t>(sight.placement)];
    if (v < 0) continue;
    const Pose& board = poses[static_cast<std::size_t>(v)];
    const Vec3 ray = unproject(p.camera, sight.pixel), from = p.camera.centre_in_room(), n = board.R.col(2);
    const Vec3 x = board.inverse() * (from + n.dot(board.t - from) / n.dot(ray) * ray);
    if (!(x.x() > low.x() - margin && x.x() < high.x() + margin && x.y() > low.y() - margin &&
          x.y() < high.y() + margin))
      continue;
    on.push_back(sight);
    on.back().placement = v;
  }
  return on;
}

// The sights on the squares; where most placements have none there, those on the white border too. At most so many,
// evenly.
void keep_on_board(Problem& p, const std::vector<Pose>& poses, const std::vector<StripeSight>& all,
                   const std::vector<int>& view_of) {
  constexpr std::size_t kMost = 6000;
  const double square = (p.target.points.row(1) - p.target.points.row(0)).norm();
  std::vector<StripeSight> on;
  for (const double margin : {0.9 * square, 3 * square}) {
    on = sights_near(p, poses, all, view_of, margin);
    std::map<int, int> count;
    for (const StripeSight& sight : on) ++count[sight.placement];
    const auto good = std::count_if(count.begin(), count.end(), [](const auto& c) { return c.second >= 20; });
    if (2 * good >= static_cast<std::ptrdiff_t>(p.views.size())) break;
  }
  const std::size_t step = 1 + on.size() / kMost;
  for (std::size_t i = 0; i < on.size(); i += step) p.sights.push_back(on[i]);
  p.weight.assign(p.sights.size(), 1);
  std::map<double, int> number;
  for (const StripeSight& sight : p.sights) number.emplace(sight.reading, 0);
  for (auto& [reading, n] : number) {
    n = static_cast<int>(p.readings.size());
    p.readings.push_back(reading);
  }
  for (const StripeSight& sight : p.sights) p.reading_of.push_back(number[sight.reading]);
}

// The unit's information, the boards eliminated.
Eigen::MatrixXd unit_information(const Normal& q, Eigen::Index free) {
  const Eigen::Index rest = q.H.rows() - free;
  return q.H.topLeftCorner(free, free) -
         q.H.topRightCorner(free, rest) *
             q.H.bottomRightCorner(rest, rest).ldlt().solve(q.H.bottomLeftCorner(rest, free));
}

// Directions that the prior alone holds, in words.
void name_unfixed(const Eigen::MatrixXd& covariance, LaserCalibration& r) {
  static constexpr std::array<const char*, 11> kWords = {"turn of the fan",   "turn of the fan",  "the fan's distance",
                                                         "tilt of the axis",  "tilt of the axis", "place of the axis",
                                                         "place of the axis", "mirror's normal",  "mirror's normal",
                                                         "mirror's offset",   "angle scale"};
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  for (Eigen::Index i = 0; i < covariance.cols(); ++i) {
    const double sigma = std::sqrt(std::max(0.0, solver.eigenvalues()(i)));
    if (sigma < 0.3 * kPrior) continue;
    std::string words;
    std::set<std::string> said;
    for (Eigen::Index k = 0; k < covariance.cols(); ++k) {
      if (std::abs(solver.eigenvectors()(k, i)) < 0.3 || !said.insert(kWords[static_cast<std::size_t>(k)]).second)
        continue;
      words += (words.empty() ? "" : ", ") + std::string(kWords[static_cast<std::size_t>(k)]);
    }
    r.unfixed.push_back(words + (said.size() > 1 ? " together" : ""));
  }
}

void set_figures(const Problem& p, const State& s, const CalibrationData& data, LaserCalibration& r) {
  const std::vector<LightPlane> planes = planes_of(p, s.unit);
  double sum = 0, count = 0;
  r.placements.resize(p.views.size());
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    LaserCalibration::Placement& out = r.placements[v];
    out.name = data.placements[static_cast<std::size_t>(p.views[v].placement)];
    out.room_from_board = s.poses[v];
    out.corners = static_cast<int>(p.views[v].index.size());
    for (std::size_t i = 0; i < p.views[v].index.size(); ++i) {
      const Vec3 x = s.poses[v] * Vec3(p.target.points.row(p.views[v].index[i]).transpose());
      out.corner_rms += (p.views[v].pixel[i] - project(p.camera, x)).squaredNorm();
    }
    out.corner_rms = std::sqrt(out.corner_rms / out.corners);
  }
  r.sights = p.sights;
  for (std::size_t i = 0; i < p.sights.size(); ++i) {
    r.residuals.push_back(residual_of(p, s, i, planes));
    r.counts.push_back(p.weight[i] > 0);
    if (!(p.weight[i] > 0)) continue;
    LaserCalibration::Placement& out = r.placements[static_cast<std::size_t>(p.sights[i].placement)];
    out.stripe_rms += r.residuals[i] * r.residuals[i];
    ++out.stripes;
    sum += r.residuals[i] * r.residuals[i];
    ++count;
  }
  for (LaserCalibration::Placement& out : r.placements) out.stripe_rms = std::sqrt(out.stripe_rms / out.stripes);
  r.rms = std::sqrt(sum / count);
}

// The rig's modes with the unit's covariance beside them (eq. 19).
RigUncertainty joined(const RigUncertainty& before, const LaserCalibration& r) {
  RigUncertainty u;
  u.residual_px = before.residual_px;
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < before.parameters.size(); ++i) {
    if (std::find(r.parameters.begin(), r.parameters.end(), before.parameters[i]) != r.parameters.end()) continue;
    u.parameters.push_back(before.parameters[i]);
    kept.push_back(static_cast<Eigen::Index>(i));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(r.covariance);
  std::vector<Eigen::Index> own;
  for (Eigen::Index i = r.covariance.cols(); i-- > 0;) {
    if (solver.eigenvalues()(i) > 1e-14 * solver.eigenvalues().maxCoeff()) own.push_back(i);
  }
  const auto rows = static_cast<Eigen::Index>(kept.size()), columns = before.modes.cols();
  u.modes = Eigen::MatrixXd::Zero(rows + r.covariance.rows(), columns + static_cast<Eigen::Index>(own.size()));
  for (Eigen::Index i = 0; i < rows; ++i)
    u.modes.row(i).head(columns) = before.modes.row(kept[static_cast<std::size_t>(i)]);
  for (std::size_t i = 0; i < own.size(); ++i)
    u.modes.col(columns + static_cast<Eigen::Index>(i)).tail(r.covariance.rows()) =
        std::sqrt(solver.eigenvalues()(own[i])) * solver.eigenvectors().col(own[i]);
  u.parameters.insert(u.parameters.end(), r.parameters.begin(), r.parameters.end());
  return u;
}

// Errors that the points of a stripe have in common (the board's flatness, its pose, the lens) do not average out along
// it: how much further than independent noise the means of the stripes' quarters lie from 0, over the placements (eq.
// 19).
double common_scale(const LaserCalibration& r) {
  std::map<std::pair<int, double>, std::vector<std::pair<Vec2, double>>> stripes;
  for (std::size_t i = 0; i < r.sights.size(); ++i) {
    const StripeSight& sight = r.sights[i];
    if (r.counts[i]) stripes[{sight.placement, sight.reading}].push_back({sight.pixel, r.residuals[i] / sight.sigma});
  }
  double sum = 0;
  int count = 0;
  for (auto& [key, points] : stripes) {
    std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.first.sum() < b.first.sum(); });
    const std::size_t n = points.size() / 4;
    for (std::size_t quarter = 0; quarter < 4 && n >= 4; ++quarter, ++count) {
      double mean = 0;
      for (std::size_t i = quarter * n; i < (quarter + 1) * n; ++i) mean += points[i].second / static_cast<double>(n);
      sum += mean * mean * static_cast<double>(n);
    }
  }
  constexpr int kFew = 8;
  return count > kFew ? std::sqrt(sum / (count - kFew)) : 1;
}

// Errors that all stripes on the board in one place have in common (its pose, the lens there): the gradients g_v of the
// places, which are 0 in sum, over what independent noise lets expect of them, Cov g_v = H_v - H_v H^-1 H_v, H_v the
// place's own information (eq. 19).
double place_scale(Problem p, const State& s, const Normal& whole, const Eigen::MatrixXd& information) {
  const Basis basis = basis_of(s.unit);
  const Eigen::Index free = basis.cols(), size = whole.H.rows();
  const std::vector<double> weight = p.weight;
  const Eigen::LDLT<Eigen::MatrixXd> solver(information);
  double sum = 0, expected = static_cast<double>(free);
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    for (std::size_t i = 0; i < weight.size(); ++i)
      p.weight[i] = p.sights[i].placement == static_cast<int>(v) ? weight[i] : 0;
    Normal own{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0};
    add_stripes(p, s, basis, own);
    const Eigen::Index at = free + 6 * static_cast<Eigen::Index>(v);
    const Eigen::MatrixXd H =
        own.H.topLeftCorner(free, free) -
        whole.H.block(0, at, free, 6) * whole.H.block<6, 6>(at, at).ldlt().solve(whole.H.block(at, 0, 6, free));
    const Eigen::MatrixXd share = solver.solve(H);
    sum += own.g.head(free).dot(solver.solve(own.g.head(free)));
    expected -= (share * share).trace();
  }
  return expected > 0.5 ? std::sqrt(sum / expected) : 1;
}

void set_covariance(const Problem& p, const State& s, LaserCalibration& r) {
  const Basis basis = basis_of(s.unit);
  const Normal whole = normal_of(p, s);
  const Eigen::MatrixXd information = unit_information(whole, basis.cols());
  const double scale = std::max({r.noise_scale, common_scale(r), place_scale(p, s, whole, information)});
  const Eigen::MatrixXd own = scale * scale * information.inverse();
  if (!own.allFinite()) fail(Status::kDegenerate, "the stripes leave the laser unit free");
  name_unfixed(information.inverse(), r);
  r.parameters = parameter_names(s.unit);
  r.covariance = basis * own * basis.transpose();
  std::vector<double> effect;
  effect.reserve(p.sights.size());
  for (std::size_t i = 0; i < p.sights.size(); i += 7) {
    const StripeSight& sight = p.sights[i];
    const LightPlane plane = light_plane(s.unit, sight.reading);
    const Cut c = cut_of(p.camera, s.poses[static_cast<std::size_t>(sight.placement)], plane, sight.pixel);
    const PlaneJacobian J = light_plane_jacobian(s.unit, sight.reading);
    const LaserVector e = J.topRows<3>().transpose() * c.x - J.row(3).transpose();
    effect.push_back(std::sqrt(e.dot(r.covariance * e)) / std::abs(plane.n.dot(c.ray)));
  }
  const auto middle = effect.begin() + static_cast<std::ptrdiff_t>(effect.size() / 2);
  std::nth_element(effect.begin(), middle, effect.end());
  r.sigma_mm = *middle;
}

LaserCalibration solve_laser(const Run& run, const Rig& rig, const std::string& id, const LaserUnit* start,
                             const CalibrationData& data, const std::vector<StripeSight>& stripes,
                             const LaserCalibrationOptions& o) {
  constexpr int kRounds = 4;
  constexpr double kDefaultNoise = 0.1;
  LaserCalibration r;
  const int camera = start ? start->camera : camera_index(rig, data.cameras.at(0).id);
  const double residual = rig.uncertainty.residual_px;
  Problem p{rig,
            rig.cameras[static_cast<std::size_t>(camera)],
            make_target(data.points),
            {},
            {},
            {},
            o.corner_noise > 0 ? o.corner_noise
            : residual > 0     ? residual
                               : kDefaultNoise,
            {},
            {}};
  std::vector<Discarded> discarded;
  p.views = views_of(data, discarded);
  if (p.views.empty()) fail(Status::kInsufficientData, "the board was found in none of the placements");
  for (View& view : p.views) view.sigma.assign(view.index.size(), 1);
  std::vector<int> view_of(data.placements.size(), -1);
  for (std::size_t v = 0; v < p.views.size(); ++v)
    view_of[static_cast<std::size_t>(p.views[v].placement)] = static_cast<int>(v);
  State s;
  s.poses = board_poses(p, data);
  keep_on_board(p, s.poses, stripes, view_of);
  if (p.sights.size() < 50)
    fail(Status::kInsufficientData,
         "the stripe crosses the board at " + std::to_string(p.sights.size()) + " points, expected at least 50");
  std::vector<Vec3> x;
  std::vector<double> readings;
  x.reserve(p.sights.size());
  readings.reserve(p.sights.size());
  for (const StripeSight& sight : p.sights) {
    x.push_back(
        cut_of(p.camera, s.poses[static_cast<std::size_t>(sight.placement)], {Vec3::UnitZ(), 0}, sight.pixel).x);
    readings.push_back(sight.reading);
  }
  if (!o.fixed && std::all_of(readings.begin(), readings.end(), [&](double a) { return a == readings.front(); }))
    fail(Status::kInsufficientData, "angle_rad: one mirror angle, expected a sweep (or a laser without a mirror)");
  const Vec3 centre = p.camera.centre_in_room();
  s.unit = start ? normalised(*start, centre) : first_unit(x, readings, o.fixed, centre);
  s.unit.id = id;
  s.unit.camera = camera;
  for (int round = 0; round < kRounds; ++round) {
    r.noise_scale = weigh(p, s, o.outlier_sigma, round == kRounds - 1);
    r.iterations += solve(run, p, s, o.max_iterations);
  }
  r.noise_scale = std::max(1.0, weigh(p, s, o.outlier_sigma, true));
  set_figures(p, s, data, r);
  s.unit = normalised(s.unit, centre);  // the covariance is that of what is written
  s.unit.id = id;
  set_covariance(p, s, r);
  r.unit = s.unit;
  if (r.noise_scale > 3)
    r.warnings.push_back("the stripes lie " + rounded(r.noise_scale, 1) +
                         " times as far off the model as their own sigma lets expect (" + rounded(r.rms, 3) +
                         " px RMS)");
  for (const std::string& words : r.unfixed) r.warnings.push_back("the sweep does not fix: " + words);
  r.rig_json = rig_with_laser(rig, r.unit, joined(rig.uncertainty, r));
  return r;
}

}  // namespace

LaserCalibration calibrate_laser(const Run& run, const Rig& rig, const std::string& laser_id, const LaserUnit* start,
                                 const CalibrationData& data, const std::vector<StripeSight>& stripes,
                                 const LaserCalibrationOptions& options) {
  check_data(data);
  if (data.cameras.size() != 1)
    fail(Status::kInvalidArgument,
         "data.camera_count: " + std::to_string(data.cameras.size()) + ", expected 1, the laser's camera");
  for (std::size_t i = 0; i < stripes.size(); ++i) {
    const StripeSight& s = stripes[i];
    if (s.placement >= 0 && s.placement < static_cast<int>(data.placements.size()) && s.pixel.allFinite() &&
        std::isfinite(s.reading) && s.sigma > 0 && s.sigma < 100)
      continue;
    fail(Status::kInvalidArgument,
         "stripes: entry " + std::to_string(i) +
             ": expected a placement of the data, a finite pixel and angle, a positive sigma");
  }
  try {
    return solve_laser(run, rig, laser_id, start, data, stripes, options);
  } catch (const Error& error) {
    if (error.status() < Status::kInsufficientData || error.status() >= Status::kCancelled) throw;
    LaserCalibration r;
    r.status = error.status();
    r.message = error.what();
    r.rms = r.sigma_mm = kNaN;
    return r;
  }
}

}  // namespace sgrt
