// A reference made ready once, so that each live surface that is laid on it costs only its own points.
// docs/theory/icp.md section 2.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/roi.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"
#include "registration/surfels.hpp"

namespace sgrt {

struct Reference {
  SurfelField field;
  bool has_normals = false;  // that the surface brought, so that their signs count
  bool has_roi = false;
  std::int64_t point_count = 0;   // that can take part
  float typical_height = 0;       // mm2, median variance of a surfel's height
  double correlation_points = 1;  // of the surface
  std::vector<std::string> mode_names;
  // Shared error modes: of each, level by level, 3 numbers a surfel.
  std::vector<std::vector<std::vector<float>>> modes;
};

// roi may be null: all of the surface counts. Throws kInsufficientData when fewer than 6 points can take part.
std::shared_ptr<const Reference> prepare_reference(const Run& run, const Surface& surface, const Roi* roi);

}  // namespace sgrt
