// The room, see calibration/room.hpp; symbols of docs/theory/calibration.md.
#include "calibration/room.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "calibration/initial.hpp"
#include "calibration/text.hpp"
#include "calibration/views.hpp"
#include "core/error.hpp"
#include "core/surface.hpp"
#include "core/within.hpp"
#include "rig/laser.hpp"
#include "rig/uncertainty.hpp"

namespace sgrt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct RigSight {
  int camera, point;  // of the rig; of the phantom
  Vec2 pixel;
  std::size_t sight;  // of the data
  bool used = true;
};

// A point from all cameras of the rig that see it: the place nearest to the rays, then by its pixels. NaN below two
// cameras.
Vec3 triangulated(const Rig& rig, const std::vector<RigSight>& sights, int point) {
  Mat3 A = Mat3::Zero();
  Vec3 a = Vec3::Zero();
  int count = 0;
  for (const RigSight& s : sights) {
    if (s.point != point || !s.used) continue;
    const Camera& c = rig.cameras[s.camera];
    const Vec3 ray = unproject(c, s.pixel);
    if (!ray.allFinite()) continue;
    const Mat3 across = Mat3::Identity() - ray * ray.transpose();
    A += across;
    a += across * c.centre_in_room();
    ++count;
  }
  if (count < 2) return Vec3::Constant(kNaN);
  Vec3 x = A.ldlt().solve(a);
  for (int step = 0; step < 3; ++step) {
    Mat3 N = Mat3::Zero();
    Vec3 n = Vec3::Zero();
    for (const RigSight& s : sights) {
      if (s.point != point || !s.used) continue;
      Mat23 J;
      const Vec2 pixel = project(rig.cameras[s.camera], x, &J);
      if (!pixel.allFinite()) continue;
      N += J.transpose() * J;
      n += J.transpose() * (s.pixel - pixel);
    }
    x += N.ldlt().solve(n);
  }
  return x;
}

// A start from the triangulated points, or from one camera's view of a plate.
Pose start_of(const Rig& rig, const Points& phantom, const std::vector<RigSight>& sights, const std::string& name) {
  std::vector<Vec3> in_rig;
  std::vector<int> which;
  for (int p = 0; p < static_cast<int>(phantom.rows()); ++p) {
    const Vec3 x = triangulated(rig, sights, p);
    if (!x.allFinite()) continue;
    in_rig.push_back(x);
    which.push_back(p);
  }
  if (in_rig.size() < 3)
    fail(Status::kInsufficientData, name + ": " + std::to_string(in_rig.size()) +
                                        " points of the phantom are seen by two of its cameras, expected at least 3");
  Points from(static_cast<Eigen::Index>(in_rig.size()), 3), to = from;
  for (std::size_t i = 0; i < in_rig.size(); ++i) {
    from.row(static_cast<Eigen::Index>(i)) = phantom.row(which[i]);
    to.row(static_cast<Eigen::Index>(i)) = in_rig[i];
  }
  return rigid_fit_svd(from, to);
}

struct Equations {
  Mat6 A = Mat6::Zero();
  Vec6 a = Vec6::Zero();
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_modes;  // J^T W dpixel of each mode
  double square = 0;                                  // of the weighted residuals
  int rows = 0;
};

// eq. 25: rig_from_room moved by exp(e) on its left; W from the pixels' noise and the phantom's own tolerance.
Equations equations_of(const Rig& rig, const Points& phantom, const std::vector<RigSight>& sights, const Pose& pose,
                       double noise_px, double point_sigma) {
  Equations q;
  q.by_modes = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, rig.uncertainty.modes.cols());
  for (const RigSight& s : sights) {
    if (!s.used) continue;
    const Vec3 x = pose * Vec3(phantom.row(s.point));
    Mat23 by_point;
    const Vec2 pixel = project(rig.cameras[s.camera], x, &by_point);
    if (!pixel.allFinite())
      fail(Status::kNotFound, "point " + std::to_string(s.point) + " of the phantom lies outside what the cameras see");
    Eigen::Matrix<double, 2, 6> J;
    J << -by_point * skew(x), by_point;
    const Eigen::Matrix2d variance =
        noise_px * noise_px * Eigen::Matrix2d::Identity() + point_sigma * point_sigma * by_point * by_point.transpose();
    const Eigen::Matrix2d W = variance.inverse();
    const Vec2 r = s.pixel - pixel;
    q.A += J.transpose() * W * J;
    q.a += J.transpose() * W * r;
    q.by_modes += J.transpose() * W * pixel_modes(rig, s.camera, x);
    q.square += r.dot(W * r);
    q.rows += 2;
  }
  return q;
}

