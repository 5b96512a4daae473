// Helpers of the C++ tests: an expected sgrt::Error with its status and words of its message, and random draws.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "core/eigen.hpp"
#include "core/error.hpp"

namespace sgrt::test {

template <class Call>
void expect_error(Status status, const std::string& words, Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(static_cast<int>(error.status()), static_cast<int>(status)) << message;
    EXPECT_NE(message.find(words), std::string::npos) << "'" << message << "' lacks '" << words << "'";
    EXPECT_EQ(message.find('\n'), std::string::npos) << "more than one line: " << message;
    return;
  }
  ADD_FAILURE() << "no error, expected one with '" << words << "'";
}

// Seeded draws; the same on every machine.
class Draw {
 public:
  explicit Draw(unsigned seed) : engine_(seed) {}
  double uniform(double low = -1, double high = 1) { return low + (high - low) * (engine_() / 18446744073709551616.0); }
  Vec3 vec3(double scale = 1) { return scale * Vec3(uniform(), uniform(), uniform()); }
  Vec3 direction() {
    Vec3 v;
    do v = vec3();
    while (v.norm() > 1 || v.norm() < 0.1);
    return v.normalized();
  }
  std::uint64_t bits() { return engine_(); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace sgrt::test
