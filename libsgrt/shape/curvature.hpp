// Curvature at every point of a surface (cloud, organised grid, mesh) with its uncertainty, at a scale that is chosen
// by predicted error: what the noise does to a small disc against what the change of shape does to a large one. Lepski
// (1991) in spirit; docs/theory/curvature.md eq. 14-18.
#pragma once

#include <limits>
#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"
#include "shape/forms.hpp"
#include "shape/grain.hpp"

namespace sgrt {

struct CurvatureOptions {
  int degree = 2;          // of the local fit, 2 to 4
  double radius = 0;       // mm, of its disc; 0: chosen
  double max_radius = 25;  // mm, of a chosen one
  double noise = 0;        // mm, one sigma along the normal; 0: the surface's own, or measured
  double max_sigma = 0.1;  // 1/mm, of the mean curvature; above it nothing is said
};

// The numbers are those of SGRT_CURVATURE_... reasons in sgrt.h.
enum class CurvatureReason : std::uint8_t {
  kNone = 0,
  kAbsent = 1,     // no point
  kNoNormal = 2,   // the point has no normal: what is outward is not known
  kTooFew = 3,     // fewer neighbours than unknowns, or on a line
  kBorder = 4,     // neighbours on one side only: a border or a hole
  kDisagree = 5,   // neighbours in the same sheet have the opposite normal
  kNotASheet = 6,  // the neighbours are no height over any plane
  kTooNoisy = 7    // sigma of the mean curvature above max_sigma
};
constexpr int kCurvatureReasons = 8;

struct CurvatureField {
  std::int64_t height = 0, width = 0;  // of the grid; 0 otherwise
  Eigen::VectorXd k1, k2, mean, gauss, shape_index, curvedness;
  Eigen::VectorXd sigma_k1, sigma_k2, sigma_mean, sigma_gauss, sigma_shape_index;
  Eigen::VectorXd radius;  // mm, of the disc
  Points normals, d1, d2;  // of the fitted surface
  std::vector<std::uint8_t> reason, hk;
  double spacing = std::numeric_limits<double>::quiet_NaN();  // mm: a point stands for its square
  double noise = std::numeric_limits<double>::quiet_NaN();    // mm: the median of the points' sigma that was used
  std::int64_t known = 0, duplicates = 0;
  std::int64_t count[kCurvatureReasons] = {};
};

// In the order of SGRT_CURVATURE_K1 ... SGRT_CURVATURE_RADIUS, and SGRT_CURVATURE_NORMALS ... SGRT_CURVATURE_D2.
inline constexpr Eigen::VectorXd CurvatureField::*kCurvatureNumbers[] = {&CurvatureField::k1,
                                                                         &CurvatureField::k2,
                                                                         &CurvatureField::mean,
                                                                         &CurvatureField::gauss,
                                                                         &CurvatureField::shape_index,
                                                                         &CurvatureField::curvedness,
                                                                         &CurvatureField::sigma_k1,
                                                                         &CurvatureField::sigma_k2,
                                                                         &CurvatureField::sigma_mean,
                                                                         &CurvatureField::sigma_gauss,
                                                                         &CurvatureField::sigma_shape_index,
                                                                         &CurvatureField::radius};
inline constexpr Points CurvatureField::*kCurvatureVectors[] = {&CurvatureField::normals, &CurvatureField::d1,
                                                                &CurvatureField::d2};

// The surface needs normals (kInvalidArgument otherwise).
CurvatureField surface_curvature(const Run& run, const Surface& surface, const CurvatureOptions& options);

// The same on the surface's own grain, which several calls may share; options.noise is not asked.
CurvatureField surface_curvature(const Run& run, const Surface& surface, const Grain& grain,
                                 const CurvatureOptions& options);

}  // namespace sgrt
