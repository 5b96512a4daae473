// A surface as landmarks see it: curvature at one scale and the places that stand out.
#pragma once

#include <vector>

#include "core/nearest.hpp"
#include "shape/curvature.hpp"
#include "shape/extrema.hpp"
#include "shape/jet.hpp"

namespace sgrt {

struct Candidate {
  Vec3 x, n;
  int sign;
  double k1, k2, mean, sigma;  // sigma: of the mean curvature
  double persistence;
};

struct LandmarkScene {
  const Surface* surface;
  const Grain* grain;
  double scale;  // mm
  // At the scale and, once `widen` is asked for, at wider ones: an extremum takes the one of the least predicted error.
  std::vector<CurvatureField> rungs;
  Nearest nearest;  // of all points
  std::vector<Candidate> candidates;

  const CurvatureField& field() const { return rungs[0]; }
};

// scale: the least radius of the curvature; it is widened until the noise leaves a sigma of kWanted. Surface and grain
// (of degree kLandmarkDegree) must outlive the scene.
constexpr int kLandmarkDegree = 2;
LandmarkScene make_landmark_scene(const Run& run, const Surface& surface, const Grain& grain, double scale);
// The wider scales, which `polish` wants.
void widen(const Run& run, LandmarkScene& scene);

// The extremum of sign * H near x, by a quadric through the curvature about it, at the scale of the least predicted
// error; covariance of noise and of the bias of that scale. found: false where there is no extremum within reach.
struct Peak {
  bool found = false;
  Vec3 x;
  Mat3 covariance;
};
Peak polish(const Run& run, const LandmarkScene& scene, const Vec3& x, const Vec3& normal, int sign);

}  // namespace sgrt
