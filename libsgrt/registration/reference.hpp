// A reference made ready once, so that each live surface that is laid on it costs only its own points.
// docs/theory/icp.md section 2.
#pragma once

#include <memory>
#include <optional>

#include "core/roi.hpp"
#include "core/run.hpp"
#include "core/surface.hpp"

namespace sgrt {

struct Reference {
  Surface surface;
  std::optional<Roi> roi;
};

// roi may be null: all of the surface counts. Throws kInsufficientData when fewer than 6 points can take part.
std::shared_ptr<const Reference> prepare_reference(const Run& run, const Surface& surface, const Roi* roi);

}  // namespace sgrt
