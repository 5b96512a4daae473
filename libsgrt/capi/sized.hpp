// Sized structs: options in, results out. Their first member is `uint32_t struct_size`, set by the caller to the size
// that its header gave the struct, so that a struct can grow at its end. docs/abi.md, "How structs grow".
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

#include "core/error.hpp"

namespace sgrt {

// The size of a struct's first version: no smaller one was ever in a header. When a struct grows, specialise this with
// its size before.
template <class T>
constexpr std::size_t kFirstSize = sizeof(T);

template <class T>
void check_size(std::size_t size, const char* name) {
  static_assert(std::is_trivially_copyable_v<T> && std::is_standard_layout_v<T> && offsetof(T, struct_size) == 0);
  if (size >= kFirstSize<T> && size <= sizeof(T)) return;
  const std::string known = kFirstSize<T> == sizeof(T)
                                ? std::to_string(sizeof(T))
                                : std::to_string(kFirstSize<T>) + " to " + std::to_string(sizeof(T));
  fail(Status::kInvalidArgument, std::string(name) + ": " + std::to_string(size) +
                                     ", expected the struct's size in bytes as this library knows it, " + known);
}

// The size that a caller's struct says it has. Read by itself: an older caller's struct is no whole T.
template <class T>
std::uint32_t size_of(const T* given) {
  std::uint32_t size = 0;
  std::memcpy(&size, static_cast<const void*>(given), sizeof size);
  return size;
}

// Writes `defaults` as far as the caller's struct of `size` bytes goes.
template <class T>
void init_struct(T* out, std::size_t size, T defaults, const char* name) {
  if (!out) fail(Status::kInvalidArgument, std::string(name) + ": NULL, expected a struct to fill");
  check_size<T>(size, "size");
  defaults.struct_size = static_cast<std::uint32_t>(size);
  std::memcpy(static_cast<void*>(out), &defaults, size);
}

// The caller's struct, with `defaults` for what an older caller does not know; all of them when it is NULL.
template <class T>
T read_struct(const T* given, T defaults, const char* size_name) {
  if (!given) return defaults;
  check_size<T>(size_of(given), size_name);
  std::memcpy(static_cast<void*>(&defaults), given, size_of(given));
  return defaults;
}

// Before the work: refuses a result struct that write_struct could not fill. NULL is refused by the caller where it
// matters.
template <class T>
void check_result(const T* out, const char* size_name) {
  if (out) check_size<T>(size_of(out), size_name);
}

// Fills as much as the caller knows of; its struct_size stays. NULL: nothing.
template <class T>
void write_struct(T* out, T value) {
  if (!out) return;
  value.struct_size = size_of(out);
  std::memcpy(static_cast<void*>(out), &value, value.struct_size);
}

}  // namespace sgrt