Pose refined(const Rig& rig, const Points& phantom, const std::vector<RigSight>& sights, Pose pose, double noise_px,
             double point_sigma) {
  constexpr int kSteps = 20;
  for (int i = 0; i < kSteps; ++i) {
    const Equations q = equations_of(rig, phantom, sights, pose, noise_px, point_sigma);
    const Vec6 step = q.A.ldlt().solve(q.a);
    pose = se3_exp(step) * pose;
    if (step.head<3>().norm() < 1e-12 && step.tail<3>().norm() < 1e-9) break;
  }
  return pose;
}

double rms_px(const Rig& rig, const Points& phantom, const std::vector<RigSight>& sights, const Pose& pose) {
  double sum = 0, count = 0;
  for (const RigSight& s : sights) {
    if (!s.used) continue;
    sum += (s.pixel - project(rig.cameras[s.camera], pose * Vec3(phantom.row(s.point)))).squaredNorm();
    ++count;
  }
  return std::sqrt(sum / count);
}

// The fit of one rig. Sights that contradict the others are left out, worst first.
RoomFit fit(const Rig& rig, const std::string& name, const Points& phantom, std::vector<RigSight>& sights,
            const RoomOptions& o, double noise_px, Equations& q) {
  RoomFit f;
  f.name = name;
  f.rig_from_room = start_of(rig, phantom, sights, name);
  for (;;) {
    f.rig_from_room = refined(rig, phantom, sights, f.rig_from_room, noise_px, o.point_sigma_mm);
    RigSight* worst = nullptr;
    double most = 0;
    for (RigSight& s : sights) {
      if (!s.used) continue;
      Mat23 J;
      const Vec2 r = s.pixel - project(rig.cameras[s.camera], f.rig_from_room * Vec3(phantom.row(s.point)), &J);
      const double sigma = std::sqrt(noise_px * noise_px + o.point_sigma_mm * o.point_sigma_mm * J.squaredNorm() / 2);
      if (r.norm() / sigma <= most) continue;
      most = r.norm() / sigma;
      worst = &s;
    }
    const auto used = std::count_if(sights.begin(), sights.end(), [](const RigSight& s) { return s.used; });
    if (most <= o.outlier_sigma || used <= 8) break;
    worst->used = false;
  }
  q = equations_of(rig, phantom, sights, f.rig_from_room, noise_px, o.point_sigma_mm);
  const Mat6 inverse = q.A.inverse();
  if (!inverse.allFinite()) fail(Status::kDegenerate, name + ": the phantom's points leave a direction free");
  // What the calibration's own modes do at the phantom the fit has absorbed; they stay in the rig's modes.
  const Mat6 turn = adjoint(f.rig_from_room.inverse());
  f.covariance = turn * inverse * turn.transpose();
  f.rms_px = rms_px(rig, phantom, sights, f.rig_from_room);
  std::set<int> points;
  for (const RigSight& s : sights) {
    if (!s.used) continue;
    points.insert(s.point);
    ++f.sights;
  }
  f.points = static_cast<int>(points.size());
  double sum = 0, count = 0;
  for (int p : points) {
    const Vec3 x = triangulated(rig, sights, p);
    if (!x.allFinite()) continue;
    sum += (f.rig_from_room.inverse() * x - Vec3(phantom.row(p))).squaredNorm();
    ++count;
  }
  f.point_rms_mm = std::sqrt(sum / count);
  return f;
}

