// The pool: same bits at every number of threads, exceptions, cancelling, nesting, queueing, forking.
#include "../../sanitizers.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/parallel.hpp"
#include "expect.hpp"

namespace sgrt {
namespace {

using test::expect_error;

Run run_with(ThreadPool& pool) {
  sgrt::Run run;
  run.pool = &pool;
  return run;
}

double harmonic(const Run& run, std::int64_t n, std::int64_t block) {
  return parallel_sum(run, n, block, 0.0, [](std::int64_t begin, std::int64_t end) {
    double sum = 0;
    for (std::int64_t i = begin; i < end; ++i) sum += std::sin(static_cast<double>(i)) / (1.0 + static_cast<double>(i));
    return sum;
  });
}

std::uint64_t bits(double x) {
  std::uint64_t b;
  std::memcpy(&b, &x, sizeof b);
  return b;
}

int threads_of_process() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("Threads:", 0) == 0) return std::stoi(line.substr(8));
  }
  return -1;
}

class PoolTest : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Threads, PoolTest, testing::Values(1, 2, 3, 4, 8));

TEST_P(PoolTest, EveryIndexOnce) {
  ThreadPool pool(GetParam());
  const sgrt::Run run = run_with(pool);
  for (std::int64_t n : {0, 1, 2, 63, 64, 65, 1000, 4097}) {
    for (std::int64_t block : {1, 3, 64, 5000}) {
      std::vector<std::atomic<int>> seen(static_cast<std::size_t>(n));
      parallel_for(run, n, block, [&](std::int64_t begin, std::int64_t end) {
        EXPECT_LT(begin, end);
        EXPECT_EQ(begin % block, 0);
        for (std::int64_t i = begin; i < end; ++i) ++seen[static_cast<std::size_t>(i)];
      });
      for (const auto& count : seen) ASSERT_EQ(count, 1);
    }
  }
}

// REQ-DET-001
TEST_P(PoolTest, SumHasTheBitsOfTheSerialOne) {
  ThreadPool pool(GetParam());
  for (std::int64_t n : {1, 100, 6400, 6401, 100003}) {
    for (std::int64_t block : {1, 7, 100}) {
      const double serial = harmonic(sgrt::Run{}, n, block);
      for (int repeat = 0; repeat < 5; ++repeat) EXPECT_EQ(bits(harmonic(run_with(pool), n, block)), bits(serial));
    }
  }
}

TEST_P(PoolTest, LowestFailingBlockComesOut) {
  ThreadPool pool(GetParam());
  for (int repeat = 0; repeat < 100; ++repeat) {
    std::atomic<int> done{0};
    try {
      parallel_for(run_with(pool), 1000, 1, [&](std::int64_t i, std::int64_t) {
        ++done;
        if (i >= 17 && i % 3 == 2) throw std::runtime_error(std::to_string(i));
      });
      ADD_FAILURE() << "no exception";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "17");
    }
    EXPECT_GE(done, 18);
    EXPECT_LE(done, 18 + 1 + GetParam() * 3);  // the rest is skipped, but for what was under way
  }
  EXPECT_EQ(bits(harmonic(run_with(pool), 1000, 10)), bits(harmonic(sgrt::Run{}, 1000, 10)));  // and the pool goes on
}

// REQ-CTX-001
TEST_P(PoolTest, ProgressOnTheCallingThreadOnly) {
  ThreadPool pool(GetParam());
  sgrt::Run run = run_with(pool);
  const auto caller = std::this_thread::get_id();
  double last = 0;
  int calls = 0;
  run.progress = [&](double fraction, const char* stage) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_STREQ(stage, "counting");
    EXPECT_GE(fraction, last - 1e-12);
    EXPECT_LE(fraction, 1);
    last = fraction;
    ++calls;
    return false;
  };
  parallel_sum(
      run, 1000, 1, 0,
      [&](std::int64_t, std::int64_t) {
        if (std::this_thread::get_id() != caller) run.poll(2, "a worker's poll does nothing");
        return 1;
      },
      "counting");
  EXPECT_GT(calls, 0);
}

