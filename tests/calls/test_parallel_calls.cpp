// Promises 5 and 6: the same bytes at any number of threads, and const handles used by any number of threads. Every
// base call is made at 1, 2, 3, 4, 8 and 16 threads of its context, then by 16 threads at once on the same handles,
// half of them with contexts of their own (load), half without; each answer must have the bytes of the serial one.
//
//   test_parallel_calls [expected.txt] [--seconds N]   the storm goes on for N seconds, 10 unless said
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "calls.hpp"

using namespace calls;

namespace {

std::atomic<int> failures{0};

std::string answer_of(const Function& f) {
  if (!std::strcmp(f.name, "sgrt_last_error")) return "";  // the thread's own history
  Call call(f);
  call.seal();
  call.run();
  call.open();
  return call.digest();
}

void compare(const Function& f, const std::string& serial, const char* how, int number) {
  if (answer_of(f) == serial) return;
  if (++failures <= 20) std::fprintf(stderr, "%s: other bytes %s %d\n", f.name, how, number);
}

// The heaviest calls are taken by one thread in four, so that a round stays short.
bool heavy(const Function& f) {
  for (const char* word : {"learn", "landmarks_find", "advise", "calibration", "deform_align", "board_detect"})
    if (std::strstr(f.name, word)) return true;
  return false;
}

void storm(const std::vector<std::string>& serial, int number, double seconds) {
  sgrt_context* mine = number % 2 ? context_with(2) : nullptr;
  context_of_calls = mine;
  const auto start = std::chrono::steady_clock::now();
  do {
    for (std::size_t i = 0; i < functions().size(); ++i) {
      const std::size_t at = (i + 14 * static_cast<std::size_t>(number)) % functions().size();
      const Function& f = functions()[at];
      if (!heavy(f) || number % 4 == 1) compare(f, serial[at], "in thread", number);
    }
  } while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds);
  context_of_calls = nullptr;
  sgrt_context_free(mine);
}

}  // namespace

int main(int count, char** arguments) {
  double seconds = 10;
  for (int i = 1; i + 1 < count; ++i) {
    if (!std::strcmp(arguments[i], "--seconds")) seconds = std::atof(arguments[i + 1]);
  }
  build_world();
  std::vector<std::string> serial;
  serial.reserve(functions().size());
  for (const Function& f : functions()) serial.push_back(answer_of(f));
  for (int threads : {1, 2, 3, 4, 8, 16}) {
    context_of_calls = context_with(threads);
    for (std::size_t i = 0; i < functions().size(); ++i) {
      if (functions()[i].params.empty() || functions()[i].params[0].kind != Param::kContext) continue;
      compare(functions()[i], serial[i], "at threads =", threads);
    }
    sgrt_context_free(context_of_calls);
    context_of_calls = nullptr;
  }
  std::vector<std::thread> threads;
  for (int i = 0; i < 16; ++i) threads.emplace_back(storm, std::cref(serial), i, seconds);
  for (std::thread& thread : threads) thread.join();
  free_world();
  std::printf("%zu functions, %d with other bytes\n", functions().size(), failures.load());
  return failures != 0;
}
