// A laser unit from a board: the data on it, a start, the solve, the figures; see calibration/laser.hpp. Symbols of
// docs/theory/laser.md.
#include "calibration/laser.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "calibration/blunders.hpp"
#include "calibration/initial.hpp"
#include "calibration/laser_problem.hpp"
#include "calibration/text.hpp"
#include "calibration/views.hpp"

namespace sgrt {
namespace {

// One view a placement, its pose from the corners alone.
std::vector<Pose> board_poses(const LaserProblem& p, const CalibrationData& data) {
  std::vector<Pose> poses;
  poses.reserve(p.views.size());
  for (const View& view : p.views) {
    const std::optional<Pose> pose = plane_pose(p.target, p.camera, without_blunders(p.target, view));
    if (!pose)
      fail(Status::kDegenerate, "placement " + in_quotes(data.placements[static_cast<std::size_t>(view.placement)]) +
                                    ": the corners tell no pose of the board");
    poses.push_back(p.camera.camera_from_room.inverse() * *pose);
  }
  return poses;
}

// The sights on the board's plane no further than `margin` from its outer corners.
std::vector<StripeSight> sights_near(const LaserProblem& p, const std::vector<Pose>& poses,
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
    const Vec3 x = board.inverse() * point_on_board(p.camera, board, sight.pixel);
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
void keep_on_board(LaserProblem& p, const std::vector<Pose>& poses, const std::vector<StripeSight>& all,
                   std::size_t placements) {
  constexpr std::size_t kMost = 6000;
  std::vector<int> view_of(placements, -1);
  for (std::size_t v = 0; v < p.views.size(); ++v)
    view_of[static_cast<std::size_t>(p.views[v].placement)] = static_cast<int>(v);
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

void set_figures(const LaserProblem& p, const LaserState& s, const CalibrationData& data, LaserCalibration& r) {
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
  r.residuals = stripe_residuals(p, s);
  for (std::size_t i = 0; i < p.sights.size(); ++i) {
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

// The views, a pose of the board for each, and the stripes on them.
LaserProblem problem_of(const Rig& rig, const Camera& camera, const CalibrationData& data,
                        const std::vector<StripeSight>& stripes, const LaserCalibrationOptions& o,
                        std::vector<Pose>& poses) {
  constexpr double kDefaultNoise = 0.1;
  constexpr std::size_t kFewest = 50;
  const double residual = rig.uncertainty.residual_px, stated = residual > 0 ? residual : kDefaultNoise;
  LaserProblem p{camera, make_target(data.points), o.corner_noise > 0 ? o.corner_noise : stated};
  std::vector<Discarded> discarded;
  p.views = views_of(data, discarded);
  if (p.views.empty()) fail(Status::kInsufficientData, "the board was found in none of the placements");
  for (View& view : p.views) view.sigma.assign(view.index.size(), 1);
  poses = board_poses(p, data);
  keep_on_board(p, poses, stripes, data.placements.size());
  if (p.sights.size() < kFewest)
    fail(Status::kInsufficientData,
         "the stripe crosses the board at " + std::to_string(p.sights.size()) + " points, expected at least 50");
  const auto first = [&](const StripeSight& sight) { return sight.reading == p.sights.front().reading; };
  if (!o.fixed && std::all_of(p.sights.begin(), p.sights.end(), first))
    fail(Status::kInsufficientData, "angle_rad: one mirror angle, expected a sweep (or a laser without a mirror)");
  return p;
}

// A unit from the points at which the stripes cross the boards.
LaserUnit unit_from_boards(const LaserProblem& p, const std::vector<Pose>& poses, bool fixed) {
  std::vector<Vec3> x;
  std::vector<double> readings;
  x.reserve(p.sights.size());
  readings.reserve(p.sights.size());
  for (const StripeSight& sight : p.sights) {
    x.push_back(point_on_board(p.camera, poses[static_cast<std::size_t>(sight.placement)], sight.pixel));
    readings.push_back(sight.reading);
  }
  return first_unit(x, readings, fixed, p.camera.centre_in_room());
}

LaserCalibration solve_laser(const Run& run, const Rig& rig, const std::string& id, const LaserUnit* start,
                             const CalibrationData& data, const std::vector<StripeSight>& stripes,
                             const LaserCalibrationOptions& o) {
  const int camera = start ? start->camera : camera_index(rig, data.cameras.at(0).id);
  LaserState s;
  LaserProblem p = problem_of(rig, rig.cameras[static_cast<std::size_t>(camera)], data, stripes, o, s.poses);
  const Vec3 centre = p.camera.centre_in_room();
  s.unit = start ? normalised(*start, centre) : unit_from_boards(p, s.poses, o.fixed);
  s.unit.id = id;
  s.unit.camera = camera;
  const LaserSolution solution = solve_robustly(run, p, s, o);
  LaserCalibration r;
  r.iterations = solution.iterations;
  r.noise_scale = std::max(1.0, solution.noise_scale);
  set_figures(p, s, data, r);
  s.unit = normalised(s.unit, centre);  // the covariance is that of what is written
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
    r.rms = r.sigma_mm = std::numeric_limits<double>::quiet_NaN();
    return r;
  }
}

}  // namespace sgrt
