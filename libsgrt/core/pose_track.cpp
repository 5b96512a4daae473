#include "core/pose_track.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace sgrt {

void check_track(const PoseTrack& track) {
  if (track.time.empty() || track.time.size() != track.room_from_body.size())
    fail(Status::kInvalidArgument, "poses: " + std::to_string(track.time.size()) + " times and " +
                                       std::to_string(track.room_from_body.size()) +
                                       " poses, expected at least one of each");
  for (std::size_t i = 0; i < track.time.size(); ++i) {
    if (std::isfinite(track.time[i]) && (i == 0 || track.time[i] > track.time[i - 1])) continue;
    fail(Status::kInvalidArgument,
         "poses: time " + std::to_string(i) + " is " + text_of(track.time[i]) + ", expected times that increase");
  }
}

Pose pose_at(const PoseTrack& track, double time) {
  const std::vector<double>& t = track.time;
  if (!(time >= t.front() && time <= t.back()))
    fail(Status::kInvalidArgument, "poses: none at time " + text_of(time) + ", the track runs from " +
                                       text_of(t.front()) + " to " + text_of(t.back()));
  const auto after = static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), time) - t.begin());
  const Pose& b = track.room_from_body[after];
  if (t[after] == time) return b;
  const Pose& a = track.room_from_body[after - 1];
  const double share = (time - t[after - 1]) / (t[after] - t[after - 1]);
  return a * se3_exp(share * se3_log(a.inverse() * b));
}

}  // namespace sgrt
