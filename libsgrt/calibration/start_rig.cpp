// The rig along shared placements, see calibration/start.hpp: a tree that takes the pair of cameras with most
// placements in common first; a pair's relative pose is the one that most of those placements agree with.
#include <algorithm>
#include <cmath>
#include <map>

#include "calibration/start.hpp"
#include "calibration/views.hpp"
#include "core/error.hpp"
#include "core/median.hpp"

namespace sgrt {
namespace {

struct Seen {
  std::size_t view;
  Pose camera_from_target;
};
using ByPlacement = std::vector<std::map<int, Seen>>;  // one map a camera

// The target's own half turn about its middle, as a motion of the target.
Pose half_turn(const Target& target) {
  Pose turn;
  turn.R = Vec3(-1, -1, 1).asDiagonal();
  turn.t = Vec3(2 * target.centre.x(), 2 * target.centre.y(), 0);
  return turn;
}

// How far apart two motions take the target: mm at its rim.
double apart(const Pose& a, const Pose& b, double radius) {
  const Pose d = a.inverse() * b;
  return d.t.norm() + radius * so3_log(d.R).norm();
}

// The candidate that is closest to most others.
Pose consensus(const std::vector<Pose>& candidates, double radius) {
  double best = std::numeric_limits<double>::infinity();
  Pose chosen;
  for (const Pose& a : candidates) {
    double sum = 0;
    for (const Pose& b : candidates) sum += std::min(apart(a, b, radius), radius);
    if (sum >= best) continue;
    best = sum;
    chosen = a;
  }
  return chosen;
}

// i_from_j by the placements that both see: the candidate closest to most others, half turns tried where they may be.
Pose relative_pose(const std::map<int, Seen>& i, const std::map<int, Seen>& j, const Target& target, bool ambiguous) {
  std::vector<Pose> candidates;
  for (const auto& [placement, seen] : i) {
    const auto other = j.find(placement);
    if (other == j.end()) continue;
    candidates.push_back(seen.camera_from_target * other->second.camera_from_target.inverse());
    if (ambiguous)
      candidates.push_back(seen.camera_from_target * half_turn(target) * other->second.camera_from_target.inverse());
  }
  return consensus(candidates, 2 * target.half_size);
}

int shared_count(const std::map<int, Seen>& a, const std::map<int, Seen>& b) {
  return static_cast<int>(std::count_if(a.begin(), a.end(), [&](const auto& item) { return b.count(item.first) > 0; }));
}

void link_cameras(const CalibrationData& data, const Target& target, const ByPlacement& seen, Scene& scene) {
  const std::size_t n = scene.cameras.size();
  std::vector<bool> linked(n, false);
  linked[0] = true;
  scene.cameras[0].camera_from_room = Pose{};
  for (std::size_t step = 1; step < n; ++step) {
    int most = 0;
    std::size_t from = 0, to = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        const int count = linked[i] && !linked[j] ? shared_count(seen[i], seen[j]) : 0;
        if (count <= most) continue;
        most = count;
        from = i;
        to = j;
      }
    }
    if (most == 0) {
      std::string lost;
      for (std::size_t j = 0; j < n; ++j) {
        if (!linked[j]) lost += (lost.empty() ? "" : ", ") + in_quotes(data.cameras[j].id);
      }
      fail(Status::kInsufficientData,
           "camera " + lost + ": not connected, no board placement is seen by it and by a camera that is linked to " +
               in_quotes(data.cameras[0].id));
    }
    scene.cameras[to].camera_from_room =
        relative_pose(seen[to], seen[from], target, data.half_turn_ambiguous) * scene.cameras[from].camera_from_room;
    linked[to] = true;
  }
}

double median_residual(const Target& target, const Scene& scene, const View& view) {
  Bundle bundle;
  bundle.target = target;
  std::vector<double> lengths;
  for (const Vec2& r : residuals_of(bundle, scene, view)) lengths.push_back(r.allFinite() ? r.norm() : 1e6);
  return median(lengths);
}

struct Renaming {
  std::vector<int> names;
  const char* word;
};

// A view that does not fit the rig as it is named, but does half-turned or mirrored.
// False: it is to be left out.
bool settle_view(const CalibrationData& data, const Target& target, const Scene& scene,
                 const std::vector<Renaming>& renamings, View& view, std::vector<Discarded>& discarded) {
  constexpr double kFar = 0.1,
                   kBetter = 0.2;  // of the spacing of the points in the image; how much better a renaming is
  const double as_named = median_residual(target, scene, view);
  double size = 0;
  for (const Vec2& p : view.pixel) size = std::max(size, (p - view.pixel[0]).norm());
  if (as_named < kFar * size / std::sqrt(static_cast<double>(view.pixel.size()))) return true;
  for (const Renaming& r : renamings) {
    const View other = renamed(view, r.names);
    if (median_residual(target, scene, other) > kBetter * as_named) continue;
    if (data.half_turn_ambiguous && r.word[0] == 'h') {
      view = other;
      return true;
    }
    discarded.push_back({view.camera, view.placement, -1, as_named,
                         std::string("the board is ") + r.word + " against what the other cameras see"});
    return false;
  }
  return true;
}

}  // namespace

Scene link_rig(const CalibrationData& data, const Target& target, std::vector<Mono>& alone,
               std::vector<Discarded>& discarded) {
  Scene scene;
  scene.room_from_target.resize(data.placements.size());
  ByPlacement seen;
  for (const Mono& mono : alone) {
    scene.cameras.push_back(mono.camera);
    auto& own = seen.emplace_back();
    for (std::size_t v = 0; v < mono.views.size(); ++v) own[mono.views[v].placement] = {v, mono.camera_from_target[v]};
  }
  link_cameras(data, target, seen, scene);
  for (std::size_t p = 0; p < data.placements.size(); ++p) {
    std::vector<Pose> candidates;
    for (std::size_t c = 0; c < alone.size(); ++c) {
      const auto found = seen[c].find(static_cast<int>(p));
      if (found == seen[c].end()) continue;
      candidates.push_back(scene.cameras[c].camera_from_room.inverse() * found->second.camera_from_target);
    }
    if (!candidates.empty()) scene.room_from_target[p] = consensus(candidates, 2 * target.half_size);
  }
  if (alone.size() == 1) return scene;
  std::vector<Renaming> renamings;
  for (const auto& [sx, sy, word] :
       {std::tuple(-1, -1, "half-turned"), std::tuple(-1, 1, "mirrored"), std::tuple(1, -1, "mirrored")}) {
    const std::vector<int> names = symmetry_of(target, sx, sy);
    if (!names.empty()) renamings.push_back({names, word});
  }
  for (Mono& mono : alone) {
    const auto lost = [&](View& view) { return !settle_view(data, target, scene, renamings, view, discarded); };
    mono.views.erase(std::remove_if(mono.views.begin(), mono.views.end(), lost), mono.views.end());
  }
  return scene;
}

}  // namespace sgrt
