// What landmarks of a body look like: named points, each with its curvature and its place among the others, and how far
// both may differ. Of any head, or made from a patient's own reference. docs/theory/landmarks.md, "Model".
#pragma once

#include <string>
#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct LandmarkPoint {
  std::string name;
  Vec3 position, normal;  // model frame, mm; unit, outward
  double k1, k2;          // 1/mm, at the model's scale
  double sigma;           // mm: how far the place may differ from patient to patient; small for one's own reference
  // mm2: how well the place is known as the extremum of the reference; nil in a model of all patients, whose sigma says
  // it
  Mat3 place_covariance = Mat3::Zero();
  Points patch;  // of the reference's skin about it, mm; none in a model of all patients
};

// +1: convex, a maximum of H; -1: concave.
inline int sign_of(const LandmarkPoint& p) {
  return p.k1 + p.k2 > 0 ? 1 : -1;
}

// Where there is skin that has no landmark: what keeps a face from fitting a neck.
struct SkinPlace {
  Vec3 position, normal;  // as a landmark's
  double sigma;           // mm, along the normal, from patient to patient
};

struct LandmarkModel {
  std::string id;
  double scale = 6;          // mm: radius of the disc at which the curvatures hold
  double size_range = 0;     // the body may be larger or smaller by this share
  double patch_spacing = 0;  // mm, of the patches' points
  double patch_sigma = 0;    // mm, of the reference's own surface under them
  std::vector<LandmarkPoint> points;
  std::vector<SkinPlace> skin;
};

constexpr std::size_t kMaxLandmarks = 64;

// Throws unless the model is sound (kFormat).
void check_model(const LandmarkModel& model);

// Schema "sgrt-landmark-model/1" (docs/formats.md).
std::string model_to_json(const LandmarkModel& model);
LandmarkModel model_from_json(const char* text, std::size_t size);

// Any adult head: nose_apex, ala_left, ala_right, nasion, nasolabial_left ... (docs/formats.md).
LandmarkModel head_model();

struct LearnOptions {
  int count = 12;     // of the most distinctive points, where none are named
  double scale = 0;   // mm; 0: from the surface's noise
  double patch = 14;  // mm, radius of a patch
};

// From a reference: its most distinctive points (p01, p02 ...), or those of `named`, which must be found on it. The
// surface must have normals. kNotFound: fewer than 4 points stand out (flat skin), or `named` is not there.
LandmarkModel learn_model(const Run& run, const Surface& reference, const LandmarkModel* named,
                          const LearnOptions& options);

}  // namespace sgrt
