// Landmarks of a model located on a live surface: extrema of curvature are matched to the model's by their mutual
// geometry, whatever the pose; each place is then refined, with its covariance. docs/theory/landmarks.md.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/geometry.hpp"
#include "shape/grain.hpp"
#include "shape/landmark_model.hpp"

namespace sgrt {

struct LocateOptions {
  double min_score = 0.6;  // of the whole match
  int min_points = 4;      // that must match an extremum each
  double noise = 0;        // mm; 0: the surface's own, or measured
};

struct Landmark {
  bool found = false;                                                          // the skin is there; NaN otherwise
  Vec3 position = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());    // mm
  Mat3 covariance = Mat3::Constant(std::numeric_limits<double>::quiet_NaN());  // mm2
  // Against the model's own place: without the error of that place as an extremum of the body.
  Mat3 repeat_covariance = Mat3::Constant(std::numeric_limits<double>::quiet_NaN());
  double score = 0;  // 0 to 1: how well an extremum of its kind fits
};

struct LocatedLandmarks {
  Status status = Status::kOk;  // kNotFound: the numbers are NaN
  std::string message;
  std::vector<std::string> names;
  std::vector<Landmark> points;  // of the model's, in its order
  Pose live_from_model;
  double size = 1;  // of the body over the model's
  double score = 0, runner_up_score = 0;
  double scale = 0;  // mm, radius at which curvature was taken
  double noise = 0;  // mm
  int candidates = 0, matched = 0, seen = 0;
};

// The surface must have normals.
LocatedLandmarks locate(const Run& run, const Surface& live, const LandmarkModel& model, const LocateOptions& options);
// The same on the surface's own grain (see make_landmark_scene); options.noise is not asked.
LocatedLandmarks locate(const Run& run, const Surface& live, const Grain& grain, const LandmarkModel& model,
                        const LocateOptions& options);

}  // namespace sgrt
