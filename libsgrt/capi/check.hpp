// Checks of arguments. Each throws kInvalidArgument with one line "name: value, expected ..."; nothing is allocated
// unless it throws.
#pragma once

#include <cstdint>
#include <string>

#include "core/geometry.hpp"

namespace sgrt {

[[noreturn]] void refuse(const char* name, const std::string& value, const std::string& expected);

// Not NULL.
void need(const void* pointer, const char* name);
void check_range(double value, double low, double high, const char* name);  // low and high are fine, NaN is not
void check_positive(double value, double high, const char* name);           // 0 < value <= high
void check_reserved(std::int32_t value, const char* name);                  // 0
// `count` numbers called name[0], name[1] ...
void check_finite(const double* values, int count, const char* name);
// A place: finite and within kMaxCoordinate.
void check_place(const double* mm, int count, const char* name);

Vec3 place(const double* mm, const char* name);    // three numbers; not NULL
Pose rigid(const double* rows, const char* name);  // sixteen numbers, row-major; not NULL

}  // namespace sgrt