// Sights of the cameras that belong to this rig.
std::vector<RigSight> sights_of(const Rig& rig, const CalibrationData& data) {
  std::vector<RigSight> own;
  for (std::size_t i = 0; i < data.sights.size(); ++i) {
    const Sight& s = data.sights[i];
    const CalibrationCamera& seen_by = data.cameras[s.camera];
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      if (rig.cameras[c].id != seen_by.id) continue;
      if (rig.cameras[c].width != seen_by.width || rig.cameras[c].height != seen_by.height)
        fail(Status::kInvalidArgument, "camera " + in_quotes(seen_by.id) + ": an image of " +
                                           std::to_string(seen_by.width) + " x " + std::to_string(seen_by.height) +
                                           ", the rig states another size");
      own.push_back({static_cast<int>(c), s.point, s.pixel, i, true});
    }
  }
  return own;
}

void check_phantom(const std::vector<const Rig*>& rigs, const CalibrationData& data) {
  std::set<std::string> known;
  for (const Rig* rig : rigs) {
    for (const Camera& c : rig->cameras) {
      if (!known.insert(c.id).second)
        fail(Status::kInvalidArgument, "rigs: camera " + in_quotes(c.id) + " stands in two of them");
    }
  }
  for (const CalibrationCamera& c : data.cameras) {
    if (!known.count(c.id)) fail(Status::kInvalidArgument, "camera " + in_quotes(c.id) + " is in none of the rigs");
  }
  if (data.points.rows() < 3)
    fail(Status::kInvalidArgument, "points: " + std::to_string(data.points.rows()) + ", expected at least 3");
  if (!within(data.points, kMaxCoordinate))
    fail(Status::kInvalidArgument, "points: expected finite coordinates within 1e5 mm");
  check_sights(data);
}

// eq. 26: the cameras of a rig in the room, with modes for what the fit adds.
void add_to_room(const Rig& rig, const RoomFit& f, const Equations& q, Rig& out) {
  const int first = static_cast<int>(out.cameras.size());
  const Mat6 inverse = q.A.inverse();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> by_modes = -(inverse * q.by_modes);
  const Mat6 noise = inverse.llt().matrixL();
  std::vector<std::string> names;
  Eigen::Index rows = 0;
  for (const Camera& c : rig.cameras) rows += lens_count(c) + 6;
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(rows, by_modes.cols() + 6);
  Eigen::Index at = 0;
  for (const Camera& c : rig.cameras) {
    const std::vector<std::string> own = parameter_names(c);
    for (std::size_t i = 0; i < own.size(); ++i) {
      const auto& known = rig.uncertainty.parameters;
      const auto found = std::find(known.begin(), known.end(), own[i]);
      if (found != known.end())
        modes.row(at + static_cast<Eigen::Index>(i)).head(by_modes.cols()) =
            rig.uncertainty.modes.row(found - known.begin());
      names.push_back(own[i]);
    }
    const Mat6 A = adjoint(c.camera_from_room);  // C exp(e) = exp(A e) C
    modes.block(at + lens_count(c), 0, 6, by_modes.cols()) += A * by_modes;
    modes.block(at + lens_count(c), by_modes.cols(), 6, 6) = A * noise;
    at += static_cast<Eigen::Index>(own.size());
    Camera moved = c;
    moved.camera_from_room = c.camera_from_room * f.rig_from_room;
    out.cameras.push_back(make_camera(moved));
  }
  for (const StereoPair& pair : rig.pairs) out.pairs.push_back({pair.id, pair.left + first, pair.right + first});
  RigUncertainty& u = out.uncertainty;
  const Eigen::MatrixXd before = u.modes;
  u.modes = Eigen::MatrixXd::Zero(before.rows() + modes.rows(), before.cols() + modes.cols());
  u.modes.topLeftCorner(before.rows(), before.cols()) = before;
  u.modes.bottomRightCorner(modes.rows(), modes.cols()) = modes;
  u.parameters.insert(u.parameters.end(), names.begin(), names.end());
  u.residual_px = std::max(u.residual_px, rig.uncertainty.residual_px);
}

