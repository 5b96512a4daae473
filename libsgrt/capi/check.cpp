// Checks of arguments; see check.hpp.
#include "capi/check.hpp"

#include <cmath>

#include "core/error.hpp"
#include "core/surface.hpp"

namespace sgrt {

void refuse(const char* name, const std::string& value, const std::string& expected) {
  fail(Status::kInvalidArgument, std::string(name) + ": " + value + ", expected " + expected);
}

void need(const void* pointer, const char* name) {
  if (!pointer) refuse(name, "NULL", "a pointer to it");
}

void check_range(double value, double low, double high, const char* name) {
  if (!(value >= low && value <= high)) refuse(name, text_of(value), text_of(low) + " to " + text_of(high));
}

void check_positive(double value, double high, const char* name) {
  if (!(value > 0 && value <= high)) refuse(name, text_of(value), "more than 0, at most " + text_of(high));
}

void check_reserved(std::int32_t value, const char* name) {
  if (value != 0) refuse(name, std::to_string(value), "0");
}

void check_finite(const double* values, int count, const char* name) {
  for (int i = 0; i < count; ++i) {
    if (std::isfinite(values[i])) continue;
    refuse((std::string(name) + "[" + std::to_string(i) + "]").c_str(), text_of(values[i]), "a finite number");
  }
}

void check_place(const double* mm, int count, const char* name) {
  check_finite(mm, count, name);
  for (int i = 0; i < count; ++i) {
    if (std::abs(mm[i]) <= kMaxCoordinate) continue;
    refuse((std::string(name) + "[" + std::to_string(i) + "]").c_str(), text_of(mm[i]),
           text_of(-kMaxCoordinate) + " to " + text_of(kMaxCoordinate) + " mm");
  }
}

Vec3 place(const double* mm, const char* name) {
  need(mm, name);
  check_place(mm, 3, name);
  return Vec3(mm[0], mm[1], mm[2]);
}

Pose rigid(const double* rows, const char* name) {
  need(rows, name);
  check_finite(rows, 16, name);
  for (int i : {3, 7, 11}) {
    if (std::abs(rows[i]) <= kMaxCoordinate) continue;
    refuse((std::string(name) + "[" + std::to_string(i) + "]").c_str(), text_of(rows[i]),
           text_of(-kMaxCoordinate) + " to " + text_of(kMaxCoordinate) + " mm");
  }
  return pose_from_rows(rows, name);
}

}  // namespace sgrt
