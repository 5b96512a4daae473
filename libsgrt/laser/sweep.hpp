// The sweep of a laser fan over a body: frames in, one organised surface out, a column a mirror angle and a row a line
// of the image. A body that moves meanwhile is brought to one instant by its pose track. Brahme et al., "4D laser
// camera for accurate patient positioning" (2008). docs/theory/laser.md eq. 15-16.
#pragma once

#include <memory>

#include "core/pose_track.hpp"
#include "laser/column.hpp"

namespace sgrt {

struct LaserResult {
  Status status = Status::kOk;  // kOk, kNotFound or kDegenerate
  std::string message;
  int height = 0, width = 0;         // lines, frames
  std::shared_ptr<Surface> surface;  // organised
  std::vector<std::uint8_t> reason;
  std::vector<double> stripe_px;  // centre along the line
  std::vector<float> sigma_px;
  std::vector<double> angle, time;  // of each column
  std::array<std::int64_t, 16> reason_count{};
  std::int64_t point_count = 0;
  bool columns = false;  // lines are the image's columns
  double median_sigma_px = 0, median_sigma_mm = 0, reference_time = 0;
};

class Sweep {
 public:
  Sweep(const Rig& rig, const LaserUnit& unit, const LaserOptions& options);
  // Readings in any order, none twice; times must not run backwards.
  const Column& push(const Run& run, const ImageView& image, const ImageView* dark, double reading, double time);
  std::size_t size() const { return columns_.size(); }
  // track: nullptr where the body lay still. reference_time: the instant that the surface shows; NaN: the first
  // frame's.
  LaserResult finish(const Run& run, const PoseTrack* track, double reference_time) const;

 private:
  Camera camera_;
  LaserUnit unit_;
  LaserOptions options_;
  LaserModes modes_;
  bool across_ = false;
  std::vector<Column> columns_;  // in the order of the pushes
};

// Normals of an organised sweep from planes through each point's neighbours, towards `viewpoint`; NaN where they fix
// none.
void set_grid_normals(const Run& run, const Vec3& viewpoint, Surface& surface);

}  // namespace sgrt
