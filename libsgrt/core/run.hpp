// What one call may use: worker threads, an instruction set, and the caller's progress callback, which can cancel.
#pragma once

#include <cstdint>
#include <functional>

namespace sgrt {

class ThreadPool;

enum class Isa : std::int32_t { kAuto = 0, kBaseline = 1, kAvx2 = 2 };

// The best instruction set of this machine.
Isa detect_isa();

struct Run {
  ThreadPool* pool = nullptr;  // nullptr: the calling thread alone
  Isa isa = Isa::kBaseline;    // resolved, never kAuto
  // Called on the calling thread only; true cancels. Empty: never.
  std::function<bool(double fraction, const char* stage)> progress;
  std::function<void(int level, const char* message)> log;

  // Reports progress; throws Error{kCancelled} when the caller wants to stop. Does nothing on a worker thread.
  void poll(double fraction, const char* stage) const;
};

}  // namespace sgrt
