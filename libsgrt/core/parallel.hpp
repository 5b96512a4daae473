// Blocks of work on the context's threads. Blocks have a fixed size and sums are added in block order, so results have
// the same bits whatever the number of threads. An exception in a block stops the rest; the one of the lowest block
// comes out. Inside a block a further parallel_for runs on the thread that calls it.
#pragma once

#include <atomic>
#include <cstdint>

#include "core/run.hpp"

namespace sgrt {

// True on a thread that does blocks for another one: there Run::poll does nothing.
bool on_worker_thread();

// Worker threads, started at the first use and again after a fork. Concurrent calls queue. If the system refuses a
// thread the work is done with fewer. threads: in all, the calling one included.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  int threads() const { return threads_; }

  using Block = void (*)(void* body, std::int64_t begin, std::int64_t end);
  // Runs every block of [0, n); the calling thread works too, and polls `run` between its blocks.
  void for_blocks(const Run& run, std::int64_t n, std::int64_t block, Block call, void* body, const char* stage);

 private:
  struct State;  // everything that a fork must abandon
  State& state();
  int threads_;
  std::atomic<State*> state_{nullptr};
};

// body(begin, end) for each block of `block` indices of [0, n). Choose a block of 1 to 5 ms: progress is polled between
// blocks.
template <class Body>
void parallel_for(const Run& run, std::int64_t n, std::int64_t block, Body&& body, const char* stage = "working");

// The sum of body(begin, end) over the blocks, added in block order to `zero`.
template <class Sum, class Body>
Sum parallel_sum(const Run& run, std::int64_t n, std::int64_t block, const Sum& zero, Body&& body,
                 const char* stage = "working");

}  // namespace sgrt

#include "core/parallel.inl"
