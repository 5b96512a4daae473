// The thread pool. Blocks are handed out in order by an atomic counter, so when block i fails every lower block has
// been taken and will be done: the lowest failing block is the same at any number of threads. A worker that wakes too
// late for a job finds it closed and sleeps on; nobody waits for it.
#include "core/parallel.hpp"

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace sgrt {
namespace {

constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
constexpr std::chrono::milliseconds kPollEvery{5};
constexpr int kSpins = 300;  // about 10 us: shorter than a sleep and a wake, harmless where cores are short

enum class Role { kOutside, kCaller, kWorker };
thread_local Role role = Role::kOutside;

// The calling thread counts as inside a block while it works.
struct RoleScope {
  Role before = role;
  explicit RoleScope(Role now) { role = now; }
  ~RoleScope() { role = before; }
};

void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

struct Job {
  ThreadPool::Block call = nullptr;
  void* body = nullptr;
  std::int64_t n = 0, block = 1, blocks = 0;
};

void run_block(const Job& job, std::int64_t i) {
  const std::int64_t begin = i * job.block;
  job.call(job.body, begin, job.block < job.n - begin ? begin + job.block : job.n);
}

void run_inline(const Run& run, const Job& job, const char* stage) {
  for (std::int64_t i = 0; i < job.blocks; ++i) {
    run.poll(static_cast<double>(i) / static_cast<double>(job.blocks), stage);
    run_block(job, i);
  }
}

}  // namespace

struct ThreadPool::State {
  const pid_t process = getpid();
  std::mutex mutex;  // guards all that is not atomic
  std::condition_variable wake, done, free;
  std::vector<std::thread> workers;
  bool refused = false;  // the system gave no further thread
  bool stop = false;
  bool busy = false;  // a call owns the pool
  bool open = false;  // workers may join the job
  Job job;
  std::exception_ptr error;
  std::atomic<std::uint64_t> generation{0};
  std::atomic<int> active{0};  // workers in the job
  std::atomic<std::int64_t> next{0};
  std::atomic<std::int64_t> failed{kNone};  // the lowest failed block, -1 when cancelled: no block above it is begun

  void work();
  bool take(const Job& now);
  void own(const Run& run, int threads, const char* stage);
  void release();
  void record(std::int64_t block);
  void lead(const Run& run, const Job& now, const char* stage);
  void await_workers(const Run& run, std::int64_t blocks, const char* stage);
  void poll(const Run& run, std::int64_t blocks, const char* stage);
};

// Keeps the exception in flight if it is that of the lowest block so far.
void ThreadPool::State::record(std::int64_t block) {
  const std::lock_guard<std::mutex> lock(mutex);
  if (block < failed.load()) {
    failed = block;
    error = std::current_exception();
  }
}

// Does one block; false when none is left.
bool ThreadPool::State::take(const Job& now) {
  const std::int64_t i = next.fetch_add(1);
  if (i >= now.blocks || i > failed.load()) return false;
  try {
    run_block(now, i);
  } catch (...) {
    record(i);
  }
  return true;
}

void ThreadPool::State::work() {
  role = Role::kWorker;
  std::uint64_t seen = 0;
  for (;;) {
    for (int i = 0; i < kSpins && generation.load() == seen; ++i) pause();
    std::unique_lock<std::mutex> lock(mutex);
    wake.wait(lock, [&] { return stop || (open && generation.load() != seen); });
    if (stop) return;
    seen = generation.load();
    ++active;
    const Job now = job;
    lock.unlock();
    while (take(now)) {
    }
    lock.lock();
    if (--active == 0) done.notify_one();
  }
}

// Waits for the pool, then makes sure that it has its workers.
void ThreadPool::State::own(const Run& run, int threads, const char* stage) {
  std::unique_lock<std::mutex> lock(mutex);
  while (busy) {
    if (free.wait_for(lock, kPollEvery, [&] { return !busy; })) break;
    lock.unlock();
    run.poll(0, stage);
    lock.lock();
  }
  while (!refused && static_cast<int>(workers.size()) < threads - 1) {
    try {
      workers.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      refused = true;
    }
  }
  busy = true;
}

void ThreadPool::State::release() {
  const std::lock_guard<std::mutex> lock(mutex);
  busy = false;
  free.notify_one();
}

void ThreadPool::State::poll(const Run& run, std::int64_t blocks, const char* stage) {
  if (failed.load() != kNone) return;
  try {
    run.poll(static_cast<double>(std::min(next.load(), blocks)) / static_cast<double>(blocks), stage);
  } catch (...) {
    record(-1);
  }
}

void ThreadPool::State::await_workers(const Run& run, std::int64_t blocks, const char* stage) {
  for (int i = 0; i < kSpins && active.load() > 0; ++i) pause();
  std::unique_lock<std::mutex> lock(mutex);
  open = false;
  while (!done.wait_for(lock, kPollEvery, [&] { return active.load() == 0; })) {
    lock.unlock();
    poll(run, blocks, stage);
    lock.lock();
  }
}

// The calling thread's part of a job.
void ThreadPool::State::lead(const Run& run, const Job& now, const char* stage) {
  {
    const std::lock_guard<std::mutex> lock(mutex);
    job = now;
    next = 0;
    failed = kNone;
    error = nullptr;
    open = true;
    ++generation;
  }
  wake.notify_all();
  const RoleScope scope(Role::kCaller);
  do {
    poll(run, now.blocks, stage);
  } while (take(now));
  await_workers(run, now.blocks, stage);
}

bool on_worker_thread() {
  return role == Role::kWorker;
}

ThreadPool::ThreadPool(int threads) : threads_(threads) {
  require(threads >= 1, "threads: expected at least 1");
}

ThreadPool::~ThreadPool() {
  State* state = state_.load();
  if (!state || state->process != getpid()) return;  // a fork's copy: its threads and locks are gone, leave it
  {
    const std::lock_guard<std::mutex> lock(state->mutex);
    state->stop = true;
  }
  state->wake.notify_all();
  for (std::thread& worker : state->workers) worker.join();
  delete state;
}

ThreadPool::State& ThreadPool::state() {
  State* now = state_.load();
  if (now && now->process == getpid()) return *now;
  auto fresh = std::make_unique<State>();
  if (state_.compare_exchange_strong(now, fresh.get())) return *fresh.release();
  return *now;  // another thread was first
}

void ThreadPool::for_blocks(const Run& run, std::int64_t n, std::int64_t block, Block call, void* body,
                            const char* stage) {
  require(block >= 1, "block: expected at least 1");
  if (n <= 0) return;
  const Job job{call, body, n, block, (n - 1) / block + 1};
  if (threads_ == 1 || job.blocks == 1 || role != Role::kOutside) return run_inline(run, job, stage);
  State& pool = state();
  pool.own(run, threads_, stage);
  struct Release {
    State& state;
    ~Release() { state.release(); }
  } const release{pool};
  pool.lead(run, job, stage);
  if (pool.error) std::rethrow_exception(std::exchange(pool.error, nullptr));
}

namespace detail {

void run_blocks(const Run& run, std::int64_t n, std::int64_t block, ThreadPool::Block call, void* body,
                const char* stage) {
  if (run.pool) return run.pool->for_blocks(run, n, block, call, body, stage);
  require(block >= 1, "block: expected at least 1");
  if (n > 0) run_inline(run, {call, body, n, block, (n - 1) / block + 1}, stage);
}

}  // namespace detail
}  // namespace sgrt
