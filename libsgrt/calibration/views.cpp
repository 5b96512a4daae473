// Correspondences to views, see calibration/views.hpp.
#include "calibration/views.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "core/error.hpp"
#include "core/within.hpp"

namespace sgrt {
namespace {

constexpr int kFewest = 6;  // points of a view: four fix its pose, the others say whether it is right

[[noreturn]] void refuse(const std::string& name, const std::string& got) {
  fail(Status::kInvalidArgument, name + ": " + got);
}

std::string at(const char* name, std::size_t i) {
  return name + ("[" + std::to_string(i) + "]");
}

void check_cameras(const CalibrationData& data) {
  constexpr std::size_t kMost = 64;
  constexpr int kLargestSide = 32768;
  if (data.cameras.empty()) refuse("cameras", "none, expected at least one");
  if (data.cameras.size() > kMost)
    fail(Status::kLimit, "cameras: " + std::to_string(data.cameras.size()) + ", expected at most 64");
  std::set<std::string> ids;
  for (std::size_t i = 0; i < data.cameras.size(); ++i) {
    const CalibrationCamera& camera = data.cameras[i];
    if (camera.id.empty()) refuse(at("cameras", i), "an empty id");
    if (!ids.insert(camera.id).second) refuse(at("cameras", i), in_quotes(camera.id) + " stands twice");
    for (int side : {camera.width, camera.height}) {
      if (side < 16 || side > kLargestSide)
        refuse(at("cameras", i), "an image side of " + std::to_string(side) + " px, expected 16 to 32768");
    }
  }
  ids.clear();
  for (std::size_t i = 0; i < data.pairs.size(); ++i) {
    const StereoPair& pair = data.pairs[i];
    const int count = static_cast<int>(data.cameras.size());
    if (pair.id.empty() || !ids.insert(pair.id).second) refuse(at("pairs", i), "its id is empty or stands twice");
    if (pair.left < 0 || pair.right < 0 || pair.left >= count || pair.right >= count || pair.left == pair.right)
      refuse(at("pairs", i), "expected two different cameras, 0 to " + std::to_string(count - 1));
  }
}

void check_points(const Points& points) {
  constexpr double kLargest = 1e5, kFlat = 0.02;
  if (points.rows() < kFewest)
    refuse("points", std::to_string(points.rows()) + " of them, expected at least " + std::to_string(kFewest));
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!within(points.row(i), kLargest))
      refuse(at("points", static_cast<std::size_t>(i)), "expected finite coordinates within 1e5 mm");
  }
  const Eigen::Vector3d size = points.colwise().maxCoeff() - points.colwise().minCoeff();
  if (!(size.head<2>().minCoeff() > 0)) refuse("points", "expected a flat target that extends along its x and y");
  if (size.z() > kFlat * size.head<2>().maxCoeff())
    refuse("points", "z extends over " + text_of(size.z()) + " mm, expected a flat target, z = 0");
}

bool same_image(const View& a, const View& b) {
  return a.camera == b.camera && a.index == b.index && a.pixel == b.pixel;
}

}  // namespace

void check_sights(const CalibrationData& data) {
  const int cameras = static_cast<int>(data.cameras.size()), placements = static_cast<int>(data.placements.size());
  for (std::size_t i = 0; i < data.sights.size(); ++i) {
    const Sight& s = data.sights[i];
    const auto index = [&](const char* what, int value, Eigen::Index count) {
      if (value < 0 || value >= count)
        refuse(at("index", i),
               std::string(what) + " " + std::to_string(value) + ", expected 0 to " + std::to_string(count - 1));
    };
    index("camera", s.camera, cameras);
    index("placement", s.placement, placements);
    index("point", s.point, data.points.rows());
    const CalibrationCamera& camera = data.cameras[static_cast<std::size_t>(s.camera)];
    if (!(s.pixel.x() >= -1 && s.pixel.x() <= camera.width && s.pixel.y() >= -1 && s.pixel.y() <= camera.height))
      refuse(at("pixels", i), text_of(s.pixel.x()) + " " + text_of(s.pixel.y()) +
                                  ", expected a place in the image of " + in_quotes(camera.id) + ", " +
                                  std::to_string(camera.width) + " x " + std::to_string(camera.height));
    if (!(s.sigma > 0 && s.sigma <= 1e3))
      refuse(at("sigma", i), text_of(s.sigma) + ", expected more than 0, at most 1000");
  }
}

void check_data(const CalibrationData& data) {
  check_cameras(data);
  check_points(data.points);
  std::set<std::string> names(data.placements.begin(), data.placements.end());
  if (names.size() != data.placements.size()) refuse("placements", "a name stands twice");
  check_sights(data);
}

std::vector<View> views_of(const CalibrationData& data, std::vector<Discarded>& discarded) {
  std::map<std::pair<int, int>, std::map<int, const Sight*>> sorted;  // by placement and camera
  std::vector<int> order(data.placements.size()), rank(data.placements.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return data.placements[a] < data.placements[b]; });
  for (std::size_t i = 0; i < order.size(); ++i) rank[order[i]] = static_cast<int>(i);
  for (const Sight& s : data.sights) {
    if (!sorted[{rank[s.placement], s.camera}].emplace(s.point, &s).second)
      refuse("index", "camera " + in_quotes(data.cameras[s.camera].id) + " sees point " + std::to_string(s.point) +
                          " twice in placement " + in_quotes(data.placements[s.placement]));
  }
  std::vector<View> views;
  for (const auto& [key, sights] : sorted) {
    View view{key.second, order[key.first], {}, {}, {}, {}};
    for (const auto& [point, sight] : sights) {
      view.index.push_back(point);
      view.pixel.push_back(sight->pixel);
      view.sigma.push_back(sight->sigma);
      view.weight.push_back(1);
    }
    const auto first = std::find_if(views.begin(), views.end(), [&](const View& v) { return same_image(v, view); });
    const auto drop = [&](const std::string& why) {
      discarded.push_back({view.camera, view.placement, -1, std::nan(""), why});
    };
    if (static_cast<int>(view.index.size()) < kFewest) {
      drop("only " + std::to_string(view.index.size()) + " points, at least 6 are needed");
    } else if (first != views.end()) {
      drop("the same image as " + data.placements[first->placement]);
    } else {
      views.push_back(std::move(view));
    }
  }
  return views;
}

std::vector<int> symmetry_of(const Target& target, double sx, double sy) {
  constexpr double kNear = 1e-3;  // of the half size
  const Eigen::Index n = target.points.rows();
  std::vector<int> names;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec2 at = target.points.row(i).head<2>().transpose() - target.centre;
    const Vec2 wanted = target.centre + Vec2(sx * at.x(), sy * at.y());
    Eigen::Index nearest;
    const double distance =
        (target.points.leftCols<2>().rowwise() - wanted.transpose()).rowwise().norm().minCoeff(&nearest);
    if (distance > kNear * target.half_size) return {};
    names.push_back(static_cast<int>(nearest));
  }
  return names;
}

View renamed(const View& view, const std::vector<int>& names) {
  View out = view;
  for (int& i : out.index) i = names[static_cast<std::size_t>(i)];
  return out;
}

}  // namespace sgrt
