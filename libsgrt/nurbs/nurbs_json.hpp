// nurbs.json, schema sgrt-nurbs/1, in memory. docs/theory/nurbs.md, "File".
#pragma once

#include <cstddef>
#include <string>

#include "nurbs/curve.hpp"
#include "nurbs/surface.hpp"

namespace sgrt {

// Strict: throws kFormat naming the field; kLimit above 16 MiB. Keys that are not understood are ignored.
NurbsCurve curve_from_json(const char* text, std::size_t size);
NurbsSurface surface_from_json(const char* text, std::size_t size);
std::string to_json(const NurbsCurve& curve);
std::string to_json(const NurbsSurface& surface);

}  // namespace sgrt