// REQ-CTX-002
TEST_P(PoolTest, CancelStopsSoon) {
  ThreadPool pool(GetParam());
  sgrt::Run run = run_with(pool);
  std::atomic<int> done{0};
  run.progress = [&](double, const char*) { return done > 20; };
  expect_error(Status::kCancelled, "counting", [&] {
    parallel_for(
        run, 100000, 1,
        [&](std::int64_t, std::int64_t) {
          ++done;
          std::this_thread::sleep_for(std::chrono::microseconds(200));
        },
        "counting");
  });
  EXPECT_LT(done, 2000);
}

TEST_P(PoolTest, NestedRunsInline) {
  ThreadPool pool(GetParam());
  const sgrt::Run run = run_with(pool);
  const double serial = harmonic(sgrt::Run{}, 5000, 100);
  parallel_for(run, 64, 1, [&](std::int64_t, std::int64_t) {
    EXPECT_EQ(bits(harmonic(run, 5000, 100)), bits(serial));
    EXPECT_THROW(parallel_for(run, 10, 1, [](std::int64_t, std::int64_t) { throw std::logic_error("inner"); }),
                 std::logic_error);
  });
}

TEST_P(PoolTest, CallbackMayUseThePool) {
  ThreadPool pool(GetParam());
  sgrt::Run run = run_with(pool);
  const sgrt::Run quiet = run_with(pool);
  double inner = 0;
  run.progress = [&](double, const char*) {
    inner = harmonic(quiet, 1000, 10);
    return false;
  };
  parallel_for(run, 20, 1,
               [](std::int64_t, std::int64_t) { std::this_thread::sleep_for(std::chrono::milliseconds(1)); });
  EXPECT_EQ(bits(inner), bits(harmonic(sgrt::Run{}, 1000, 10)));
}

