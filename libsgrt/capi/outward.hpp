// What curvature asks of a surface.
#pragma once

#include "capi/capi.hpp"

namespace sgrt {

inline void need_outward(const Surface& s, const char* name) {
  if (!s.has_normals())
    refuse(name, "a surface without normals", "normals, which say what is outward (see sgrt_surface_estimate_normals)");
}

}  // namespace sgrt