// Each pair by itself, and how far apart they then have the phantom's points.
void compare_pairs(const CalibrationData& data, const RoomOptions& o, RoomResult& r) {
  const std::vector<RigSight> all = sights_of(r.rig, data);
  std::map<int, std::vector<Vec3>> seen;
  for (const StereoPair& pair : r.rig.pairs) {
    std::vector<RigSight> own;
    std::copy_if(all.begin(), all.end(), std::back_inserter(own),
                 [&](const RigSight& s) { return s.camera == pair.left || s.camera == pair.right; });
    for (int p = 0; p < static_cast<int>(data.points.rows()); ++p) {
      const Vec3 x = triangulated(r.rig, own, p);
      if (x.allFinite()) seen[p].push_back(x);
    }
    try {
      Equations q;
      r.pairs.push_back(fit(r.rig, pair.id, data.points, own, o, r.noise_px, q));
    } catch (const Error& error) {
      r.warnings.push_back(error.what());
    }
  }
  double sum = 0, count = 0;
  for (const auto& [point, places] : seen) {
    for (std::size_t i = 1; i < places.size(); ++i) {
      sum += (places[i] - places[0]).squaredNorm();
      ++count;
    }
  }
  r.pair_disagreement_mm = std::sqrt(sum / count);
}

// The lasers of a rig move with its cameras. Their own uncertainty is not carried over, which is said.
void move_lasers(const Rig& rig, const Pose& room_from_rig, RoomResult& r) {
  for (const std::string& id : laser_ids(rig)) {
    try {
      LaserUnit unit = moved(laser_of(rig, id), room_from_rig);
      unit.camera = camera_index(r.rig, rig.cameras[static_cast<std::size_t>(unit.camera)].id);
      r.rig.document = rig_with_laser(r.rig, unit, r.rig.uncertainty);
    } catch (const Error& error) {
      r.warnings.push_back("laser " + in_quotes(id) + " is not in the result: " + error.what());
      continue;
    }
    r.warnings.push_back("laser " + in_quotes(id) +
                         " has been moved; what its calibration leaves uncertain is no longer stated");
  }
}

RoomResult solve_room(const std::vector<const Rig*>& rigs, const CalibrationData& data, const RoomOptions& o) {
  constexpr double kDefaultNoise = 0.1, kWorse = 2.5;
  RoomResult r;
  r.rig.id = o.rig_id.empty() ? rigs[0]->id : o.rig_id;
  r.rig.room = o.room.empty() ? "IEC 61217 fixed, mm" : o.room;
  for (const Rig* rig : rigs) r.noise_px = std::max(r.noise_px, rig->uncertainty.residual_px);
  r.noise_px = o.noise_px > 0 ? o.noise_px : r.noise_px > 0 ? r.noise_px : kDefaultNoise;
  for (const Rig* rig : rigs) {
    std::vector<RigSight> own = sights_of(*rig, data);
    Equations q;
    r.rigs.push_back(fit(*rig, rig->id, data.points, own, o, r.noise_px, q));
    for (const RigSight& s : own) {
      if (!s.used)
        r.discarded.push_back(
            {data.sights[s.sight].camera, 0, s.point, kNaN, "does not fit the other points of the phantom"});
    }
    const double chi = std::sqrt(q.square / std::max(1, q.rows - 6));
    if (chi > kWorse)
      r.warnings.push_back("rig " + in_quotes(rig->id) + ": the phantom's points are off by " + rounded(chi, 1) +
                           " times what noise and tolerance let expect (" + rounded(r.rigs.back().rms_px, 2) +
                           " px RMS)");
    add_to_room(*rig, r.rigs.back(), q, r.rig);
  }
  compare_pairs(data, o, r);
  for (std::size_t i = 0; i < rigs.size(); ++i) move_lasers(*rigs[i], r.rigs[i].rig_from_room.inverse(), r);
  return r;
}

}  // namespace

RoomResult room_from_phantom(const Run& run, const std::vector<const Rig*>& rigs, const CalibrationData& data,
                             const RoomOptions& options) {
  check_phantom(rigs, data);
  run.poll(0, "room");
  try {
    return solve_room(rigs, data, options);
  } catch (const Error& error) {
    if (error.status() < Status::kInsufficientData || error.status() >= Status::kCancelled) throw;
    RoomResult r;
    r.status = error.status();
    r.message = error.what();
    return r;
  }
}

}  // namespace sgrt
