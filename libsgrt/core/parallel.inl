// The templates of core/parallel.hpp.
#pragma once

#include <algorithm>
#include <type_traits>

namespace sgrt {
namespace detail {

// Every block of [0, n), on the pool where there is one and the caller is not itself a block.
void run_blocks(const Run& run, std::int64_t n, std::int64_t block, ThreadPool::Block call, void* body,
                const char* stage);

// Sums waiting to be added in block order; bounds the memory of parallel_sum, which lies on the stack.
constexpr std::int64_t kWindow = 64;

}  // namespace detail

template <class Body>
void parallel_for(const Run& run, std::int64_t n, std::int64_t block, Body&& body, const char* stage) {
  using Function = std::remove_reference_t<Body>;
  const auto call = [](void* f, std::int64_t begin, std::int64_t end) { (*static_cast<Function*>(f))(begin, end); };
  detail::run_blocks(run, n, block, call, const_cast<void*>(static_cast<const void*>(&body)), stage);
}

template <class Sum, class Body>
Sum parallel_sum(const Run& run, std::int64_t n, std::int64_t block, const Sum& zero, Body&& body, const char* stage) {
  Sum total = zero;
  Sum partial[detail::kWindow];
  struct {
    const Run* run;
    double begin, share;
  } window{&run, 0, 1};
  Run part;
  part.pool = run.pool;
  part.isa = run.isa;
  if (run.progress) {
    part.progress = [&window](double fraction, const char* name) {
      return window.run->progress(window.begin + window.share * fraction, name);
    };
  }
  const std::int64_t step = block > 0 && block <= n / detail::kWindow ? block * detail::kWindow : n;
  for (std::int64_t first = 0; first < n; first += step) {
    const std::int64_t count = std::min(step, n - first);
    window.begin = static_cast<double>(first) / static_cast<double>(n);
    window.share = static_cast<double>(count) / static_cast<double>(n);
    parallel_for(
        part, count, block,
        [&](std::int64_t begin, std::int64_t end) { partial[begin / block] = body(first + begin, first + end); },
        stage);
    for (std::int64_t i = 0; i * block < count; ++i) total += partial[i];
  }
  return total;
}

}  // namespace sgrt