// REQ-CTX-004
TEST_P(PoolTest, ConcurrentCallsQueue) {
  ThreadPool pool(GetParam());
  const double serial = harmonic(sgrt::Run{}, 3000, 20);
  std::vector<std::thread> callers;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 6; ++t) {
    callers.emplace_back([&] {
      for (int repeat = 0; repeat < 50; ++repeat) wrong += bits(harmonic(run_with(pool), 3000, 20)) != bits(serial);
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(wrong, 0);
}

TEST_P(PoolTest, ManySmallJobs) {
  ThreadPool pool(GetParam());
  std::int64_t total = 0;
  for (int repeat = 0; repeat < 5000; ++repeat) {
    total +=
        parallel_sum(run_with(pool), 8, 1, std::int64_t{0}, [](std::int64_t begin, std::int64_t) { return begin; });
  }
  EXPECT_EQ(total, 5000 * 28);
}

// REQ-CTX-006
TEST(Pool, NeverMoreThreadsThanItsBudget) {
  std::thread([] {}).join();  // a sanitizer starts a thread of its own with the first one
  const int before = threads_of_process();
  {
    ThreadPool pool(4);
    EXPECT_EQ(threads_of_process(), before);  // lazy
    for (int repeat = 0; repeat < 3; ++repeat) harmonic(run_with(pool), 1000, 1);
    EXPECT_EQ(threads_of_process(), before + 3);
  }
  EXPECT_EQ(threads_of_process(), before);
}

TEST(Pool, CancelWhileAWorkerIsBusy) {
  ThreadPool pool(2);
  sgrt::Run run = run_with(pool);
  std::atomic<bool> worker_began{false};
  run.progress = [&](double, const char*) { return worker_began.load(); };
  const auto caller = std::this_thread::get_id();
  std::atomic<bool> stop{false};
  expect_error(Status::kCancelled, "", [&] {
    parallel_for(run, 1000000, 1, [&](std::int64_t, std::int64_t) {
      if (std::this_thread::get_id() != caller && !worker_began.exchange(true)) {
        for (int i = 0; i < 100; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      if (std::this_thread::get_id() == caller) std::this_thread::sleep_for(std::chrono::microseconds(50));
    });
  });
}

TEST(Pool, CancelWhileQueued) {
  ThreadPool pool(2);
  std::atomic<bool> began{false}, release{false};
  std::thread first([&] {
    parallel_for(run_with(pool), 2, 1, [&](std::int64_t, std::int64_t) {
      began = true;
      while (!release) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    });
  });
  while (!began) std::this_thread::yield();
  sgrt::Run second = run_with(pool);
  int polls = 0;
  second.progress = [&](double, const char*) { return ++polls == 3; };
  bool worked = false;
  expect_error(Status::kCancelled, "",
               [&] { parallel_for(second, 100, 1, [&](std::int64_t, std::int64_t) { worked = true; }); });
  EXPECT_EQ(polls, 3);
  EXPECT_FALSE(worked);
  release = true;
  first.join();
}

TEST(Pool, ACallbackThatThrowsComesOut) {
  ThreadPool pool(3);
  sgrt::Run run = run_with(pool);
  run.progress = [](double, const char*) -> bool { throw std::out_of_range("mine"); };
  EXPECT_THROW(harmonic(run, 1000, 1), std::out_of_range);
  EXPECT_THROW(harmonic(sgrt::Run{nullptr, Isa::kBaseline, run.progress, {}}, 1000, 1), std::out_of_range);
}

TEST(Pool, SumOfMatrices) {
  ThreadPool pool(3);
  const auto moment = [](std::int64_t begin, std::int64_t end) {
    Mat6 sum = Mat6::Zero();
    for (std::int64_t i = begin; i < end; ++i)
      sum += Vec6::Constant(1.0 / static_cast<double>(i + 1)) * Vec6::Ones().transpose();
    return sum;
  };
  const Mat6 zero = Mat6::Zero();
  EXPECT_EQ(parallel_sum(run_with(pool), 20000, 11, zero, moment), parallel_sum(sgrt::Run{}, 20000, 11, zero, moment));
}

TEST(Pool, RefusesNonsense) {
  expect_error(Status::kInvalidArgument, "threads", [] { ThreadPool pool(0); });
  ThreadPool pool(2);
  expect_error(Status::kInvalidArgument, "block", [&] { harmonic(run_with(pool), 10, 0); });
  expect_error(Status::kInvalidArgument, "block", [&] { harmonic(sgrt::Run{}, 10, -1); });
  EXPECT_EQ(harmonic(run_with(pool), -5, 10), 0);
}

#if !defined(__SANITIZE_THREAD__)  // which does not follow a child that starts threads
// REQ-CTX-005
TEST(Pool, WorksAgainInAForkedChild) {
  ThreadPool pool(3);
  const double serial = harmonic(sgrt::Run{}, 10000, 10);
  ASSERT_EQ(bits(harmonic(run_with(pool), 10000, 10)), bits(serial));
  for (int repeat = 0; repeat < 20; ++repeat) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      alarm(20);
      bool good = true;
      for (int i = 0; i < 10; ++i) good = good && bits(harmonic(run_with(pool), 10000, 10)) == bits(serial);
      _exit(good ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  }
  EXPECT_EQ(bits(harmonic(run_with(pool), 10000, 10)), bits(serial));
}

// REQ-CTX-005
TEST(Pool, ForkWhileBusyAndDestroyInTheChild) {
  auto pool = std::make_unique<ThreadPool>(3);
  std::atomic<bool> stop{false};
  std::thread other([&] {
    while (!stop) harmonic(run_with(*pool), 1000, 1);
  });
  for (int repeat = 0; repeat < 20; ++repeat) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      alarm(20);
      if (repeat % 2) harmonic(run_with(*pool), 1000, 1);
      pool.reset();
      _exit(0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  }
  stop = true;
  other.join();
}
#endif

// REQ-CTX-008
TEST(RunTest, Isa) {
  const Isa isa = detect_isa();
  EXPECT_TRUE(isa == Isa::kBaseline || isa == Isa::kAvx2);
}

}  // namespace
}  // namespace sgrt
