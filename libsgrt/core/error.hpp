// Errors of the core: one exception type that carries the ABI's status and a one-line message.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace sgrt {

// The same numbers as SGRT_... in sgrt.h; libsgrt/capi asserts it.
enum class Status : std::int32_t {
  kOk = 0,
  kInvalidArgument = 1,
  kFormat = 2,
  kInsufficientData = 10,
  kDegenerate = 11,
  kNotConverged = 12,
  kNotFound = 13,
  kCancelled = 20,
  kOutOfMemory = 21,
  kLimit = 22,
  kInternal = 23,
};

class Error : public std::runtime_error {
 public:
  Error(Status status, const std::string& message) : std::runtime_error(message), status_(status) {}
  Status status() const noexcept { return status_; }

 private:
  Status status_;
};

[[noreturn]] inline void fail(Status status, const std::string& message) {
  throw Error(status, message);
}

// Throws kInvalidArgument unless ok. The message names the argument, its value and what was expected.
inline void require(bool ok, const char* message) {
  if (!ok) fail(Status::kInvalidArgument, message);
}

// A number for a message: shortest text that reads back to the same value, whatever the locale.
std::string text_of(double value);

// A caller's text for a message: in quotes, one line of plain ASCII, at most 80 characters of it.
std::string in_quotes(const std::string& text);

}  // namespace sgrt
